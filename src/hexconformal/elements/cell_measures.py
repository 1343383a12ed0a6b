"""Compiled loops that measure hexahedra, cell by cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import parallel_ranges, strict_loop
from .bernstein import DEPTH, bracket_minimum
from .validity import CORNER_PLACES, contiguous, edge_vectors, fill_coefficients

__all__ = ["MEASURES", "cell_measures", "face_area", "mean_ratio", "scaled_jacobian", "worst_corners"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MEASURES = ("scaled_jacobian", "minimum_jacobian", "shape", "conformal_distortion", "edge_ratio", "volume")


def cell_measures(points: Floats, cells: Ints) -> Floats:
    """All `MEASURES`, as :class:`hexconformal.Quality` tells of them: a row each, (6, m).

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, 8) nodes in VTK order.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> cell_measures(*box((1, 1, 1), (1.0, 1.0, 2.0))).round(4).T
    array([[1.    , 1.    , 0.7937, 0.1667, 2.    , 2.    ]])
    """
    rows = np.empty((len(MEASURES), len(cells)))
    parallel_ranges(_measure_range, len(cells), *contiguous(points, cells), rows)
    return rows


def worst_corners(points: Floats, cells: Ints, shape: bool) -> Floats:
    """(m,) smallest scaled Jacobian of the corners of hexahedra (m, 8), or smallest mean ratio, and nothing else."""
    smallest = np.empty(len(cells))
    parallel_ranges(_corner_range, len(cells), *contiguous(points, cells), shape, smallest)
    return smallest


@strict_loop
def _edge_lengths(edges, lengths):  # type: ignore[no-untyped-def]
    for k in range(12):
        lengths[k] = np.sqrt(edges[k, 0] ** 2 + edges[k, 1] ** 2 + edges[k, 2] ** 2)


@strict_loop
def scaled_jacobian(det, product):  # type: ignore[no-untyped-def]
    """Determinant of three edges over the product of their lengths."""
    return max(-1.0, min(1.0, det / product)) if product > 0.0 else 0.0


@strict_loop
def mean_ratio(det, norm):  # type: ignore[no-untyped-def]
    """3 det^(2/3) over the sum of squared edges."""
    return 3.0 * max(det, 0.0) ** (2 / 3) / norm if norm > 0.0 else 0.0


@strict_loop
def _corner_range(first, last, points, cells, shape, smallest):  # type: ignore[no-untyped-def]
    edges, lengths = np.empty((12, 3)), np.empty(12)
    for cell in range(first, last):
        edge_vectors(points, cells, cell, edges)
        _edge_lengths(edges, lengths)
        worst = 1.0
        for x in range(2):
            for y in range(2):
                for z in range(2):
                    i, j, k = y + 2 * z, 4 + x + 2 * z, 8 + x + 2 * y
                    det = (
                        (edges[i, 1] * edges[j, 2] - edges[i, 2] * edges[j, 1]) * edges[k, 0]
                        + (edges[i, 2] * edges[j, 0] - edges[i, 0] * edges[j, 2]) * edges[k, 1]
                        + (edges[i, 0] * edges[j, 1] - edges[i, 1] * edges[j, 0]) * edges[k, 2]
                    )
                    if shape:
                        norm = lengths[i] ** 2 + lengths[j] ** 2 + lengths[k] ** 2
                        worst = min(worst, mean_ratio(det, norm))
                    else:
                        worst = min(worst, scaled_jacobian(det, lengths[i] * lengths[j] * lengths[k]))
        smallest[cell] = worst


@strict_loop
def face_area(edges, i, j):  # type: ignore[no-untyped-def]
    """Area of the parallelogram that two edges span."""
    x = edges[i, 1] * edges[j, 2] - edges[i, 2] * edges[j, 1]
    y = edges[i, 2] * edges[j, 0] - edges[i, 0] * edges[j, 2]
    z = edges[i, 0] * edges[j, 1] - edges[i, 1] * edges[j, 0]
    return np.sqrt(x * x + y * y + z * z)


@strict_loop
def _measure_range(first, last, points, cells, columns):  # type: ignore[no-untyped-def]
    """Fill the columns in the order of MEASURES."""
    edges, lengths, areas = np.empty((12, 3)), np.empty(12), np.empty((2, 2, 3, 3))
    stack, levels = np.empty((3 * DEPTH + 1, 27)), np.empty(3 * DEPTH + 1, np.int64)
    for cell in range(first, last):
        edge_vectors(points, cells, cell, edges)
        _edge_lengths(edges, lengths)
        rounding = fill_coefficients(edges, areas, stack[0])

        scaled, shape, distortion = 1.0, 1.0, 0.0
        for x in range(2):
            for y in range(2):
                for z in range(2):
                    i, j, k = y + 2 * z, 4 + x + 2 * z, 8 + x + 2 * y
                    det = stack[0, 18 * z + 6 * y + 2 * x]
                    scaled = min(scaled, scaled_jacobian(det, lengths[i] * lengths[j] * lengths[k]))
                    norm = lengths[i] ** 2 + lengths[j] ** 2 + lengths[k] ** 2
                    area = face_area(edges, i, j) + face_area(edges, j, k) + face_area(edges, k, i)
                    shape = min(shape, mean_ratio(det, norm))
                    distortion = max(distortion, 1.0 - area / norm if norm > 0.0 else 1.0)

        longest = shortest = lengths[0]
        for k in range(1, 12):
            longest, shortest = max(longest, lengths[k]), min(shortest, lengths[k])
        volume = largest = 0.0
        for k in range(27):
            volume += stack[0, k] / 27.0
            largest = max(largest, abs(stack[0, k]))
        lower, _ = bracket_minimum(stack, levels, CORNER_PLACES, 3, rounding, DEPTH)

        columns[0, cell] = scaled
        columns[1, cell] = max(-1.0, lower / largest) if largest > 0.0 else 0.0
        columns[2, cell] = shape
        columns[3, cell] = distortion
        columns[4, cell] = longest / shortest if shortest > 0.0 else np.inf
        columns[5, cell] = volume
