"""Validity of tetrahedra, wedges and pyramids: det J > 0 everywhere, decided exactly, equation (13c).

On a tetrahedron det J is a constant. On a wedge it is linear over the triangle and quadratic along t, so that it is
smallest on one of the three vertical edges, where the minimum of a parabola tells. On a pyramid, a hexahedron whose
upper face is one point, det J / (1 - t)^2 is bilinear and does not depend on t: the corners of the base decide. Rows of
three Bernstein coefficients in t say all that: one row for a tetrahedron, three for a wedge, four for a pyramid.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import parallel_ranges, strict_loop
from .cell_type import CellType
from .hexahedron import HEXAHEDRON
from .quadratic import QUADRATIC_TYPES, quadratic_bounds
from .validity import ROUNDING, contiguous, hexahedron_bounds

__all__ = ["determinant_bounds", "valid_cells"]
__all__ += ["edge", "fill_rows", "length", "row_bounds", "triple_product"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def determinant_bounds(points: Floats, cells: Ints, cell_type: CellType) -> tuple[Floats, Floats]:
    """Bracket the minimum of det J, of pyramids of det J / (1 - t)^2, over every cell.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, k) nodes in VTK order.
    cell_type
        Their type.

    Returns
    -------
    (m,) lower bounds, rounding included: positive proves the cell valid;
    (m,) the minimum: not positive tells that it is invalid. Of hexahedra and of quadratic cells
    as :func:`minimum_jacobian` has them.

    Examples
    --------
    >>> from hexconformal.elements import WEDGE
    >>> lower, upper = determinant_bounds(2.0 * WEDGE.ideal, np.arange(6)[None], WEDGE)
    >>> bool(0 < lower[0] <= upper[0]), upper.round(6)
    (True, array([6.928203]))
    """
    if cell_type is HEXAHEDRON:
        return hexahedron_bounds(points, cells)
    if cell_type.name in QUADRATIC_TYPES:
        return quadratic_bounds(points, cells, cell_type)
    lower, upper = np.empty(len(cells)), np.empty(len(cells))
    tables = cell_type.neighbours, cell_type.nodes, cell_type.samples
    parallel_ranges(_bracket_range, len(cells), *contiguous(points, cells), *tables, lower, upper)
    return lower, upper


def valid_cells(points: Floats, cells: Ints, cell_type: CellType) -> NDArray[np.bool_]:
    """Tell for every cell whether det J > 0 everywhere in it; what rounding leaves undecided is not valid.

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
    >>> from hexconformal.elements import PYRAMID
    >>> cells = np.array([[0, 1, 2, 3, 4], [3, 2, 1, 0, 4]])
    >>> valid_cells(PYRAMID.ideal, cells, PYRAMID)
    array([ True, False])
    """
    return determinant_bounds(points, cells, cell_type)[0] > 0


@strict_loop
def edge(points, cells, c, a, b):  # type: ignore[no-untyped-def]
    """From node a to node b of cell c: of differences nothing is lost far away from the origin."""
    i, j = cells[c, a], cells[c, b]
    return points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]


@strict_loop
def length(a):  # type: ignore[no-untyped-def]
    """Of a vector."""
    return np.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2)


@strict_loop
def triple_product(a, b, c):  # type: ignore[no-untyped-def]
    """<a x b, c>."""
    return (a[1] * b[2] - a[2] * b[1]) * c[0] + (a[2] * b[0] - a[0] * b[2]) * c[1] + (a[0] * b[1] - a[1] * b[0]) * c[2]


@strict_loop
def fill_rows(points, cells, c, neighbours, nodes, samples, rows):  # type: ignore[no-untyped-def]
    """Fill the rows (4, 3) of a cell; returns how many there are, and how far rounding may have moved their minimum."""
    flat = upward = 0.0  # sums, not maxima: they pass NaN on
    for q in range(len(samples)):
        a, b = edge(points, cells, c, q, neighbours[q, 0]), edge(points, cells, c, q, neighbours[q, 1])
        up = edge(points, cells, c, q, neighbours[q, 2])
        flat += 0.5 * (length(a) ** 2 + length(b) ** 2)  # at least the product of the two
        upward += length(up) ** 2
        determinant = triple_product(a, b, up)
        if len(nodes) < 6:
            rows[q] = determinant
        elif q >= 3:
            rows[q - 3, 2] = determinant
        else:
            i, j = neighbours[q, 0], neighbours[q, 1]
            above, beside = edge(points, cells, c, q + 3, i + 3), edge(points, cells, c, q + 3, j + 3)
            rows[q, 0] = determinant
            rows[q, 1] = 0.5 * (triple_product(a, beside, up) + triple_product(above, b, up))
    return 3 if len(nodes) == 6 else len(samples), ROUNDING * flat * np.sqrt(upward)


@strict_loop
def row_bounds(rows, count):  # type: ignore[no-untyped-def]
    """Minimum of the parabolas in so many rows over t from 0 to 1."""
    smallest = np.inf
    for k in range(count):
        first, middle, last = rows[k]
        left, right = first - middle, last - middle
        if left > 0.0 and right > 0.0:
            # Positive exactly where middle > -sqrt(first last), as first and last are; nothing cancels beyond rounding.
            smallest = min(smallest, first - left * left / (left + right))
        else:
            smallest = min(smallest, min(first, last))
    return smallest


@strict_loop
def _bracket_range(first, last, points, cells, neighbours, nodes, samples, lower, upper):  # type: ignore[no-untyped-def]
    rows = np.empty((4, 3))
    for c in range(first, last):
        count, rounding = fill_rows(points, cells, c, neighbours, nodes, samples, rows)
        upper[c] = row_bounds(rows, count)
        lower[c] = upper[c] - rounding
