"""Lengths of the edges, and volumes, of hexahedra."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import loop, parallel_ranges
from .hexahedron import EDGES, FACES

__all__ = ["cell_volumes", "edge_lengths"]

Field = NDArray[np.float64]


@loop
def _lengths(first, last, points, cells, out):  # type: ignore[no-untyped-def]
    for cell in range(first, last):
        total, count = 0.0, 0
        for k in range(12):
            a, b = cells[cell, EDGES[k, 0]], cells[cell, EDGES[k, 1]]
            x, y, z = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
            out[cell, k] = np.sqrt(x * x + y * y + z * z)
            total, count = total + out[cell, k], count + (a != b)
        if count < 12:
            for k in range(12):
                if cells[cell, EDGES[k, 0]] == cells[cell, EDGES[k, 1]]:
                    out[cell, k] = total / count


@loop
def _volumes(first, last, points, cells, out):  # type: ignore[no-untyped-def]
    x = np.empty((8, 3))
    for cell in range(first, last):
        # From the first node, so that a mesh far from the origin loses no digits.
        for node in range(8):
            for i in range(3):
                x[node, i] = points[cells[cell, node], i] - points[cells[cell, 0], i]
        volume = 0.0
        for face in range(6):
            a, b, c, d = FACES[face, 0], FACES[face, 1], FACES[face, 2], FACES[face, 3]
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                area = (x[c, j] - x[a, j]) * (x[d, k] - x[b, k]) - (x[c, k] - x[a, k]) * (x[d, j] - x[b, j])
                volume += (x[a, i] + x[b, i] + x[c, i] + x[d, i]) * area
        out[cell] = volume / 24.0


def edge_lengths(points: Field, cells: NDArray[np.int64]) -> Field:
    """Lengths (m, 12) of the edges of every cell, in the order of :data:`hexconformal.elements.hexahedron.EDGES`.

    Edges that have collapsed, of other types than hexahedra, have the mean length of the others.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> edge_lengths(*box((1, 1, 1), (1.0, 2.0, 3.0)))
    array([[1., 1., 1., 1., 2., 2., 2., 2., 3., 3., 3., 3.]])
    """
    out = np.empty((len(cells), 12))
    parallel_ranges(_lengths, len(cells), points, cells, out)
    return out


def cell_volumes(points: Field, cells: NDArray[np.int64]) -> Field:
    """Volume (m,) of every trilinear cell, exactly: a bilinear face contributes its mean point times its area vector.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> cell_volumes(*box((1, 1, 2), (1.0, 2.0, 3.0)))
    array([3., 3.])
    """
    out = np.empty(len(cells))
    parallel_ranges(_volumes, len(cells), points, cells, out)
    return out
