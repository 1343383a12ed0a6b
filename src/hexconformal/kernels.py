"""Compiled loops over the quadrature points of hexahedra; each range writes only what it owns.

Arrays are passed whole, with indices (a slice made in the inner loop costs more than the arithmetic), and
the scratch arrays hold components first, so that the compiler can work on the eight nodes at once.
"""

from __future__ import annotations

import numpy as np

from .compiled import algebra, loop
from .distortion import (
    barrier_gradient,
    barrier_second,
    frame_frozen_second,
    frame_gradient,
    frame_second,
    plane_normal,
)
from .sparsity import find

__all__ = ["PLAIN", "energy_gradient", "frozen_product", "frozen_rows", "gather", "second_product"]

PLAIN = -1.0  # the value of eps that asks for the plain, orientation-blind energy


@algebra
def _load(points, cells, edges, c, x):  # type: ignore[no-untyped-def]
    """Edge vectors (12, 3) of a cell."""
    for e in range(12):
        a, b = cells[c, edges[e, 0]], cells[c, edges[e, 1]]
        for k in range(3):
            x[e, k] = points[b, k] - points[a, k]


@algebra
def _mean(x, table, q, e):  # type: ignore[no-untyped-def]
    """Derivative of the trilinear map along one axis: the mean of the four edges from e on."""
    w0, w1, w2, w3 = table[q, e], table[q, e + 1], table[q, e + 2], table[q, e + 3]
    return (
        w0 * x[e, 0] + w1 * x[e + 1, 0] + w2 * x[e + 2, 0] + w3 * x[e + 3, 0],
        w0 * x[e, 1] + w1 * x[e + 1, 1] + w2 * x[e + 2, 1] + w3 * x[e + 3, 1],
        w0 * x[e, 2] + w1 * x[e + 1, 2] + w2 * x[e + 2, 2] + w3 * x[e + 3, 2],
    )


@algebra
def _spread(p, weight, table, q, e, sums):  # type: ignore[no-untyped-def]
    """Transpose of :func:`_mean`: add a force on one axis to its four edges."""
    for i in range(e, e + 4):
        w = weight * table[q, i]
        sums[i, 0] += w * p[0]
        sums[i, 1] += w * p[1]
        sums[i, 2] += w * p[2]


@algebra
def _times(f, w00, w10, w20):  # type: ignore[no-untyped-def]
    return (
        w00 * f[0][0] + w10 * f[1][0] + w20 * f[2][0],
        w00 * f[0][1] + w10 * f[1][1] + w20 * f[2][1],
        w00 * f[0][2] + w10 * f[1][2] + w20 * f[2][2],
    )


@algebra
def _frame(x, table, q, inverses, target):  # type: ignore[no-untyped-def]
    """Columns of J = (dX / d xi) W^-1 at quadrature point q."""
    f = (_mean(x, table, q, 0), _mean(x, table, q, 4), _mean(x, table, q, 8))
    if len(inverses) == 0:
        return f
    w = inverses[target, q if inverses.shape[1] > 1 else 0]
    return (
        _times(f, w[0, 0], w[1, 0], w[2, 0]),
        _times(f, w[0, 1], w[1, 1], w[2, 1]),
        _times(f, w[0, 2], w[1, 2], w[2, 2]),
    )


@algebra
def _scatter(p, weight, table, q, inverses, target, sums):  # type: ignore[no-untyped-def]
    """Add the edge forces of a stress P (three columns), weighted, to sums (12, 3)."""
    if len(inverses) > 0:
        w = inverses[target, q if inverses.shape[1] > 1 else 0]
        p = (
            _times(p, w[0, 0], w[0, 1], w[0, 2]),
            _times(p, w[1, 0], w[1, 1], w[1, 2]),
            _times(p, w[2, 0], w[2, 1], w[2, 2]),
        )
    _spread(p[0], weight, table, q, 0, sums)
    _spread(p[1], weight, table, q, 4, sums)
    _spread(p[2], weight, table, q, 8, sums)


@algebra
def _store(sums, edges, forces, c):  # type: ignore[no-untyped-def]
    """Turn edge forces into the forces of the eight corners."""
    for a in range(8):
        for k in range(3):
            forces[c, a, k] = 0.0
    for e in range(12):
        for k in range(3):
            forces[c, edges[e, 0], k] -= sums[e, k]
            forces[c, edges[e, 1], k] += sums[e, k]


