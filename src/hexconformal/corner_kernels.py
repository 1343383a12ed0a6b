"""Compiled loops of the corner energy: values, gradients and convex Hessian blocks, cell by cell.

Every corner of a cell sees a frame f = [f1 f2 f3] J W^-1. With q the quaternionic distortion of the frame
(:mod:`hexconformal.distortion`), d its determinant and s = chi_eps(d)^(-2/3), its density is e = q s. The
exact Hessian of e is indefinite; freezing the normals turns q into a convex quadratic that majorizes it, and
q s(d) is jointly convex in (f, d) once s s'' >= 2 s'^2. Both together give a positive semidefinite block in
closed form, without eigenvalues:

    s K + s' (G a^T + a G^T) + q s'' a a^T,     K the frozen Hessian, G = dq/df, a = dd/df.
"""

from __future__ import annotations

import numpy as np

from .compiled import algebra, loop
from .distortion import barrier_factor, cofactor, determinant, frame_gradient, plane_normal

__all__ = ["corner_densities", "corner_sums"]

_HUGE = 1e290  # a density beyond this is a folded corner


@algebra
def _put(frame, out):  # type: ignore[no-untyped-def]
    for k in range(3):
        out[0, k], out[1, k], out[2, k] = frame[0][k], frame[1][k], frame[2][k]


@algebra
def _clear(values):  # type: ignore[no-untyped-def]
    flat = values.ravel()
    for i in range(len(flat)):
        flat[i] = 0.0


@loop
def _frame(x, corners, q, inverses, target, f):  # type: ignore[no-untyped-def]
    """Frame at corner q from the nodes x (8, 3); f[j] is column j of J W^-1."""
    for i in range(3):
        sign = corners[q, 3 + i]
        for k in range(3):
            f[i, k] = sign * (x[corners[q, i], k] - x[q, k])
    if len(inverses) > 0:
        point = q if inverses.shape[1] > 1 else 0
        for k in range(3):
            r0, r1, r2 = f[0, k], f[1, k], f[2, k]
            for j in range(3):
                f[j, k] = (
                    r0 * inverses[target, point, 0, j]
                    + r1 * inverses[target, point, 1, j]
                    + r2 * inverses[target, point, 2, j]
                )


@loop
def _parts(f, eps, order, gradient, area, normal):  # type: ignore[no-untyped-def]
    """q, s, s', s'' (raised to convexity) of a frame; G, a and the plane normals into the arrays."""
    frame = (
        (f[0, 0], f[0, 1], f[0, 2]),
        (f[1, 0], f[1, 1], f[1, 2]),
        (f[2, 0], f[2, 1], f[2, 2]),
    )
    d = determinant(frame)
    q, g = frame_gradient(frame)
    s, ds, dds = barrier_factor(d, eps)
    if order > 0:
        _put(g, gradient)
        _put(cofactor(frame), area)
    if order > 1:
        dds = max(dds, 2.0 * ds * ds / s)
        _put(
            (plane_normal(frame[0], frame[1]), plane_normal(frame[0], frame[2]), plane_normal(frame[1], frame[2])),
            normal,
        )
    return q, s, ds, dds, d


@loop
def _directions(f, u, lengths):  # type: ignore[no-untyped-def]
    """Split a frame into unit columns and their lengths."""
    for i in range(3):
        lengths[i] = max(np.sqrt(f[i, 0] ** 2 + f[i, 1] ** 2 + f[i, 2] ** 2), 1e-150)
        for k in range(3):
            u[i, k] = f[i, k] / lengths[i]


@loop
def _chain(u, lengths, vectors):  # type: ignore[no-untyped-def]
    """Derivatives with respect to the unit columns become derivatives with respect to the columns."""
    for i in range(3):
        along = vectors[i, 0] * u[i, 0] + vectors[i, 1] * u[i, 1] + vectors[i, 2] * u[i, 2]
        for k in range(3):
            vectors[i, k] = (vectors[i, k] - along * u[i, k]) / lengths[i]


