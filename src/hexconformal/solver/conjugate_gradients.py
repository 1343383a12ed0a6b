"""Preconditioned conjugate gradients for fields on nodes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..mesh import SERIAL, Space
from .fields import accumulate

__all__ = ["conjugate_gradients"]

Field = NDArray[np.float64]


def conjugate_gradients(
    product: Callable[[Field], Field],
    preconditioner: Callable[[Field], Field],
    rhs: Field,
    tolerance: float,
    max_iterations: int = 200,
    space: Space = SERIAL,
) -> Field:
    """Solve A x = rhs from zero; stops at a direction of negative curvature.

    Parameters
    ----------
    product
        The matrix A times a field (n, 3).
    preconditioner
        Positive definite approximation of the inverse.
    rhs
        (n, 3) right-hand side.
    tolerance
        Stop where |r| <= tolerance |rhs| in the norm of the preconditioner.
    max_iterations
        Stop after so many.
    space
        Where the fields live.

    Returns
    -------
    (n, 3) solution. Before the first step a direction of negative curvature is returned as it is: it still descends.

    Examples
    --------
    >>> diagonal = np.arange(1.0, 7.0).reshape(2, 3)
    >>> conjugate_gradients(lambda x: diagonal * x, lambda r: r, diagonal, 1e-12).round(9)
    array([[1., 1., 1.],
           [1., 1., 1.]])
    """
    x = np.zeros_like(rhs)
    r = rhs.copy()
    z = preconditioner(r)
    p = z.copy()
    rz = first = space.inner(r, z)
    for iteration in range(max_iterations):
        if rz <= tolerance**2 * first:
            break
        hp = product(p)
        curvature = space.inner(p, hp)
        if curvature <= 0.0:
            return p if iteration == 0 else x
        alpha = rz / curvature
        accumulate(x, alpha, p)
        accumulate(r, -alpha, hp)
        z = preconditioner(r)
        rz, old = space.inner(r, z), rz
        p *= rz / old
        p += z
    return x
