"""Vectors and frames in the work array of a compiled loop: a column per quadrature point, a row per component.

A loop over its columns works on several points at once, because everything in the loop is inlined and free of
branches, and because rows of one array of constant shape are known not to overlap. How many columns there are is known
when a loop is compiled: a tuple of them, `lanes`, is passed on, not their number.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .distortion import Frame
from .jit import algebra
from .quaternion import Vector

__all__ = ["EIGHT", "Lanes", "frame_at", "store", "store_inverses", "vector_at"]

Field = NDArray[np.float64]
Lanes = tuple[int, ...]

EIGHT: Lanes = (0, 1, 2, 3, 4, 5, 6, 7)


@algebra
def vector_at(s: Field, row: int, q: int) -> Vector:
    """The vector in three rows, at point q."""
    return s[row, q], s[row + 1, q], s[row + 2, q]


@algebra
def frame_at(s: Field, row: int, q: int) -> Frame:
    """The frame in nine rows, column by column."""
    return vector_at(s, row, q), vector_at(s, row + 3, q), vector_at(s, row + 6, q)


@algebra
def store(f: Frame, s: Field, row: int, q: int) -> None:
    """Write a frame into nine rows."""
    s[row, q], s[row + 1, q], s[row + 2, q] = f[0]
    s[row + 3, q], s[row + 4, q], s[row + 5, q] = f[1]
    s[row + 6, q], s[row + 7, q], s[row + 8, q] = f[2]


@algebra
def store_inverses(inverses: Field, c: int, s: Field, row: int, lanes: Lanes) -> None:
    """Write W^-1 at the quadrature points of cell c into nine rows, row by row; nothing if targets are unit cubes."""
    if len(inverses) > 0:
        target = c if len(inverses) > 1 else 0
        step = 1 if inverses.shape[1] > 1 else 0
        for q in range(len(lanes)):
            for i in range(3):
                for j in range(3):
                    s[row + 3 * i + j, q] = inverses[target, q * step, i, j]