@loop
def _cross_matrix(n, p, m):  # type: ignore[no-untyped-def]
    """[n]x of normal number p, into m."""
    m[0, 0] = m[1, 1] = m[2, 2] = 0.0
    m[0, 1], m[0, 2], m[1, 2] = -n[p, 2], n[p, 1], -n[p, 0]
    m[1, 0], m[2, 0], m[2, 1] = n[p, 2], -n[p, 1], n[p, 0]


@loop
def _sandwich(u, i, j, lengths, m):  # type: ignore[no-untyped-def]
    """m becomes P_i m P_j / (l_i l_j), P the projections orthogonal to the unit columns."""
    scale = 1.0 / (lengths[i] * lengths[j])
    for r in range(3):
        along = m[r, 0] * u[j, 0] + m[r, 1] * u[j, 1] + m[r, 2] * u[j, 2]
        for c in range(3):
            m[r, c] -= along * u[j, c]
    for c in range(3):
        along = m[0, c] * u[i, 0] + m[1, c] * u[i, 1] + m[2, c] * u[i, 2]
        for r in range(3):
            m[r, c] = (m[r, c] - along * u[i, r]) * scale


@loop
def _add_blocks(parts, weight, bend, g, gradient, area, normal, unit, u, lengths, m, blocks):  # type: ignore[no-untyped-def]
    """Add weight * (convex Hessian) + bend * g g^T to the nine 3 x 3 blocks of a corner."""
    q, s, ds, dds, _ = parts
    for i in range(3):
        for j in range(i, 3):
            if i == j:
                for r in range(3):
                    for c in range(3):
                        m[r, c] = 2.0 if r == c else 0.0
            else:
                _cross_matrix(normal, i + j - 1, m)
            if unit:
                _sandwich(u, i, j, lengths, m)
            for r in range(3):
                for c in range(3):
                    value = weight * (
                        4.0 * s * m[r, c]
                        + ds * (gradient[i, r] * area[j, c] + area[i, r] * gradient[j, c])
                        + q * dds * area[i, r] * area[j, c]
                    )
                    value += bend * g[i, r] * g[j, c]
                    blocks[i, j, r, c] += value
                    if i != j:
                        blocks[j, i, c, r] += value


@loop
def _pull_back(inverses, target, point, order, column, blocks, g, raw):  # type: ignore[no-untyped-def]
    """Derivatives with respect to J W^-1 become derivatives with respect to J; g and raw are scratch."""
    for i in range(3):
        for k in range(3):
            g[i, k] = 0.0
            for j in range(3):
                g[i, k] += inverses[target, point, i, j] * column[j, k]
    for i in range(3):
        for k in range(3):
            column[i, k] = g[i, k]
    if order < 2:
        return
    _clear(raw)
    for i in range(3):
        for j in range(3):
            for a in range(3):
                for b in range(3):
                    w = inverses[target, point, i, a] * inverses[target, point, j, b]
                    if w != 0.0:
                        for r in range(3):
                            for c in range(3):
                                raw[i, j, r, c] += w * blocks[a, b, r, c]
    for i in range(3):
        for j in range(3):
            for r in range(3):
                for c in range(3):
                    blocks[i, j, r, c] = raw[i, j, r, c]


@loop
def _spread(corners, q, order, column, blocks, forces, matrix):  # type: ignore[no-untyped-def]
    """Add what the three edges of corner q feel to the cell's nodes: forces (8, 3) and matrix (8, 8, 3, 3)."""
    for i in range(3):
        sign, a = corners[q, 3 + i], corners[q, i]
        for k in range(3):
            forces[a, k] += sign * column[i, k]
            forces[q, k] -= sign * column[i, k]
        if order > 1:
            for j in range(3):
                w, b = sign * corners[q, 3 + j], corners[q, j]
                for r in range(3):
                    for s in range(3):
                        value = w * blocks[i, j, r, s]
                        matrix[a, b, r, s] += value
                        matrix[a, q, r, s] -= value
                        matrix[q, b, r, s] -= value
                        matrix[q, q, r, s] += value


