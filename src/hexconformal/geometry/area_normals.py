"""Area normals of a surface of bilinear quads, and the volume that it encloses, of which they are the gradient."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["area_normals", "enclosed_volume", "simpson_normals"]

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


def area_normals(points: Field, quads: Ints) -> Field:
    """(n, 3) normals of the nodes, as long as their share of the area: the gradient of the enclosed volume.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh.topology import boundary_quads
    >>> points, cells = box((1, 1, 1))
    >>> area_normals(points, boundary_quads(cells)[0])[7]  # the corner (1, 1, 1)
    array([0.25, 0.25, 0.25])
    """
    total, one, other = _diagonals(points, quads)
    area, turned_one, turned_other = np.cross(one, other), np.cross(total, one), np.cross(other, total)
    normals = np.zeros_like(points)
    shares = (area - turned_other, area - turned_one, area + turned_other, area + turned_one)
    for corner, share in enumerate(shares):
        np.add.at(normals, quads[:, corner], share / 24.0)
    return normals


def simpson_normals(points: Field, moved: Field, quads: Ints) -> Field:
    """(n, 3) Simpson mean N of the area normals on a straight way: the volume changes by the sum of <N, v> exactly.

    Parameters
    ----------
    points, moved
        (n, 3) the ends of the way v = moved - points.
    quads
        (k, 4) boundary quads.
    """
    half = 0.5 * (points + moved)
    return (area_normals(points, quads) + 4.0 * area_normals(half, quads) + area_normals(moved, quads)) / 6.0


def _diagonals(points: Field, quads: Ints) -> tuple[Field, Field, Field]:
    """Of every quad the sum of its nodes and its two diagonals; from one of the nodes, for the sake of digits."""
    a, b, c, d = np.moveaxis(points[quads] - points[quads[0, 0]], 1, 0)
    return a + b + c + d, c - a, d - b
