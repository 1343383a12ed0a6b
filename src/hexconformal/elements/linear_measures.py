"""Compiled loops that measure tetrahedra, wedges and pyramids, cell by cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import parallel_ranges, strict_loop
from .cell_measures import MEASURES, cell_measures, mean_ratio, scaled_jacobian
from .cell_type import CellType
from .hexahedron import HEXAHEDRON
from .linear_validity import edge, fill_rows, length, row_bounds, triple_product
from .quadratic import QUADRATIC_TYPES, quadratic_measures
from .validity import contiguous

__all__ = ["measures_of"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def measures_of(points: Floats, cells: Ints, cell_type: CellType) -> Floats:
    """All `MEASURES` of cells of a type, as :class:`hexconformal.Quality` tells of them: a row each, (6, m).

    Each is what the ideal of the type makes 1, or 0 of the distortion.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, k) nodes in VTK order.
    cell_type
        Their type.

    Examples
    --------
    >>> from hexconformal.elements import TETRAHEDRON
    >>> measures_of(TETRAHEDRON.ideal, np.arange(4)[None], TETRAHEDRON).T.round(6) + 0.0
    array([[1.      , 1.      , 1.      , 0.      , 1.      , 0.117851]])
    """
    if cell_type is HEXAHEDRON:
        return cell_measures(points, cells)
    if cell_type.name in QUADRATIC_TYPES:
        return quadratic_measures(points, cells, cell_type)
    rows = np.empty((len(MEASURES), len(cells)))
    tables = cell_type.neighbours, cell_type.edges, cell_type.inverse_target, cell_type.nodes, cell_type.samples
    scales = cell_type.corner_volume, cell_type.reference_volume
    parallel_ranges(_measure_range, len(cells), *contiguous(points, cells), *tables, *scales, rows)
    return rows


@strict_loop
def _scaled_jacobian(points, cells, c, neighbours, samples, corner_volume):  # type: ignore[no-untyped-def]
    """Smallest of the corners, over that of the ideal."""
    smallest, lengths = 1.0, 0.0
    for q in range(len(neighbours)):
        a, b = edge(points, cells, c, q, neighbours[q, 0]), edge(points, cells, c, q, neighbours[q, 1])
        up = edge(points, cells, c, q, neighbours[q, 2])
        product = length(a) * length(b) * length(up)
        if len(samples) == 1 and not product > 0.0:
            return 0.0
        # All corners of a tetrahedron have one determinant: as Verdict does, the longest edges count, inside out too.
        lengths = max(lengths, product) if len(samples) == 1 else product
        value = scaled_jacobian(triple_product(a, b, up), corner_volume * lengths)
        smallest = value if len(samples) == 1 else min(smallest, value)
    return smallest


@strict_loop
def _parallelogram(a, b):  # type: ignore[no-untyped-def]
    """Area of the parallelogram that two vectors span."""
    return length((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))


@strict_loop
def _shape_and_distortion(points, cells, c, neighbours, inverse, samples):  # type: ignore[no-untyped-def]
    """Smallest mean ratio and largest conformal distortion of the sampled corners."""
    shape, distortion = 1.0, 0.0
    f = np.zeros((3, 3))
    for q in range(len(samples)):
        f[:] = 0.0
        for j in range(3):
            vector = edge(points, cells, c, q, neighbours[q, j])
            for i in range(3):
                for k in range(3):
                    f[i, k] += vector[k] * inverse[j, i]
        norm = length(f[0]) ** 2 + length(f[1]) ** 2 + length(f[2]) ** 2
        area = _parallelogram(f[0], f[1]) + _parallelogram(f[1], f[2]) + _parallelogram(f[2], f[0])
        shape = min(shape, mean_ratio(triple_product(f[0], f[1], f[2]), norm))
        distortion = max(distortion, 1.0 - area / norm if norm > 0.0 else 1.0)
    return shape, distortion


@strict_loop
def _edge_ratio(points, cells, c, edges):  # type: ignore[no-untyped-def]
    shortest, longest = np.inf, 0.0
    for k in range(len(edges)):
        one = length(edge(points, cells, c, edges[k, 0], edges[k, 1]))
        shortest, longest = min(shortest, one), max(longest, one)
    return longest / shortest if shortest > 0.0 else np.inf


@strict_loop
def _measure_range(  # type: ignore[no-untyped-def]
    first, last, points, cells, neighbours, edges, inverse, nodes, samples, corner_volume, reference_volume, columns
):
    """Fill the columns in the order of MEASURES."""
    rows = np.empty((4, 3))
    for c in range(first, last):
        count, rounding = fill_rows(points, cells, c, neighbours, nodes, samples, rows)
        mean = largest = 0.0
        for k in range(count):
            for i in range(3):
                mean += rows[k, i] / (3 * count)
                largest = max(largest, abs(rows[k, i]))
        lower = row_bounds(rows, count) - rounding
        columns[0, c] = _scaled_jacobian(points, cells, c, neighbours, samples, corner_volume)
        columns[1, c] = max(-1.0, lower / largest) if largest > 0.0 else 0.0
        columns[2, c], columns[3, c] = _shape_and_distortion(points, cells, c, neighbours, inverse, samples)
        columns[4, c] = _edge_ratio(points, cells, c, edges)
        columns[5, c] = reference_volume * mean
