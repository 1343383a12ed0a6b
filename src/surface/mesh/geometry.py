"""Geometry of triangle and bilinear quadrilateral surfaces: area vectors, normals, volume, angles.

A surface is points (n, 3) and `Cells`: triangles (t, 3) and quadrilaterals (q, 4), both counter-clockwise seen
from outside. Everything is exact for the bilinear patch of a quadrilateral unless its docstring differs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexconformal.elements import face_area_vectors
from hexconformal.mesh import face_edges, unique_edges

__all__ = [
    "Cells",
    "area_gradient",
    "area_vectors",
    "cell_angles",
    "cell_areas",
    "corner_triangles",
    "enclosed_volume",
    "fan_triangles",
    "mean_edge_length",
    "nodal_area_vectors",
    "nodal_areas",
    "slivers",
    "unit_vectors",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_QUAD_MASS = np.array([[4, 2, 1, 2], [2, 4, 2, 1], [1, 2, 4, 2], [2, 1, 2, 4]]) / 36.0


@dataclass(frozen=True, eq=False)
class Cells:
    """The cells of a surface, sorted by their number of corners.

    Attributes
    ----------
    triangles
        (t, 3) node ids.
    quads
        (q, 4) node ids.
    """

    triangles: Ints
    quads: Ints

    def __len__(self) -> int:
        return len(self.triangles) + len(self.quads)

    def groups(self) -> tuple[Ints, ...]:
        """The tables of node ids that are not empty."""
        return tuple(table for table in (self.triangles, self.quads) if len(table))

    def nodes(self) -> Ints:
        """Ids of the nodes that belong to a cell, ascending."""
        return np.unique(np.concatenate([self.triangles.ravel(), self.quads.ravel()]))

    def corners_of(self, cells: NDArray[np.bool_]) -> Ints:
        """Node ids at the corners of some cells, (m,) booleans, one by one."""
        t = len(self.triangles)
        return np.concatenate([self.triangles[cells[:t]].ravel(), self.quads[cells[t:]].ravel()])

    def edges(self) -> Ints:
        """(e, 2) every edge once, the lower id first."""
        return unique_edges(np.concatenate([face_edges(table) for table in self.groups()])).nodes


def unit_vectors(vectors: Floats) -> Floats:
    """Vectors (..., 3) scaled to unit length; zero where they vanish.

    >>> unit_vectors(np.array([[0.0, 3.0, 4.0], [0.0, 0.0, 0.0]]))
    array([[0. , 0.6, 0.8],
           [0. , 0. , 0. ]])
    """
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1.0))


def area_vectors(points: Floats, cells: Cells) -> Floats:
    """(m, 3) integral of the unit normal over each cell: triangles first, then quadrilaterals.

    >>> cells = Cells(np.array([[0, 1, 2]]), np.array([[0, 1, 2, 3]]))
    >>> area_vectors(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), cells)[:, 2]
    array([0.5, 1. ])
    """
    return np.concatenate([face_area_vectors(points, cells.triangles), face_area_vectors(points, cells.quads)])


def _corner_products(points: Floats, table: Ints) -> Floats:
    """(m, k, 3) cross product of the two edges that leave each corner."""
    x = points[table]
    return np.cross(np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x)


def cell_areas(points: Floats, cells: Cells) -> Floats:
    """(m,) area of each cell; of a quadrilateral the area of four triangles around its centre."""
    x, y = points[cells.triangles], points[cells.quads]
    flat = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) / 2
    spokes = y - y.mean(axis=1, keepdims=True)
    fans = np.linalg.norm(np.cross(spokes, np.roll(spokes, -1, axis=1)), axis=2).sum(axis=1) / 2
    return np.concatenate([flat, fans])


def area_gradient(points: Floats, cells: Cells) -> Floats:
    """(n, 3) derivative of the area: minus the integral of the mean curvature vector against the shape functions."""
    result = np.zeros_like(points)
    if len(cells.triangles):
        _scatter(result, cells.triangles, _triangle_pulls(points[cells.triangles]))
    if len(cells.quads):
        x = points[cells.quads]
        centre = np.broadcast_to(x.mean(axis=1, keepdims=True), x.shape)
        pulls = _triangle_pulls(np.stack([x, np.roll(x, -1, axis=1), centre], axis=2))
        corner = pulls[:, :, 0] + np.roll(pulls[:, :, 1], 1, axis=1) + pulls[:, :, 2].sum(axis=1, keepdims=True) / 4
        _scatter(result, cells.quads, corner)
    return result


def _triangle_pulls(x: Floats) -> Floats:
    """(..., 3, 3) derivative of the area of triangles (..., 3, 3) by their corners."""
    normal = unit_vectors(np.cross(x[..., 1, :] - x[..., 0, :], x[..., 2, :] - x[..., 0, :]))
    opposite = np.roll(x, 1, axis=-2) - np.roll(x, -1, axis=-2)
    return np.asarray(np.cross(normal[..., None, :], opposite) / 2)


def nodal_area_vectors(points: Floats, cells: Cells) -> Floats:
    """(n, 3) integral of normal times shape function: the gradient of the enclosed volume.

    Its direction is the normal at a node (a lumped, area-weighted one).
    """
    result = np.zeros_like(points)
    if len(cells.triangles):
        x = points[cells.triangles]
        _scatter(result, cells.triangles, np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])[:, None] / 6)
    if len(cells.quads):
        _scatter(result, cells.quads, np.einsum("ij,mjx->mix", _QUAD_MASS, _corner_products(points, cells.quads)))
    return result


def nodal_areas(points: Floats, cells: Cells) -> Floats:
    """(n,) share of each node in the area: the lumped mass matrix."""
    areas = cell_areas(points, cells)
    result = np.zeros(len(points))
    for table, part in zip(
        (cells.triangles, cells.quads), (areas[: len(cells.triangles)], areas[len(cells.triangles) :]), strict=True
    ):
        k = table.shape[1]
        result += np.bincount(table.ravel(), np.repeat(part / k, k), len(points))
    return result


def _scatter(result: Floats, table: Ints, values: Floats) -> None:
    values = np.broadcast_to(values, (*table.shape, 3))
    for component in range(3):
        result[:, component] += np.bincount(table.ravel(), values[:, :, component].ravel(), len(result))


def enclosed_volume(points: Floats, cells: Cells) -> float:
    """Volume inside a closed surface; of an open one, of the cone over it from the mean of its nodes.

    >>> tetrahedron = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> cells = Cells(np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]), np.empty((0, 4), np.int64))
    >>> round(enclosed_volume(tetrahedron, cells), 12)
    0.166666666667
    """
    centred = points - points[cells.nodes()].mean(axis=0)
    return float(np.einsum("ij,ij->", centred, nodal_area_vectors(centred, cells)) / 3)


def cell_angles(points: Floats, table: Ints) -> Floats:
    """(m, k) angle at each corner, radians.

    >>> np.degrees(cell_angles(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))).round(6)
    array([[90., 45., 45.]])
    """
    x = points[table]
    a, b = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    # Exact near 0 and pi, where the arc cosine is not.
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=2), (a * b).sum(axis=2)))


def slivers(points: Floats, table: Ints) -> NDArray[np.bool_]:
    """(m,) cells with a corner of less than 10 degrees."""
    return np.asarray(cell_angles(points, table).min(axis=1, initial=np.pi) < np.radians(10.0))


def corner_triangles(table: Ints) -> Ints:
    """(4 q, 3) the corners of quadrilaterals as triangles (corner, next, previous), cell by cell."""
    return np.stack([table, np.roll(table, -1, axis=1), np.roll(table, 1, axis=1)], axis=2).reshape(-1, 3)


def fan_triangles(points: Floats, cells: Cells) -> tuple[Floats, Ints, Ints]:
    """The surface in triangles (four around the centre of a quadrilateral), and the cell each belongs to."""
    t, q = len(cells.triangles), len(cells.quads)
    centres = len(points) + np.arange(q)
    fans = [np.stack([cells.quads[:, i], cells.quads[:, (i + 1) % 4], centres], axis=1) for i in range(4)]
    return (
        np.concatenate([points, points[cells.quads].mean(axis=1)]),
        np.concatenate([cells.triangles, *fans]),
        np.concatenate([np.arange(t), *([t + np.arange(q)] * 4)]),
    )


def mean_edge_length(points: Floats, cells: Cells) -> float:
    """Mean length h of the edges."""
    edges = cells.edges()
    return float(np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1).mean())
