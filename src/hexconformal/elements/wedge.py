"""The linear wedge: an equilateral triangle, extruded by the length of its edges.

Nodes 0, 1, 2 run counter-clockwise seen from 3, 4, 5, as VTK 9 counts a positive volume.
"""

from __future__ import annotations

import numpy as np

from .cell_type import CellType

__all__ = ["WEDGE"]

_RADIUS = np.sqrt(1.0 / 3.0)  # of the circle through the corners of the triangle
_TRIANGLE = np.array([[_RADIUS, 0.0], [-_RADIUS / 2, 0.5], [-_RADIUS / 2, -0.5]])

WEDGE = CellType(
    name="wedge",
    singular="wedge",
    plural="wedges",
    vtk=13,
    # Node 0 lies on the first axis, which bisects the angle there.
    ideal=np.array([[x, y, z] for z in (0.0, 1.0) for x, y in _TRIANGLE]),
    axes=np.eye(3),
    neighbours=np.array([[1, 2, 3], [2, 0, 4], [0, 1, 5], [5, 4, 0], [3, 5, 1], [4, 3, 2]], dtype=np.int64),
    samples=(0, 1, 2, 3, 4, 5),
    edges=np.array([[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]], dtype=np.int64),
    faces=((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    mirrored=(3, 4, 5, 0, 1, 2),
    reference_volume=0.5,
)
