"""Crack fronts: edges of a boundary where the mesh goes all the way round, from one side of a slit to the other."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ...elements import CellType, rows_by_type
from ...mesh import unique_edges
from ..area_vectors import face_area_vectors
from ..edges import EdgeTable, edge_table
from ..faces import Faces
from .schedules import FeatureSchedule

__all__ = ["crack_fronts", "kept_edges"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def kept_edges(points: Floats, faces: Faces | Ints, cells: Ints, tags: Ints | None = None) -> Ints:
    """Edges of a boundary that are kept though it may be flat there.

    These are crack fronts, edges with other than two faces, and those where tags change.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    faces
        Of the boundary.
    cells
        (m, 8) the cells whose boundary this is.
    tags
        (f,) integers per face.

    Returns
    -------
    (k, 2) nodes.

    Examples
    --------
    A cube of two by two by two cells, slit half-way through at half its height.

    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh.topology import boundary_quads
    >>> points, cells = box((2, 2, 2))
    >>> lip = np.flatnonzero((points[:, 2] == 0.5) & (points[:, 0] < 0.5))
    >>> upper = cells.copy()
    >>> upper[4:][np.isin(upper[4:], lip)] += len(points)
    >>> twice = np.concatenate([points, points])
    >>> twice[kept_edges(twice, boundary_quads(upper)[0], upper), 0].tolist()
    [[0.5, 0.5], [0.5, 0.5]]
    """
    edges = edge_table(faces)
    kept = crack_fronts(points, faces, edges, cells)
    if tags is not None:
        kept |= tags[edges.sides[:, 0]] != tags[edges.sides[:, 1]]
    return edges.nodes[np.union1d(edges.manifold[kept], edges.nonmanifold)]


def crack_fronts(
    points: Floats, faces: Faces | Ints, edges: EdgeTable, cells: Ints, opening: float = FeatureSchedule.opening
) -> NDArray[np.bool_]:
    """Find the crack fronts of a boundary: its two faces lie on each other, and cells fill the 360 degrees around.

    The angle inside is the sum over the cells around an edge of the angles, with their signs, between the two faces
    of each. So a face that is folded onto its neighbour, the cell of which counts negative, makes no front.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    faces
        Of the boundary.
    edges
        Of these faces.
    cells
        (m, 8) the cells whose boundary this is.
    opening
        Degrees between the faces up to which they lie on each other.

    Returns
    -------
    (s,) a flag for each edge with two faces.
    """
    fronts = np.zeros(len(edges.manifold), dtype=bool)
    area = face_area_vectors(points, faces)
    size = np.linalg.norm(area, axis=1)
    left, right = edges.sides.T
    most = -np.cos(np.radians(opening)) * size[left] * size[right]
    opposed = np.flatnonzero(np.einsum("ei,ei->e", area[left], area[right]) < most)
    if len(opposed) == 0:
        return fronts
    nodes = edges.nodes[edges.manifold[opposed]]
    touched = np.zeros(len(points), dtype=bool)
    touched[nodes] = True
    near = cells[np.flatnonzero(touched[cells].sum(axis=1) >= 2)]
    inside = np.zeros(len(nodes))
    for one in rows_by_type(near):
        own, beside = one.own_nodes(near), _beside(one.cell_type)
        # Every edge of these cells, behind the opposed ones: those with the same nodes get the same number.
        pairs = np.sort(own[:, one.cell_type.edges].reshape(-1, 2), axis=1)
        table = unique_edges(np.concatenate([nodes, pairs]))
        number = np.full(len(table.nodes), -1)
        number[table.of_pairs[: len(nodes)]] = np.arange(len(nodes))
        of = number[table.of_pairs[len(nodes) :]]
        which = np.flatnonzero(of >= 0)
        cell, edge = np.divmod(which, len(beside))
        angles = _dihedral_angles(points[own[cell]], one.cell_type.edges[edge], beside[edge])
        inside += np.bincount(of[which], angles, minlength=len(nodes))
    fronts[opposed] = inside > 360.0 - opening
    return fronts


def _dihedral_angles(x: Floats, edges: Ints, beside: Ints) -> Floats:
    """(k,) degrees between the two faces at an edge (k, 2) of each cell, negative where it is turned inside out.

    The cells are given by their nodes (k, j, 3), the faces by their nodes next to the ends of the edge (k, 2, 2).
    """
    rows = np.arange(len(x))[:, None]
    a, b = x[rows[:, 0], edges[:, 0]], x[rows[:, 0], edges[:, 1]]
    one, two = (x[rows, beside[:, face]].sum(axis=1) - (a + b) for face in range(2))
    along = b - a
    length = np.einsum("ki,ki->k", along, along)
    across = np.einsum("ki,ki->k", along, np.cross(one, two)) * np.sqrt(length)
    flat = np.einsum("ki,ki->k", one, two) * length
    flat -= np.einsum("ki,ki->k", one, along) * np.einsum("ki,ki->k", two, along)
    return np.asarray(np.degrees(np.arctan2(across, flat)))


@cache
def _beside(cell_type: CellType) -> Ints:
    """(e, 2, 2) nodes next to both ends of every edge, on its two faces in the order of a positive turn about it."""
    out = np.empty((len(cell_type.edges), 2, 2), dtype=np.int64)
    for edge, (a, b) in enumerate(cell_type.edges.tolist()):
        for face in cell_type.faces:
            if {a, b} <= set(face):
                i, j = face.index(a), face.index(b)
                # Seen from outside the face on the left of the edge runs along it, the one on its right back.
                ahead = face[(i + 1) % len(face)] == b
                step = 1 if ahead else -1
                if face[(i + step) % len(face)] == b:
                    out[edge, 1 if ahead else 0] = face[(i - step) % len(face)], face[(j + step) % len(face)]
    return out
