"""Area vectors of faces and at nodes, and the volume that a surface encloses, of which these are the gradient."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..kernel import parallel_ranges, strict_loop
from .faces import Faces

__all__ = ["enclosed_volume", "face_area_vectors", "nodal_area_vectors", "simpson_mean", "unit_vectors"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

# Integrals of products of two bilinear shape functions over the unit square.
_QUAD_MASS = np.array([[4, 2, 1, 2], [2, 4, 2, 1], [1, 2, 4, 2], [2, 1, 2, 4]]) / 36.0


def unit_vectors(vectors: Field) -> Field:
    """Vectors (..., 3) scaled to unit length; zero where they vanish.

    >>> unit_vectors(np.array([[0.0, 3.0, 4.0], [0.0, 0.0, 0.0]]))
    array([[0. , 0.6, 0.8],
           [0. , 0. , 0. ]])
    """
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1.0))


def face_area_vectors(points: Field, faces: Faces | Ints) -> Field:
    """(f, 3) integrals of the unit normal over faces: normals, as long as the area of what is flat.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> face_area_vectors(square, Faces(np.array([[0, 1, 2]]), np.array([[0, 1, 2, 3]])))[:, 2]
    array([0.5, 1. ])
    """
    tables: tuple[Ints, ...] = (faces,) if isinstance(faces, np.ndarray) else (faces.triangles, faces.quads)
    # Of a triangle with its last node twice what holds for quadrilaterals is right, too: they may come in any order.
    result = np.empty((sum(len(table) for table in tables), 3))
    start = 0
    for table in tables:
        part = result[start : start + len(table)]
        parallel_ranges(_area_vectors, len(table), np.asarray(points), np.ascontiguousarray(table), part)
        start += len(table)
    return result


@strict_loop
def strict_cross(u, v):  # type: ignore[no-untyped-def]
    """Cross product that is not fused: what cancels does so to the last bit, as in numpy."""
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


@strict_loop
def strict_way(points, i, j):  # type: ignore[no-untyped-def]
    """The way from one point to another."""
    return (points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2])


@strict_loop
def _area_vectors(first, last, points, faces, result):  # type: ignore[no-untyped-def]
    """Half the product of the diagonals, or of two sides of a triangle."""
    a, b, c, d = (0, 2, 1, 3) if faces.shape[1] == 4 else (0, 1, 0, 2)
    for k in range(first, last):
        n = strict_cross(strict_way(points, faces[k, a], faces[k, b]), strict_way(points, faces[k, c], faces[k, d]))
        result[k, 0], result[k, 1], result[k, 2] = 0.5 * n[0], 0.5 * n[1], 0.5 * n[2]


def enclosed_volume(points: Field, faces: Faces | Ints, centre: Field | None = None) -> float:
    """Volume inside a closed surface, exactly; of an open one, of the cone over it from a centre.

    It is that of bilinear quadrilaterals, also where cells inside are tangled.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    faces
        Counter-clockwise seen from outside.
    centre
        (3,) where the cone is; None for the mean of its nodes.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh.topology import boundary_quads
    >>> points, cells = box((2, 2, 2), (1.0, 2.0, 3.0))
    >>> round(enclosed_volume(points, boundary_quads(cells)[0]), 14)
    6.0
    """
    faces = Faces.of(faces)
    centred = points - (points[faces.nodes()].mean(axis=0) if centre is None else centre)
    a, b, c = np.moveaxis(centred[faces.triangles], 1, 0)
    x = centred[faces.quads]
    diagonals = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    cones = np.einsum("ki,ki->", a, np.cross(b, c)) / 6.0
    return float(cones + np.einsum("ki,ki->", x.sum(axis=1), diagonals) / 24.0)


def nodal_area_vectors(points: Field, faces: Faces | Ints) -> Field:
    """(n, 3) integral of normal times shape function over a surface: the gradient of the enclosed volume.

    Its direction is the normal at a node (a lumped, area-weighted one).

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh.topology import boundary_quads
    >>> points, cells = box((1, 1, 1))
    >>> nodal_area_vectors(points, boundary_quads(cells)[0])[7]  # the corner (1, 1, 1)
    array([0.25, 0.25, 0.25])
    """
    faces = Faces.of(faces)
    x = points[faces.quads]
    at_corners = np.cross(np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x)
    thirds = np.repeat(face_area_vectors(points, faces.triangles) / 3.0, 3, axis=0)
    values = np.concatenate([thirds, np.einsum("ij,mjx->mix", _QUAD_MASS, at_corners).reshape(-1, 3)])
    sums = [np.bincount(faces.corners, values[:, axis], len(points)) for axis in range(3)]
    return np.stack(sums, axis=1).astype(np.float64)


def simpson_mean(area_vectors: Callable[[Field], Field], points: Field, moved: Field) -> Field:
    """(n, 3) Simpson mean N of area vectors along a straight path; equation (19).

    The enclosed volume is a cubic polynomial along the path, so that it changes by the sum of <N, v> exactly.

    Parameters
    ----------
    area_vectors
        Takes positions (n, 3) to the area vectors (n, 3) of the nodes there.
    points, moved
        (n, 3) the ends of the path, v = moved - points.
    """
    half = area_vectors(0.5 * (points + moved))
    return (area_vectors(points) + 4.0 * half + area_vectors(moved)) / 6.0
