"""Validity of quadratic hexahedra: det J > 0 everywhere, certified by Bernstein coefficients, equation (13e).

det J is a polynomial of degree five in each reference coordinate. Its 216 coefficients are means of triple products of
control vectors. Where polynomials are multiplied the coefficients of one of them lie at the distances that they have in
the product, with zeros in between, so that each coefficient of the other is one long loop.
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
__all__ += ["CORNER_PLACES", "fill_quadratic", "room_for_cell"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_ROW = [comb(5, i) for i in range(6)]
_ONE_OVER_BINOMIALS = 1.0 / np.kron(_ROW, np.kron(_ROW, _ROW))
CORNER_PLACES = corner_places(5)


def quadratic_coefficients(points: Floats, cells: Ints, cell_type: CellType) -> Floats:
    """The 216 Bernstein coefficients of det J.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, k) nodes in VTK order.
    cell_type
        A quadratic type.

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
    out = np.empty((len(cells), 216))
    parallel_ranges(
        _coefficient_range, len(cells), *contiguous(points, cells), control_vectors(cell_type).for_loops, out
    )
    return out


def quadratic_bounds(points: Floats, cells: Ints, cell_type: CellType, depth: int = DEPTH) -> tuple[Floats, Floats]:
    """Bracket the minimum of det J over every cell.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, k) nodes in VTK order.
    cell_type
        A quadratic type.
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
    tables, lower, upper = control_vectors(cell_type).for_loops, np.empty(len(cells)), np.empty(len(cells))
    parallel_ranges(_bracket_range, len(cells), *contiguous(points, cells), tables, depth, lower, upper)
    return lower, upper


@strict_loop
def room_for_cell():  # type: ignore[no-untyped-def]
    """Arrays that one cell after the other is worked on in.

    Differences (18, 3); control vectors by axis and component (3, 3, 18); those of the last axis (3, 33), and area
    vectors (3, 80), of degrees 4, 3, 3, at distances 1, 5, 20; the same at 1, 6, 36, the distances of det J (3, 131).
    """
    return np.empty((18, 3)), np.empty((3, 3, 18)), np.zeros((3, 33)), np.empty((3, 80)), np.zeros((3, 131))


@strict_loop
def _fill_control(points, cells, c, tables, differences, control):  # type: ignore[no-untyped-def]
    """Fill the control vectors, times their binomials; returns the bound on rounding of a coefficient."""
    pairs, starts, terms, factors, shrink, rounding = tables
    scale, total = 1.0, 0.0
    for axis in range(3):
        largest = 0.0
        for d in range(pairs.shape[1]):
            a, b = cells[c, pairs[axis, d, 0]], cells[c, pairs[axis, d, 1]]
            # Differences of nodes: nothing is lost far away from the origin.
            x, y, z = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
            differences[d, 0], differences[d, 1], differences[d, 2] = x, y, z
            squared = x * x + y * y + z * z
            largest, total = max(largest, squared), total + squared
        for r in range(18):
            x = y = z = 0.0
            for e in range(starts[axis, r], starts[axis, r + 1]):
                d, factor = terms[axis, e], factors[axis, e]
                x += factor * differences[d, 0]
                y += factor * differences[d, 1]
                z += factor * differences[d, 2]
            control[axis, 0, r], control[axis, 1, r], control[axis, 2, r] = x, y, z
            largest = max(largest, (x * x + y * y + z * z) * shrink[axis, r])
        scale *= np.sqrt(largest)
    # A maximum may lose NaN, the sum does not: such a cell gets a bound that proves nothing.
    return rounding * scale + 0.0 * total


@strict_loop
def fill_quadratic(points, cells, c, tables, room, out):  # type: ignore[no-untyped-def]
    """Fill the 216 coefficients of cell c, with the tables of its type and some room; returns how far off they are."""
    differences, control, last, areas, spread = room
    bound = _fill_control(points, cells, c, tables, differences, control)
    u, v, w = control[0], control[1], control[2]

    # Area vectors: products of each two control vectors of the second axis and the last.
    for k in range(2):
        for j in range(3):
            for i in range(3):
                for axis in range(3):
                    last[axis, i + 5 * j + 20 * k] = w[axis, i + 3 * j + 9 * k]
    areas[:] = 0.0
    for k in range(3):
        for j in range(2):
            for i in range(3):
                p, at = i + 3 * j + 6 * k, i + 5 * j + 20 * k
                a0, a1, a2 = v[0, p], v[1, p], v[2, p]
                for q in range(33):
                    areas[0, at + q] += a1 * last[2, q] - a2 * last[1, q]
                    areas[1, at + q] += a2 * last[0, q] - a0 * last[2, q]
                    areas[2, at + q] += a0 * last[1, q] - a1 * last[0, q]

    # det J: products of these with the control vectors of the first axis.
    for k in range(4):
        for j in range(4):
            for i in range(5):
                for axis in range(3):
                    spread[axis, i + 6 * j + 36 * k] = areas[axis, i + 5 * j + 20 * k]
    out[:] = 0.0
    for k in range(3):
        for j in range(3):
            for i in range(2):
                p, at = i + 2 * j + 6 * k, i + 6 * j + 36 * k
                c0, c1, c2 = u[0, p], u[1, p], u[2, p]
                for q in range(131):
                    out[at + q] += spread[0, q] * c0 + spread[1, q] * c1 + spread[2, q] * c2
    for p in range(216):
        out[p] *= _ONE_OVER_BINOMIALS[p]
    return bound


@strict_loop
def _coefficient_range(first, last, points, cells, tables, out):  # type: ignore[no-untyped-def]
    room = room_for_cell()
    for c in range(first, last):
        fill_quadratic(points, cells, c, tables, room, out[c])


@strict_loop
def _bracket_range(first, last, points, cells, tables, depth, lower, upper):  # type: ignore[no-untyped-def]
    room = room_for_cell()
    stack, levels = np.empty((3 * depth + 1, 216)), np.empty(3 * depth + 1, np.int64)
    for c in range(first, last):
        bound = fill_quadratic(points, cells, c, tables, room, stack[0])
        lower[c], upper[c] = bracket_minimum(stack, levels, CORNER_PLACES, 6, bound, depth)
