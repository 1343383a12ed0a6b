"""Validity of trilinear hexahedra: det J > 0 everywhere, certified by Bernstein coefficients, equation (13).

On the unit cube det J is a polynomial of degree two in each reference coordinate, with 27 coefficients.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from ..kernel import parallel_ranges, strict_loop
from .bernstein import DEPTH, bracket_minimum, corner_places
from .hexahedron import EDGES

__all__ = ["CORNER_PLACES", "ROUNDING", "bernstein_coefficients", "contiguous", "edge_vectors", "fill_coefficients"]
__all__ += ["hexahedra_are_valid", "hexahedron_bounds"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Rounding of a coefficient, relative to the product of the lengths along e1, e2, e3.
ROUNDING = 16 * float(np.finfo(np.float64).eps)
CORNER_PLACES = corner_places(2)


def bernstein_coefficients(x: Floats) -> Floats:
    """The 27 Bernstein coefficients of det J of trilinear hexahedra.

    Parameters
    ----------
    x
        (..., 8, 3) nodes in VTK order.

    Returns
    -------
    (..., 27) coefficients in units of volume; number i + 3 j + 9 k belongs to the lattice point
    (i, j, k)/2 of the unit cube. All positive: det J > 0 in the whole cell.

    Examples
    --------
    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> bool(np.allclose(bernstein_coefficients(2.0 * CORNERS), 8.0))
    True
    """
    edges = x[..., EDGES[:, 1], :] - x[..., EDGES[:, 0], :]
    coefficients = np.zeros((*x.shape[:-2], 3, 3, 3))
    for iy, iz, jx, jz, kx, ky in itertools.product((0, 1), repeat=6):  # each derivative is bilinear
        a, b, c = (edges[..., i, :] for i in (iy + 2 * iz, 4 + jx + 2 * jz, 8 + kx + 2 * ky))
        coefficients[..., iz + jz, iy + ky, jx + kx] += (np.cross(a, b) * c).sum(axis=-1)
    binomial = np.array([1.0, 2.0, 1.0])
    coefficients /= binomial[:, None, None] * binomial[:, None] * binomial
    return coefficients.reshape(*x.shape[:-2], 27)


def hexahedron_bounds(points: Floats, cells: Ints, depth: int = DEPTH) -> tuple[Floats, Floats]:
    """Bounds of the minimum of det J of hexahedra (m, 8) alone; :func:`minimum_jacobian` takes all types."""
    lower, upper = np.empty(len(cells)), np.empty(len(cells))
    parallel_ranges(_bracket_range, len(cells), *contiguous(points, cells), depth, lower, upper)
    return lower, upper


def hexahedra_are_valid(points: Floats, cells: Ints) -> bool:
    """Tell whether all hexahedra (m, 8) are valid, and stop at the first that is not."""
    found = np.zeros(1, dtype=np.bool_)
    parallel_ranges(_find_invalid, len(cells), *contiguous(points, cells), DEPTH, found)
    return not found[0]


def contiguous(points: Floats, cells: Ints) -> tuple[Floats, Ints]:
    """Points and cells as compiled loops take them."""
    # One memory layout means one compiled version; no copy where it already is so.
    return np.ascontiguousarray(points, dtype=np.float64), np.ascontiguousarray(cells, dtype=np.int64)


@strict_loop
def edge_vectors(points, cells, c, edges):  # type: ignore[no-untyped-def]
    """Edges of cell c: along e1 at [y + 2 z], along e2 at [4 + x + 2 z], along e3 at [8 + x + 2 y]."""
    for k in range(12):
        a, b = cells[c, EDGES[k, 0]], cells[c, EDGES[k, 1]]
        for i in range(3):
            # Differences of nodes: nothing is lost far away from the origin.
            edges[k, i] = points[b, i] - points[a, i]


@strict_loop
def fill_coefficients(edges, areas, coefficients):  # type: ignore[no-untyped-def]
    """Fill the 27 coefficients from the edges, and return how far rounding may have moved them."""
    scale = 1.0
    for axis in range(3):
        squared = 0.0  # a sum, not a maximum: it passes NaN on
        for k in range(4 * axis, 4 * axis + 4):
            squared += edges[k, 0] ** 2 + edges[k, 1] ** 2 + edges[k, 2] ** 2
        scale *= np.sqrt(squared)

    # Area vectors e1 x e2, whose two z-factors are already multiplied out: (y of e1, x of e2, z).
    for y in range(2):
        for x in range(2):
            for z in range(3):
                s0 = s1 = s2 = 0.0
                for iz in range(max(z - 1, 0), min(z, 1) + 1):
                    a, b = edges[y + 2 * iz], edges[4 + x + 2 * (z - iz)]
                    s0 += a[1] * b[2] - a[2] * b[1]
                    s1 += a[2] * b[0] - a[0] * b[2]
                    s2 += a[0] * b[1] - a[1] * b[0]
                weight = 0.5 if z == 1 else 1.0
                area = areas[y, x, z]
                area[0], area[1], area[2] = weight * s0, weight * s1, weight * s2

    coefficients[:] = 0.0
    for ky in range(2):
        for kx in range(2):
            c0, c1, c2 = edges[8 + kx + 2 * ky]
            for y in range(2):
                for x in range(2):
                    weight = (0.5 if x != kx else 1.0) * (0.5 if y != ky else 1.0)
                    for z in range(3):
                        area = areas[y, x, z]
                        det = area[0] * c0 + area[1] * c1 + area[2] * c2
                        coefficients[9 * z + 3 * (y + ky) + x + kx] += weight * det
    return ROUNDING * scale


@strict_loop
def _bracket_range(first, last, points, cells, depth, lower, upper):  # type: ignore[no-untyped-def]
    edges, areas = np.empty((12, 3)), np.empty((2, 2, 3, 3))
    stack, levels = np.empty((3 * depth + 1, 27)), np.empty(3 * depth + 1, np.int64)
    for c in range(first, last):
        edge_vectors(points, cells, c, edges)
        rounding = fill_coefficients(edges, areas, stack[0])
        lower[c], upper[c] = bracket_minimum(stack, levels, CORNER_PLACES, 3, rounding, depth)


@strict_loop
def _find_invalid(first, last, points, cells, depth, found):  # type: ignore[no-untyped-def]
    edges, areas = np.empty((12, 3)), np.empty((2, 2, 3, 3))
    stack, levels = np.empty((3 * depth + 1, 27)), np.empty(3 * depth + 1, np.int64)
    for c in range(first, last):
        edge_vectors(points, cells, c, edges)
        rounding = fill_coefficients(edges, areas, stack[0])
        lower, _ = bracket_minimum(stack, levels, CORNER_PLACES, 3, rounding, depth)
        if not lower > 0.0:
            found[0] = True
        # Set by any range; all of them write the same value.
        if found[0]:
            return
