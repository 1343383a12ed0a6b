"""Give volume to cells that have next to none: the regularized barrier, with every cell kept valid.

Where a cell is thin the barrier of equation (8) is steep: it outweighs all other cells, pushes the surface to its bound
and holds what is around. chi_eps of equation (9) is bounded, so that thin cells open at the pace of the others; that
no cell folds is seen to by the line search.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..energy import CornerWeights
from ..formulation import Formulation, Iteration, convex_newton

__all__ = ["thicken"]


def thicken(formulation: Formulation, points: NDArray[np.float64]) -> Iterator[Iteration]:
    """Thicken the thin cells of a valid mesh, until there is none or it stalls."""
    schedule = formulation.schedules.thin

    def thinnest() -> float:
        return float(formulation.measures(points).fullness.min(initial=1.0))

    if not 0.0 < thinnest() < schedule.thin:
        return
    steps = convex_newton(formulation, points, CornerWeights(eps=schedule.eps), decrease=schedule.decrease)
    for iterate in islice(steps, schedule.steps):
        points = iterate.points
        yield Iteration("thicken", points)
        if thinnest() >= schedule.thin:
            return
