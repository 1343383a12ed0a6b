"""The linear pyramid: a square, and four equilateral triangles."""

from __future__ import annotations

import numpy as np

from .cell_type import CellType

__all__ = ["PYRAMID"]

PYRAMID = CellType(
    name="pyramid",
    singular="pyramid",
    plural="pyramids",
    vtk=14,
    ideal=np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, np.sqrt(0.5)]]),
    axes=np.eye(3),
    # At the apex four edges meet: the corners of the base decide there, too.
    neighbours=np.array([[1, 3, 4], [2, 0, 4], [3, 1, 4], [0, 2, 4]], dtype=np.int64),
    samples=(0, 1, 2, 3),
    edges=np.array([[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]], dtype=np.int64),
    faces=((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    mirrored=(0, 3, 2, 1, 4),
    reference_volume=1.0 / 3.0,
)
