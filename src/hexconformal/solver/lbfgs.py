"""Limited-memory BFGS."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .fields import accumulate
from .problem import Iterate, Preconditioner, line_search

__all__ = ["lbfgs"]

Field = NDArray[np.float64]

_LEAST_CURVATURE = 1e-10  # of a pair, relative; less is rounding


def lbfgs(current: Iterate, preconditioner: Preconditioner, scaled: bool = False) -> Iterator[Iterate]:
    """Limited-memory BFGS with a preconditioner as initial inverse (Nocedal & Wright, algorithm 7.4).

    Parameters
    ----------
    current
        Where to begin.
    preconditioner
        Positive definite approximation of the inverse Hessian, maps admissible fields to admissible fields.
    scaled
        The preconditioner knows no size: it is scaled by the last pair (Nocedal & Wright, equation 7.20), and the first
        step is no longer than the mesh's unit at any node.

    Yields
    ------
    The iterate after every iteration; with a step of 0 where nothing better was found.
    """
    space = current.problem.space
    inner = space.inner
    pairs: deque[tuple[Field, Field, float]] = deque(maxlen=current.problem.search.memory)
    scale = 1.0
    while True:
        current = current.renewed()
        q = current.gradient.copy()
        factors = []
        for s, y, rho in reversed(pairs):
            factors.append(rho * inner(s, q))
            accumulate(q, -factors[-1], y)
        direction = preconditioner(q)
        if scaled:
            direction *= scale if pairs else 1.0 / max(space.largest(np.abs(direction)), 1e-300)
        for (s, y, rho), factor in zip(pairs, reversed(factors), strict=True):
            accumulate(direction, factor - rho * inner(y, direction), s)
        following = line_search(current, -direction)
        if following.step == 0.0 and pairs:
            pairs.clear()
            continue
        s, y = following.points - current.points, following.gradient - current.gradient
        curvature = inner(s, y)
        if curvature > _LEAST_CURVATURE * np.sqrt(inner(s, s) * inner(y, y)):
            pairs.append((s, y, 1.0 / curvature))
            scale = curvature / max(inner(y, preconditioner(y)), 1e-300) if scaled else 1.0
        current = following
        yield current
