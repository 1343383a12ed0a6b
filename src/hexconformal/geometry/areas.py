"""Areas and angles of faces, exact for triangles; a quadrilateral counts as four triangles around its centre."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import dot, parallel_ranges, strict_loop
from .area_vectors import face_area_vectors, strict_cross, strict_way, unit_vectors
from .edges import edge_table
from .faces import Faces

__all__ = ["area_gradient", "corner_angles", "face_areas", "mean_edge_length", "nodal_areas", "slivers"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_SLIVER = np.radians(10.0)


def face_areas(points: Floats, faces: Faces) -> Floats:
    """(f,) area of each face; of a quadrilateral the area of four triangles around its centre."""
    y = points[faces.quads]
    flat = np.linalg.norm(face_area_vectors(points, faces.triangles), axis=1)
    spokes = y - y.mean(axis=1, keepdims=True)
    fans = np.linalg.norm(np.cross(spokes, np.roll(spokes, -1, axis=1)), axis=2).sum(axis=1) / 2
    return np.concatenate([flat, fans])


def nodal_areas(points: Floats, faces: Faces) -> Floats:
    """(n,) share of each node in the area: the lumped mass matrix."""
    shares = np.repeat(face_areas(points, faces) / faces.sizes, faces.sizes)
    return np.bincount(faces.corners, shares, len(points)).astype(np.float64)


def area_gradient(points: Floats, faces: Faces) -> Floats:
    """(n, 3) derivative of the area: minus the integral of the mean curvature vector against the shape functions."""
    x = points[faces.quads]
    centre = np.broadcast_to(x.mean(axis=1, keepdims=True), x.shape)
    fans = _triangle_pulls(np.stack([x, np.roll(x, -1, axis=1), centre], axis=2))
    quads = fans[:, :, 0] + np.roll(fans[:, :, 1], 1, axis=1) + fans[:, :, 2].sum(axis=1, keepdims=True) / 4
    pulls = np.concatenate([_triangle_pulls(points[faces.triangles]).reshape(-1, 3), quads.reshape(-1, 3)])
    sums = [np.bincount(faces.corners, pulls[:, axis], len(points)) for axis in range(3)]
    return np.stack(sums, axis=1).astype(np.float64)


def _triangle_pulls(x: Floats) -> Floats:
    """(..., 3, 3) derivative of the area of triangles (..., 3, 3) by their corners."""
    normal = unit_vectors(np.cross(x[..., 1, :] - x[..., 0, :], x[..., 2, :] - x[..., 0, :]))
    opposite = np.roll(x, 1, axis=-2) - np.roll(x, -1, axis=-2)
    return np.asarray(np.cross(normal[..., None, :], opposite) / 2)


def corner_angles(points: Floats, table: Ints) -> Floats:
    """(f, k) angle at each corner, radians.

    >>> np.degrees(corner_angles(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))).round(6)
    array([[90., 45., 45.]])
    """
    result = np.empty(table.shape)
    if len(table):
        parallel_ranges(_corner_angles, len(table), np.asarray(points), np.ascontiguousarray(table), result)
    return result


@strict_loop
def _corner_angles(first, last, points, table, result):  # type: ignore[no-untyped-def]
    """Exact near 0 and pi, where the arc cosine is not."""
    width = table.shape[1]
    for k in range(first, last):
        for corner in range(width):
            i, j, m = table[k, corner], table[k, (corner + 1) % width], table[k, (corner + width - 1) % width]
            a, b = strict_way(points, i, j), strict_way(points, i, m)
            c = strict_cross(a, b)
            result[k, corner] = np.arctan2(np.sqrt(dot(c, c)), dot(a, b) + 0.0)  # an edge without length has no sign


def slivers(points: Floats, faces: Faces) -> NDArray[np.bool_]:
    """(f,) faces with a corner of less than 10 degrees."""
    return faces.where(lambda table: corner_angles(points, table).min(axis=1) < _SLIVER)


def mean_edge_length(points: Floats, faces: Faces) -> float:
    """Mean length h of the edges."""
    ends = points[edge_table(faces).nodes]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean())
