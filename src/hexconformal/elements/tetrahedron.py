"""The linear tetrahedron: regular, inscribed in a cube whose axes are those in which it is measured."""

from __future__ import annotations

import numpy as np

from .cell_type import CellType

__all__ = ["TETRAHEDRON"]

TETRAHEDRON = CellType(
    name="tetra",
    singular="tetrahedron",
    plural="tetrahedra",
    vtk=10,
    ideal=np.array([[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]]) / (2.0 * np.sqrt(2.0)),
    axes=np.eye(3),
    neighbours=np.array([[1, 2, 3], [0, 3, 2], [3, 0, 1], [2, 1, 0]], dtype=np.int64),
    samples=(0,),
    edges=np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]], dtype=np.int64),
    faces=((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    mirrored=(0, 2, 1, 3),
    reference_volume=1.0 / 6.0,
)
