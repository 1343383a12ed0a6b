"""Compiled loops over the eight quadrature points of hexahedra; each range writes only what it owns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import (
    EIGHT,
    Vector,
    add,
    algebra,
    barrier_gradient,
    barrier_second,
    combine,
    frame_at,
    frame_frozen_second,
    frame_gradient,
    frame_second,
    loop,
    matrix_product,
    store,
    store_inverses,
    subtract,
    transpose,
)

__all__ = ["FROZEN", "QUATERNIONIC", "energy_gradient", "gather", "second_product"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

# Values of eps that stand for the quaternionic energy (6), blind to orientation, and its second derivative with normals
# frozen.
QUATERNIONIC, FROZEN = -1.0, -2.0

# First rows of what the work array holds; the weights stay, the rest changes from cell to cell.
_FRAME, _VARIATION, _STRESS, _ENERGY, _INVERSE = 0, 9, 18, 27, 28
_EDGE_WEIGHTS, _PRODUCTS, _QUADRATURE_WEIGHTS, _ROWS = 37, 49, 61, 62


@algebra
def _work_array(table: Field, weights: Field) -> Field:
    """Work array with its weights: those of edges (8, 12), of the quadrature (8,), and their products."""
    s = np.empty((_ROWS, 8))
    for q in range(8):
        s[_QUADRATURE_WEIGHTS, q] = weights[q]
        for e in range(12):
            s[_EDGE_WEIGHTS + e, q] = table[q, e]
            s[_PRODUCTS + e, q] = weights[q] * table[q, e]
    return s


@algebra
def _edge(field: Field, cells: Ints, c: int, a: int, b: int) -> Vector:
    return subtract(_node_vector(field, cells[c, b]), _node_vector(field, cells[c, a]))


@algebra
def _node_vector(field: Field, i: int) -> Vector:
    return field[i, 0], field[i, 1], field[i, 2]


@algebra
def _mean_of_edges(x0: Vector, x1: Vector, x2: Vector, x3: Vector, s: Field, row: int, q: int) -> Vector:
    return add(combine(s[row, q], x0, s[row + 1, q], x1), combine(s[row + 2, q], x2, s[row + 3, q], x3))


@algebra
def _store_frames(field: Field, cells: Ints, c: int, inverses: Field, s: Field, row: int) -> None:
    """Columns of (d field / d xi) W^-1 at the quadrature points: means of four edges (elements.EDGES) each."""
    x0, x1 = _edge(field, cells, c, 0, 1), _edge(field, cells, c, 3, 2)
    x2, x3 = _edge(field, cells, c, 4, 5), _edge(field, cells, c, 7, 6)
    y0, y1 = _edge(field, cells, c, 0, 3), _edge(field, cells, c, 1, 2)
    y2, y3 = _edge(field, cells, c, 4, 7), _edge(field, cells, c, 5, 6)
    z0, z1 = _edge(field, cells, c, 0, 4), _edge(field, cells, c, 1, 5)
    z2, z3 = _edge(field, cells, c, 3, 7), _edge(field, cells, c, 2, 6)
    for q in range(8):
        f0 = _mean_of_edges(x0, x1, x2, x3, s, _EDGE_WEIGHTS, q)
        f1 = _mean_of_edges(y0, y1, y2, y3, s, _EDGE_WEIGHTS + 4, q)
        f2 = _mean_of_edges(z0, z1, z2, z3, s, _EDGE_WEIGHTS + 8, q)
        store((f0, f1, f2), s, row, q)
    if len(inverses) > 0:
        for q in range(8):
            store(matrix_product(transpose(frame_at(s, _INVERSE, q)), frame_at(s, row, q)), s, row, q)


@algebra
def _store_forces(s: Field, points: int, factor: float, inverses: Field, forces: Field, c: int) -> None:
    """Transpose of :func:`_store_frames`: forces of the eight corners from the stresses at the quadrature points."""
    if len(inverses) > 0:
        for q in range(8):
            store(matrix_product(frame_at(s, _INVERSE, q), frame_at(s, _STRESS, q)), s, _STRESS, q)
    for k in range(3):
        x0 = x1 = x2 = x3 = y0 = y1 = y2 = y3 = z0 = z1 = z2 = z3 = 0.0
        # Eight as a number known in advance would be unrolled, not vectorised.
        for q in range(points):
            p = s[_STRESS + k, q]
            x0 += s[_PRODUCTS, q] * p
            x1 += s[_PRODUCTS + 1, q] * p
            x2 += s[_PRODUCTS + 2, q] * p
            x3 += s[_PRODUCTS + 3, q] * p
            p = s[_STRESS + 3 + k, q]
            y0 += s[_PRODUCTS + 4, q] * p
            y1 += s[_PRODUCTS + 5, q] * p
            y2 += s[_PRODUCTS + 6, q] * p
            y3 += s[_PRODUCTS + 7, q] * p
            p = s[_STRESS + 6 + k, q]
            z0 += s[_PRODUCTS + 8, q] * p
            z1 += s[_PRODUCTS + 9, q] * p
            z2 += s[_PRODUCTS + 10, q] * p
            z3 += s[_PRODUCTS + 11, q] * p
        forces[c, 0, k] = -factor * (x0 + y0 + z0)
        forces[c, 1, k] = factor * (x0 - y1 - z1)
        forces[c, 2, k] = factor * (x1 + y1 - z3)
        forces[c, 3, k] = factor * (y0 - x1 - z2)
        forces[c, 4, k] = factor * (z0 - x2 - y2)
        forces[c, 5, k] = factor * (x2 + z1 - y3)
        forces[c, 6, k] = factor * (x3 + y3 + z3)
        forces[c, 7, k] = factor * (y2 + z2 - x3)


@algebra
def _gradients(s: Field, eps: float) -> None:
    if eps < 0.0:
        for q in range(8):
            s[_ENERGY, q], stress = frame_gradient(frame_at(s, _FRAME, q))
            store(stress, s, _STRESS, q)
    else:
        for q in range(8):
            s[_ENERGY, q], stress = barrier_gradient(frame_at(s, _FRAME, q), eps)
            store(stress, s, _STRESS, q)


@algebra
def _seconds(s: Field, eps: float) -> None:
    if eps == FROZEN:
        for q in range(8):
            store(frame_frozen_second(frame_at(s, _FRAME, q), frame_at(s, _VARIATION, q)), s, _STRESS, q)
    elif eps < 0.0:
        for q in range(8):
            store(frame_second(frame_at(s, _FRAME, q), frame_at(s, _VARIATION, q)), s, _STRESS, q)
    else:
        for q in range(8):
            store(barrier_second(frame_at(s, _FRAME, q), frame_at(s, _VARIATION, q), eps), s, _STRESS, q)


@loop
def energy_gradient(first, last, points, cells, table, weights, scales, inverses, eps, energies, forces):  # type: ignore[no-untyped-def]
    """Energy (m,) of each cell and its derivative (m, 8, 3) with respect to the cell's own nodes."""
    s = _work_array(table, weights)
    for c in range(first, last):
        store_inverses(inverses, c, s, _INVERSE, EIGHT)
        _store_frames(points, cells, c, inverses, s, _FRAME)
        _gradients(s, eps)
        factor = scales[c] if len(scales) > 1 else scales[0]
        total = 0.0
        for q in range(8):
            total += s[_QUADRATURE_WEIGHTS, q] * s[_ENERGY, q]
        energies[c] = factor * total
        _store_forces(s, len(weights), factor, inverses, forces, c)


@loop
def second_product(first, last, points, variation, cells, table, weights, scales, inverses, eps, forces):  # type: ignore[no-untyped-def]
    """Second derivative of each cell's energy, applied to a variation of the points."""
    s = _work_array(table, weights)
    for c in range(first, last):
        store_inverses(inverses, c, s, _INVERSE, EIGHT)
        _store_frames(points, cells, c, inverses, s, _FRAME)
        _store_frames(variation, cells, c, inverses, s, _VARIATION)
        _seconds(s, eps)
        _store_forces(s, len(weights), scales[c] if len(scales) > 1 else scales[0], inverses, forces, c)


@loop
def gather(first, last, offsets, incidences, corner_values, out):  # type: ignore[no-untyped-def]
    """Sum corner values (8 m, 3) into nodes (n, 3), always in the same order."""
    for node in range(first, last):
        s0, s1, s2 = 0.0, 0.0, 0.0
        for k in range(offsets[node], offsets[node + 1]):
            i = incidences[k]
            s0 += corner_values[i, 0]
            s1 += corner_values[i, 1]
            s2 += corner_values[i, 2]
        out[node, 0], out[node, 1], out[node, 2] = s0, s1, s2
