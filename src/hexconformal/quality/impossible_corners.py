"""Connections that no valid mesh has, wherever its nodes are.

Seen from a node, its edges are points of a sphere, its faces arcs between them, and its cells triangles; in a valid
mesh these fill the sphere once, or a part of it at the boundary. Two faces at the node between the same two edges are
two arcs between the same two points. With edges less than 180 degrees apart both are the one shortest arc, and nothing
is left for the cells between the faces. Equation (13b) of docs/mathematics.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..mesh import FaceTable

__all__ = ["impossible_corners"]

Ints = NDArray[np.int64]


def impossible_corners(faces: FaceTable, cells: Ints) -> Ints:
    """Nodes at which two different faces lie between the same two edges.

    Parameters
    ----------
    faces
        Of the mesh, as :func:`hexconformal.mesh.topology.face_table` finds them.
    cells
        (m, 8) hexahedra in VTK order.

    Returns
    -------
    ndarray
        (k,) nodes around which the cells form a ball, or half of one at the boundary, and cannot all be valid.

    Examples
    --------
    Two cells with two faces in common: folded to and fro, one of them would have to be flat.

    >>> from hexconformal.mesh.topology import face_table
    >>> cells = np.array([[0, 1, 2, 3, 4, 5, 6, 7], [0, 3, 8, 1, 4, 7, 9, 5]])
    >>> impossible_corners(face_table(cells), cells)
    array([0, 4])
    """
    quads = faces.quads[faces.quads[:, 2] != faces.quads[:, 3]]  # triangles have no diagonals
    nodes, one, other = _same_diagonals(quads)
    # Two faces with one diagonal in common are doubled at each further node that they share.
    corners, others = quads[one], quads[other]
    shared = (corners[:, :, None] == others[:, None, :]).any(axis=2)
    shared &= (corners[:, :, None] != nodes[:, None, :]).all(axis=2)
    found = np.unique(corners[shared])
    return np.array([node for node in found if _is_ball(node, faces, cells)], dtype=np.int64)


def _same_diagonals(quads: Ints) -> tuple[Ints, Ints, Ints]:
    """(k, 2) diagonals that two faces have in common, and the (k,) faces."""
    ends = np.concatenate([quads[:, [0, 2]], quads[:, [1, 3]]])
    ends.sort(axis=1)
    keys = ends[:, 0] * (int(ends.max(initial=0)) + 1) + ends[:, 1]
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    first = np.flatnonzero(keys[1:] == keys[:-1])
    return ends[order[first]], order[first] % len(quads), order[first + 1] % len(quads)


def _is_ball(node: int, faces: FaceTable, cells: Ints) -> bool:
    """True where the cells around a node form a ball with it inside or on its surface, by Euler's number."""
    around = (faces.quads == node).any(axis=1)
    quads = faces.quads[around]
    place = np.argmax(quads == node, axis=1)
    rows = np.arange(len(quads))
    after = quads[rows, (place + 1) % 4]
    after = np.where(after == node, quads[rows, (place + 2) % 4], after)  # a triangle has its last node twice
    edges = np.unique([quads[rows, place - 1], after])
    number = len(edges) - len(quads) + int((cells == node).any(axis=1).sum())
    return number == (2 if (faces.counts[around] > 1).all() else 1)
