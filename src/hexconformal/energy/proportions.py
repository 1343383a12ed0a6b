"""Proportions at the corners of a cell: edges that are much longer than others there cost something, equation (12a).

The angles say nothing of lengths, and the distortion of a flat brick little: cells get thin for the sake of angles. Of
every two edges at a corner, l1 >= l2 relative to their target, the density is

    w (x^2 + 8 x^4),    x = max(log(l1 / l2) - log(slender), 0),

zero up to a ratio that does no harm, mild up to twice that, steep beyond. Its Gauss-Newton part is what the convex
Hessian gets.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernel import Vector, algebra, dot, frame_at, scale, vector_at
from .convex_frames import DENSITY, FRAME
from .corner_blocks import BLOCKS, COLUMN

__all__ = ["add_proportions"]

Field = NDArray[np.float64]

_STEEP = 8.0  # weight of x^4 beside x^2


@algebra
def add_proportions(s: Field, weight: float, slender: float, order: int) -> None:
    """Add the densities of all corners, with derivatives from order 1 on."""
    widest = 0.0
    for q in range(8):
        f = frame_at(s, FRAME, q)
        a, b, c = dot(f[0], f[0]), dot(f[1], f[1]), dot(f[2], f[2])
        widest = max(widest, max(a, max(b, c)) / min(a, min(b, c)))
    # Few cells are slender: for the others there is nothing to do.
    if widest > slender * slender:
        limit = np.log(slender)
        for q in range(8):
            _add_pair(s, q, weight, limit, order, 0, 1, BLOCKS, BLOCKS + 9, BLOCKS + 27)
            _add_pair(s, q, weight, limit, order, 0, 2, BLOCKS, BLOCKS + 18, BLOCKS + 45)
            _add_pair(s, q, weight, limit, order, 1, 2, BLOCKS + 27, BLOCKS + 36, BLOCKS + 45)


@algebra
def _add_pair(
    s: Field, q: int, weight: float, limit: float, order: int, i: int, j: int, own: int, mixed: int, other: int
) -> None:
    f, g = vector_at(s, FRAME + 3 * i, q), vector_at(s, FRAME + 3 * j, q)
    a, b = dot(f, f), dot(g, g)
    log = 0.5 * np.log(a / b)
    over = abs(log) - limit
    if over > 0.0:
        square = over * over
        s[DENSITY, q] += weight * square * (1.0 + _STEEP * square)
        if order > 0:
            slope = weight * over * (2.0 + 4.0 * _STEEP * square) * (1.0 if log > 0.0 else -1.0)
            bend = weight * (2.0 + 12.0 * _STEEP * square)
            u, v = scale(1.0 / a, f), scale(-1.0 / b, g)
            for k in range(3):
                s[COLUMN + 3 * i + k, q] += slope * u[k]
                s[COLUMN + 3 * j + k, q] += slope * v[k]
            _add_outer(s, own, q, bend, u, u)
            _add_outer(s, mixed, q, bend, u, v)
            _add_outer(s, other, q, bend, v, v)


@algebra
def _add_outer(s: Field, row: int, q: int, weight: Any, u: Vector, v: Vector) -> None:
    for r in range(3):
        for c in range(3):
            s[row + 3 * r + c, q] += weight * u[r] * v[c]
