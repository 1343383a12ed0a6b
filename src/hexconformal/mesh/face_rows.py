"""Faces in rows of four nodes: a triangle has its last node twice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["face_keys", "triangles_first", "turned_over", "whole_faces", "with_last_twice"]

Ints = NDArray[np.int64]


def face_keys(faces: Ints) -> Ints:
    """(k, 4) nodes of faces in ascending order, equal for equal faces: of triangles (their last node twice) behind -1.

    Examples
    --------
    >>> face_keys(np.array([[3, 1, 2, 2], [0, 3, 2, 1]]))
    array([[-1,  1,  2,  3],
           [ 0,  1,  2,  3]])
    """
    keys = faces.copy()
    keys[faces[:, 2] == faces[:, 3], 3] = -1
    return np.sort(keys, axis=1)


def turned_over(faces: Ints) -> Ints:
    """Faces (k, 3) or (k, 4) seen from the other side, triangles with their last node twice, too.

    Examples
    --------
    >>> turned_over(np.array([[3, 1, 2, 2], [0, 3, 2, 1]]))
    array([[3, 2, 1, 1],
           [0, 1, 2, 3]])
    """
    if faces.shape[1] == 3:
        return faces[:, [0, 2, 1]]
    triangles = faces[:, 2] == faces[:, 3]
    return np.where(triangles[:, None], faces[:, [0, 2, 1, 1]], faces[:, [0, 3, 2, 1]])


def triangles_first(faces: Ints) -> Ints:
    """(k,) order of faces (k, 4) in which triangles, with their last node twice, come before quadrilaterals."""
    return np.argsort(faces[:, 2] != faces[:, 3], kind="stable")


def whole_faces(faces: Ints) -> Ints:
    """Faces (k, 4) of collapsed cells without those of fewer than three nodes; triangles have their last node twice."""
    different = np.diff(np.sort(faces, axis=1), axis=1) != 0
    return with_last_twice(faces[different.sum(axis=1) >= 2])


def with_last_twice(quads: Ints) -> Ints:
    """Faces (k, 4) with the node that a triangle has twice at the end."""
    quads = quads.copy()
    for _ in range(3):
        turned = np.flatnonzero((quads == np.roll(quads, 1, axis=1)).any(axis=1) & (quads[:, 2] != quads[:, 3]))
        quads[turned] = np.roll(quads[turned], 1, axis=1)
    return quads