@loop
def corner_sums(  # type: ignore[no-untyped-def]
    points, cells, corners, inverses, eps, shape, angle, stiffness, order, forces, data, places
):
    """Sum of shape * e(f) + angle * phi(e(u)) over all corners, u the unit columns of f.

    phi(e) = e / (1 - stiffness e) rises without bound as the worst corner nears 1 / stiffness. Infinite where a
    corner is folded (eps = 0) or beyond that bound. order 1 adds the derivative to forces (n, 3); order 2 also
    the convex Hessian to the 3 x 3 blocks data at places (m, 64).
    """
    x, f, u, lengths = np.empty((8, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    gradient, area, normal = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    # Zeros: g is multiplied by zero before it is first set, and what happens to be in memory may be NaN.
    g, m, column = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    blocks, raw = np.zeros((3, 3, 3, 3)), np.zeros((3, 3, 3, 3))
    local_forces, local = np.empty((8, 3)), np.empty((8, 8, 3, 3))
    total = 0.0
    for c in range(len(cells)):
        target = c if len(inverses) > 1 else 0
        for a in range(8):
            for k in range(3):
                x[a, k] = points[cells[c, a], k]
        _clear(local_forces)
        if order > 1:
            _clear(local)
        for q in range(8):
            _frame(x, corners, q, inverses, target, f)
            _clear(column)
            _clear(blocks)
            if shape > 0.0:
                parts = _parts(f, eps, order, gradient, area, normal)
                density = parts[0] * parts[1]
                if not density < _HUGE or (eps == 0.0 and parts[4] <= 0.0):
                    return np.inf
                total += shape * density
                if order > 0:
                    for i in range(3):
                        for k in range(3):
                            column[i, k] += shape * (parts[1] * gradient[i, k] + parts[0] * parts[2] * area[i, k])
                if order > 1:
                    _add_blocks(parts, shape, 0.0, g, gradient, area, normal, False, u, lengths, m, blocks)
            if angle > 0.0:
                _directions(f, u, lengths)
                parts = _parts(u, 0.0, order, gradient, area, normal)
                density = parts[0] * parts[1]
                room = 1.0 - stiffness * density
                if not (room > 0.0 and parts[4] > 0.0):
                    return np.inf
                total += angle * density / room
                if order > 0:
                    slope = angle / (room * room)
                    _chain(u, lengths, gradient)
                    _chain(u, lengths, area)
                    for i in range(3):
                        for k in range(3):
                            g[i, k] = parts[1] * gradient[i, k] + parts[0] * parts[2] * area[i, k]
                            column[i, k] += slope * g[i, k]
                if order > 1:
                    bend = 2.0 * stiffness * slope / room
                    _add_blocks(parts, slope, bend, g, gradient, area, normal, True, u, lengths, m, blocks)
            if order == 0:
                continue
            if len(inverses) > 0:
                point = q if inverses.shape[1] > 1 else 0
                _pull_back(inverses, target, point, order, column, blocks, g, raw)
            _spread(corners, q, order, column, blocks, local_forces, local)
        if order > 0:
            for a in range(8):
                for k in range(3):
                    forces[cells[c, a], k] += local_forces[a, k]
        if order > 1:
            for a in range(8):
                for b in range(8):
                    place = places[c, 8 * a + b]
                    for r in range(3):
                        for s in range(3):
                            data[place, r, s] += local[a, b, r, s]
    return total


@loop
def corner_densities(first, last, points, cells, corners, inverses, smallest, shape, angle):  # type: ignore[no-untyped-def]
    """Per cell: smallest corner determinant of J W^-1, largest density e(f), largest e(u); inf where folded."""
    x, f, u, lengths = np.empty((8, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    gradient, area, normal = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for c in range(first, last):
        target = c if len(inverses) > 1 else 0
        for a in range(8):
            for k in range(3):
                x[a, k] = points[cells[c, a], k]
        smallest[c], shape[c], angle[c] = np.inf, 0.0, 0.0
        for q in range(8):
            _frame(x, corners, q, inverses, target, f)
            parts = _parts(f, 0.0, 0, gradient, area, normal)
            smallest[c] = min(smallest[c], parts[4])
            if parts[4] <= 0.0:
                shape[c] = angle[c] = np.inf
            else:
                shape[c] = max(shape[c], parts[0] * parts[1])
                _directions(f, u, lengths)
                parts = _parts(u, 0.0, 0, gradient, area, normal)
                angle[c] = max(angle[c], parts[0] * parts[1] if parts[4] > 0.0 else np.inf)
