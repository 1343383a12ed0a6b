"""Faces of cells: triangles and bilinear quadrilaterals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["face_area_vectors"]


def face_area_vectors(points: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """(f, 3) integrals of the unit normal over faces (f, 3) or (f, 4): normals, as long as the area of what is flat.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> face_area_vectors(square, np.array([[0, 1, 2]])).tolist()
    [[0.0, 0.0, 0.5]]
    """
    x = points[faces]
    sides = (x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) if faces.shape[1] == 3 else (x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    return np.asarray(np.cross(*sides) / 2)
