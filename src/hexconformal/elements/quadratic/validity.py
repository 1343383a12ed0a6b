"""Validity of quadratic hexahedra: det J > 0 everywhere, certified by Bernstein coefficients, equation (13e).

det J is a polynomial of degree five in each reference coordinate. Its 216 coefficients are means of triple products of
control vectors.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray

from ...kernel import parallel_ranges, strict_loop
from ..bernstein import DEPTH, bracket_minimum, corner_places
from ..cell_type import CellType
from ..validity import contiguous
from .control_vectors import control_vectors

__all__ = ["quadratic_bounds", "quadratic_coefficients"]
__all__ += ["CORNER_PLACES", "WORK", "fill_quadratic"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_ROW = [comb(5, i) for i in range(6)]
_BINOMIALS = np.kron(_ROW, np.kron(_ROW, _ROW)).astype(np.float64)
CORNER_PLACES = corner_places(5)
WORK = 3, 3, 18  # shape of the array for the control vectors of a cell: axis, component, number


def quadratic_coefficients(points: Floats, cells: Ints, cell_type: CellType) -> Floats:
    """The 216 Bernstein coefficients of det J.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, 20 or 27) nodes in VTK order.
    cell_type
        HEXAHEDRON20 or HEXAHEDRON27.

    Returns
    -------
    (m, 216) coefficients in units of volume; number i + 6 j + 36 k belongs to the lattice point (i, j, k)/5 of the unit
    cube. All positive: det J > 0 in the whole cell. Their mean is the volume.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON20
    >>> coefficients = quadratic_coefficients(2.0 * HEXAHEDRON20.ideal, np.arange(20)[None], HEXAHEDRON20)
    >>> bool(np.allclose(coefficients, 8.0))
    True
    """
    tables, out = control_vectors(cell_type), np.empty((len(cells), 216))
    arguments = tables.pairs, tables.table, tables.binomials, tables.rounding
    parallel_ranges(_coefficient_range, len(cells), *contiguous(points, cells), *arguments, out)
    return out


def quadratic_bounds(points: Floats, cells: Ints, cell_type: CellType, depth: int = DEPTH) -> tuple[Floats, Floats]:
    """Bracket the minimum of det J over every cell.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, 20 or 27) nodes in VTK order.
    cell_type
        HEXAHEDRON20 or HEXAHEDRON27.
    depth
        How often a cell may be halved in each direction.

    Returns
    -------
    (m,) lower bounds, rounding included: positive proves the cell valid;
    (m,) upper bounds, values that det J attains: not positive proves it invalid.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON27
    >>> lower, upper = quadratic_bounds(2.0 * HEXAHEDRON27.ideal, np.arange(27)[None], HEXAHEDRON27)
    >>> bool(np.isclose(lower[0], 8.0)), float(upper[0])
    (True, 8.0)
    """
    tables, lower, upper = control_vectors(cell_type), np.empty(len(cells)), np.empty(len(cells))
    arguments = tables.pairs, tables.table, tables.binomials, tables.rounding, depth
    parallel_ranges(_bracket_range, len(cells), *contiguous(points, cells), *arguments, lower, upper)
    return lower, upper


@strict_loop
def _fill_control(points, cells, c, pairs, table, binomials, rounding, control):  # type: ignore[no-untyped-def]
    """Fill the control vectors, times their binomials; returns the bound on rounding of a coefficient."""
    scale = 1.0
    control[:] = 0.0
    for axis in range(3):
        largest = 0.0
        for d in range(pairs.shape[1]):
            a, b = cells[c, pairs[axis, d, 0]], cells[c, pairs[axis, d, 1]]
            squared = 0.0
            for i in range(3):
                # Differences of nodes: nothing is lost far away from the origin.
                difference = points[b, i] - points[a, i]
                squared += difference * difference
                for r in range(18):
                    control[axis, i, r] += table[axis, d, r] * difference
            largest = max(largest, squared)
        for r in range(18):
            squared = control[axis, 0, r] ** 2 + control[axis, 1, r] ** 2 + control[axis, 2, r] ** 2
            largest = max(largest, squared / (binomials[axis, r] * binomials[axis, r]))
        # NaN may be lost here, but not in the control vectors: each takes all differences, if only zero times.
        scale *= np.sqrt(largest)
    return rounding * scale


@strict_loop
def fill_quadratic(points, cells, c, pairs, table, binomials, rounding, control, areas, out):  # type: ignore[no-untyped-def]
    """Fill the 216 coefficients of cell c, with room for control vectors and areas (3, 80); returns how far off."""
    bound = _fill_control(points, cells, c, pairs, table, binomials, rounding, control)
    u, v, w = control[0], control[1], control[2]

    # Area vectors, of degrees 3, 3, 4: products of each two control vectors.
    areas[:] = 0.0
    for k1 in range(3):
        for j1 in range(3):
            for i1 in range(2):
                p = i1 + 2 * j1 + 6 * k1
                a0, a1, a2 = u[0, p], u[1, p], u[2, p]
                for k2 in range(3):
                    for j2 in range(2):
                        q, at = 3 * j2 + 6 * k2, i1 + 4 * (j1 + j2) + 16 * (k1 + k2)
                        for i2 in range(3):
                            areas[0, at + i2] += a1 * v[2, q + i2] - a2 * v[1, q + i2]
                            areas[1, at + i2] += a2 * v[0, q + i2] - a0 * v[2, q + i2]
                            areas[2, at + i2] += a0 * v[1, q + i2] - a1 * v[0, q + i2]
    out[:] = 0.0
    for k3 in range(2):
        for j3 in range(3):
            for i3 in range(3):
                r = i3 + 3 * j3 + 9 * k3
                c0, c1, c2 = w[0, r], w[1, r], w[2, r]
                for k in range(5):
                    for j in range(4):
                        p, at = 4 * j + 16 * k, i3 + 6 * (j + j3) + 36 * (k + k3)
                        for i in range(4):
                            out[at + i] += areas[0, p + i] * c0 + areas[1, p + i] * c1 + areas[2, p + i] * c2
    for p in range(216):
        out[p] /= _BINOMIALS[p]
    return bound


@strict_loop
def _coefficient_range(first, last, points, cells, pairs, table, binomials, rounding, out):  # type: ignore[no-untyped-def]
    control, areas = np.empty(WORK), np.empty((3, 80))
    for c in range(first, last):
        fill_quadratic(points, cells, c, pairs, table, binomials, rounding, control, areas, out[c])


@strict_loop
def _bracket_range(first, last, points, cells, pairs, table, binomials, rounding, depth, lower, upper):  # type: ignore[no-untyped-def]
    control, areas, line = np.empty(WORK), np.empty((3, 80)), np.empty(6)
    stack, levels = np.empty((3 * depth + 1, 216)), np.empty(3 * depth + 1, np.int64)
    for c in range(first, last):
        bound = fill_quadratic(points, cells, c, pairs, table, binomials, rounding, control, areas, stack[0])
        lower[c], upper[c] = bracket_minimum(stack, levels, line, CORNER_PLACES, bound, depth)
