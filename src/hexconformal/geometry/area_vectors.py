"""Area vectors at the nodes of a surface, and the volume that it encloses, of which they are the gradient."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["enclosed_volume", "nodal_area_vectors", "simpson_mean"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


def enclosed_volume(points: Field, quads: Ints) -> float:
    """Volume inside a closed surface of bilinear quads, exactly; also where the cells inside are tangled.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    quads
        (k, 4) boundary quads, counter-clockwise seen from outside.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh.topology import boundary_quads
    >>> points, cells = box((2, 2, 2), (1.0, 2.0, 3.0))
    >>> round(enclosed_volume(points, boundary_quads(cells)[0]), 14)
    6.0
    """
    total, one, other = _diagonals(points, quads)
    return float(np.einsum("ki,ki->", total, np.cross(one, other))) / 24.0


def nodal_area_vectors(points: Field, quads: Ints) -> Field:
    """(n, 3) integral of normal times shape function over bilinear quads: the gradient of the enclosed volume.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh.topology import boundary_quads
    >>> points, cells = box((1, 1, 1))
    >>> nodal_area_vectors(points, boundary_quads(cells)[0])[7]  # the corner (1, 1, 1)
    array([0.25, 0.25, 0.25])
    """
    total, one, other = _diagonals(points, quads)
    area, turned_one, turned_other = np.cross(one, other), np.cross(total, one), np.cross(other, total)
    vectors = np.zeros_like(points)
    shares = (area - turned_other, area - turned_one, area + turned_other, area + turned_one)
    for corner, share in enumerate(shares):
        np.add.at(vectors, quads[:, corner], share / 24.0)
    return vectors


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


def _diagonals(points: Field, quads: Ints) -> tuple[Field, Field, Field]:
    """Of every quad the sum of its nodes and its two diagonals; from one of the nodes, for the sake of digits."""
    a, b, c, d = np.moveaxis(points[quads] - points[quads[0, 0]], 1, 0)
    return a + b + c + d, c - a, d - b