@loop
def energy_gradient(first, last, points, cells, edges, table, weights, scales, inverses, eps, energies, forces):  # type: ignore[no-untyped-def]
    """Energy (m,) of each cell and its derivative (m, 8, 3) with respect to the cell's own nodes."""
    x, sums = np.empty((12, 3)), np.empty((12, 3))
    for c in range(first, last):
        _load(points, cells, edges, c, x)
        sums[:] = 0.0
        total = 0.0
        scale = scales[c] if len(scales) > 1 else scales[0]
        target = c if len(inverses) > 1 else 0
        for q in range(len(weights)):
            f = _frame(x, table, q, inverses, target)
            if eps < 0.0:
                energy, p = frame_gradient(f)
            else:
                energy, p = barrier_gradient(f, eps)
            weight = scale * weights[q]
            total += weight * energy
            _scatter(p, weight, table, q, inverses, target, sums)
        energies[c] = total
        _store(sums, edges, forces, c)


@loop
def second_product(first, last, points, variation, cells, edges, table, weights, scales, inverses, eps, forces):  # type: ignore[no-untyped-def]
    """Exact second derivative of each cell's energy, applied to a variation of the points."""
    x, v, sums = np.empty((12, 3)), np.empty((12, 3)), np.empty((12, 3))
    for c in range(first, last):
        _load(points, cells, edges, c, x)
        _load(variation, cells, edges, c, v)
        sums[:] = 0.0
        scale = scales[c] if len(scales) > 1 else scales[0]
        target = c if len(inverses) > 1 else 0
        for q in range(len(weights)):
            f = _frame(x, table, q, inverses, target)
            d = _frame(v, table, q, inverses, target)
            p = frame_second(f, d) if eps < 0.0 else barrier_second(f, d, eps)
            _scatter(p, scale * weights[q], table, q, inverses, target, sums)
        _store(sums, edges, forces, c)


@loop
def frozen_product(first, last, points, variation, cells, edges, table, weights, scales, inverses, forces):  # type: ignore[no-untyped-def]
    """Majorizing second derivative (normals frozen at the points), applied to a variation."""
    x, v, sums = np.empty((12, 3)), np.empty((12, 3)), np.empty((12, 3))
    for c in range(first, last):
        _load(points, cells, edges, c, x)
        _load(variation, cells, edges, c, v)
        sums[:] = 0.0
        scale = scales[c] if len(scales) > 1 else scales[0]
        target = c if len(inverses) > 1 else 0
        for q in range(len(weights)):
            f = _frame(x, table, q, inverses, target)
            d = _frame(v, table, q, inverses, target)
            _scatter(frame_frozen_second(f, d), scale * weights[q], table, q, inverses, target, sums)
        _store(sums, edges, forces, c)


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


@loop
def frozen_rows(  # type: ignore[no-untyped-def]
    first, last, points, cells, edges, table, weights, scales, inverses, offsets, incidences, indptr, indices, skew
):
    """Rows of the antisymmetric part of the frozen Hessian: one vector per nonzero of the scalar pattern.

    skew[l, m] = sum over planes (i, j) and quadrature points of w (B_jl B_im - B_il B_jm) N_ij.
    """
    x, b = np.empty((12, 3)), np.empty((8, 3))
    slots = np.empty(8, np.int64)
    for node in range(first, last):
        skew[indptr[node] : indptr[node + 1]] = 0.0
        for k in range(offsets[node], offsets[node + 1]):
            c, corner = incidences[k] // 8, incidences[k] % 8
            _load(points, cells, edges, c, x)
            target = c if len(inverses) > 1 else 0
            for a in range(8):
                slots[a] = find(indices, indptr[node], indptr[node + 1], cells[c, a])
            for q in range(len(weights)):
                f = _frame(x, table, q, inverses, target)
                n12, n13, n23 = plane_normal(f[0], f[1]), plane_normal(f[0], f[2]), plane_normal(f[1], f[2])
                for e in range(24):
                    b[e // 3, e % 3] = 0.0
                for e in range(12):
                    g = table[q, e]
                    b[edges[e, 0], e // 4] -= g
                    b[edges[e, 1], e // 4] += g
                if len(inverses) > 0:
                    w = inverses[target, q if inverses.shape[1] > 1 else 0]
                    for a in range(8):
                        g0, g1, g2 = b[a, 0], b[a, 1], b[a, 2]
                        for j in range(3):
                            b[a, j] = g0 * w[0, j] + g1 * w[1, j] + g2 * w[2, j]
                weight = weights[q] * (scales[c] if len(scales) > 1 else scales[0])
                for a in range(8):
                    w12 = weight * (b[corner, 1] * b[a, 0] - b[corner, 0] * b[a, 1])
                    w13 = weight * (b[corner, 2] * b[a, 0] - b[corner, 0] * b[a, 2])
                    w23 = weight * (b[corner, 2] * b[a, 1] - b[corner, 1] * b[a, 2])
                    skew[slots[a], 0] += w12 * n12[0] + w13 * n13[0] + w23 * n23[0]
                    skew[slots[a], 1] += w12 * n12[1] + w13 * n13[1] + w23 * n23[1]
                    skew[slots[a], 2] += w12 * n12[2] + w13 * n13[2] + w23 * n23[2]
