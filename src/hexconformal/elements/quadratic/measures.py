"""Compiled loops that measure quadratic cells: at places, nine along an edge, and certified measures inside."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ...kernel import parallel_ranges, strict_loop
from ..bernstein import DEPTH, bracket_minimum
from ..cell_measures import MEASURES, face_area, mean_ratio, scaled_jacobian
from ..cell_type import CellType
from ..hexahedron import HEXAHEDRON
from ..validity import contiguous
from .cell_types import edge_nodes
from .control_vectors import control_vectors
from .parts import cell_parts
from .places import edge_derivatives, inverse_shares, nearest_corners
from .validity import CORNER_PLACES, fill_quadratic, room_for_cell

__all__ = ["quadratic_measures"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_SAMPLES = 9  # along each axis: nodes are among them, and where they lie between nodes the extremes are close
_GAUSS = tuple((0.5 + 0.5 * np.polynomial.legendre.leggauss(3)[0]).tolist())
_GAUSS_WEIGHTS = tuple((0.5 * np.polynomial.legendre.leggauss(3)[1]).tolist())


def quadratic_measures(points: Floats, cells: Ints, cell_type: CellType) -> Floats:
    """All `MEASURES`, as :class:`hexconformal.Quality` tells of them: a row each, (6, m).

    Those that linear cells have at corners are the worst at a lattice with nine places along an edge, 729 in a
    hexahedron, each with the edges of the nearest corner. Lengths of edges are those of the curves, by Gauss's rule of
    three points.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, k) nodes in VTK order.
    cell_type
        A quadratic type.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON20
    >>> brick = HEXAHEDRON20.ideal * [1.0, 1.0, 2.0]
    >>> quadratic_measures(brick, np.arange(20)[None], HEXAHEDRON20).round(4).T
    array([[1.    , 1.    , 0.7937, 0.1667, 2.    , 2.    ]])
    """
    rows, tables = np.empty((len(MEASURES), len(cells))), control_vectors(cell_type).for_loops
    target = cell_type.inverse_target, cell_type.corner_volume, inverse_shares(cell_type)
    arguments = *contiguous(points, cells), tables, _derivatives(cell_type), *target, edge_nodes(cell_type)
    parallel_ranges(_measure_range, len(cells), *arguments, rows)
    return rows


@cache
def _derivatives(cell_type: CellType) -> Floats:
    """(3, k, q) derivatives of the shape functions along the edges of the nearest corners of the places."""
    places = cell_parts(cell_type, _SAMPLES - 1).places
    if len(cell_type.neighbours) < cell_type.corners:
        # At an apex they depend on the way there.
        places = cell_parts(HEXAHEDRON, _SAMPLES - 1).places
    which, corners = nearest_corners(cell_type, places)
    return edge_derivatives(cell_type, places[which], corners)


@strict_loop
def _store_frames(points, cells, c, gradients, frames):  # type: ignore[no-untyped-def]
    """The derivatives (3, 3, q) along the edges at the places."""
    frames[:] = 0.0
    for a in range(1, gradients.shape[1]):
        for i in range(3):
            x = points[cells[c, a], i] - points[cells[c, 0], i]
            for j in range(3):
                for q in range(gradients.shape[2]):
                    frames[j, i, q] += gradients[j, a, q] * x


@strict_loop
def _curve_length(points, cells, c, a, b, middle):  # type: ignore[no-untyped-def]
    """Of an edge from node a to node b by way of its middle one."""
    total = 0.0
    for g in range(3):
        t, squared = _GAUSS[g], 0.0
        for i in range(3):
            first = points[cells[c, middle], i] - points[cells[c, a], i]
            second = points[cells[c, b], i] - points[cells[c, middle], i]
            squared += ((3.0 - 4.0 * t) * first + (4.0 * t - 1.0) * second) ** 2
        total += _GAUSS_WEIGHTS[g] * np.sqrt(squared)
    return total


@strict_loop
def _at_places(frames, inverse, corner_volume, columns):  # type: ignore[no-untyped-def]
    """Store the measures that are the worst of all places; frames hold the edges there."""
    scaled, shape, distortion = 1.0, 1.0, 0.0
    edges, jacobian = np.empty((3, 3)), np.empty((3, 3))
    lengths = np.empty(3)
    for q in range(frames.shape[2]):
        norm = 0.0
        for j in range(3):
            for i in range(3):
                edges[j, i] = frames[j, i, q]
            lengths[j] = np.sqrt(edges[j, 0] ** 2 + edges[j, 1] ** 2 + edges[j, 2] ** 2)
        for j in range(3):
            for i in range(3):
                jacobian[j, i] = edges[0, i] * inverse[0, j] + edges[1, i] * inverse[1, j] + edges[2, i] * inverse[2, j]
            norm += jacobian[j, 0] ** 2 + jacobian[j, 1] ** 2 + jacobian[j, 2] ** 2
        f, g, h = edges[0], edges[1], edges[2]
        det = (
            (f[1] * g[2] - f[2] * g[1]) * h[0] + (f[2] * g[0] - f[0] * g[2]) * h[1] + (f[0] * g[1] - f[1] * g[0]) * h[2]
        ) / corner_volume
        area = face_area(jacobian, 0, 1) + face_area(jacobian, 1, 2) + face_area(jacobian, 2, 0)
        scaled = min(scaled, scaled_jacobian(det, lengths[0] * lengths[1] * lengths[2]))
        shape = min(shape, mean_ratio(det, norm))
        distortion = max(distortion, 1.0 - area / norm if norm > 0.0 else 1.0)
    columns[0], columns[2], columns[3] = scaled, shape, distortion


@strict_loop
def _measure_range(  # type: ignore[no-untyped-def]
    first, last, points, cells, tables, gradients, inverse, corner_volume, shares, edges, columns
):
    """Fill the columns in the order of MEASURES."""
    room = room_for_cell()
    stack, levels = np.empty((3 * DEPTH + 1, 216)), np.empty(3 * DEPTH + 1, np.int64)
    frames = np.empty((3, 3, gradients.shape[2]))
    for c in range(first, last):
        _store_frames(points, cells, c, gradients, frames)
        _at_places(frames, inverse, corner_volume, columns[:, c])

        bound = fill_quadratic(points, cells, c, tables, room, stack[0])
        volume = largest = 0.0
        for p in range(216):
            volume += stack[0, p] / shares[p]
            largest = max(largest, abs(stack[0, p]))
        lower, _ = bracket_minimum(stack, levels, CORNER_PLACES, 6, bound, DEPTH)
        columns[1, c] = max(-1.0, lower / largest) if largest > 0.0 else 0.0

        longest, shortest = 0.0, np.inf
        for k in range(len(edges)):
            length = _curve_length(points, cells, c, edges[k, 0], edges[k, 1], edges[k, 2])
            longest, shortest = max(longest, length), min(shortest, length)
        columns[4, c] = longest / shortest if shortest > 0.0 else np.inf
        columns[5, c] = volume
