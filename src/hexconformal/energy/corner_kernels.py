"""Compiled loops of the corner energy: values, gradients and convex Hessian blocks, cell by cell.

Every corner of a cell sees a frame f = [f1 f2 f3] J W^-1. With q the quaternionic distortion of the frame
(:mod:`hexconformal.kernel.distortion`), d its determinant and s = chi_eps(d)^(-2/3), its density is e = q s. The
exact Hessian of e is indefinite; freezing the normals turns q into a convex quadratic that majorizes it, and
q s(d) is jointly convex in (f, d) once s s'' >= 2 s'^2. Both together give a positive semidefinite block in
closed form, without eigenvalues:

    s K + s' (G a^T + a G^T) + q s'' a a^T,     K the frozen Hessian, G = dq/df, a = dd/df,

equation (11) of docs/mathematics.md.

The angles alone are measured on the unit columns u of f. Their determinant is the scaled Jacobian, and what counts
in the end, so e(u) = (q + c) s - c has a constant c: without it, corners with one bad angle get worse while others,
with three that are not as bad, get better.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import (
    Frame,
    Vector,
    algebra,
    barrier_factor,
    cofactor,
    combine,
    cross,
    cross_matrix,
    determinant,
    dot,
    frame_at,
    frame_density,
    frame_gradient,
    loop,
    matrix_product,
    orthogonal_projection,
    outer_sum,
    plane_normal,
    plus,
    polar,
    scale,
    store,
    store_inverses,
    times,
    transpose,
)
from .corner_blocks import BLOCKS, COLUMN, END, INVERSE, SIGN, add_blocks, add_forces, pull_back, to_nodes

__all__ = ["corner_densities", "corner_sums"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_FOLDED = 1e290  # a density beyond this is a folded corner
_JACOBIAN_WEIGHT = 8.0  # weight of the scaled Jacobian beside the distortion of the unit columns

# First rows of what the work array holds besides.
_FRAME, _DENSITY, _MARGIN, _ROWS = END, END + 9, END + 10, END + 11


@algebra
def _add_to(f: Frame, s: Field, row: int, q: int) -> None:
    store(plus(frame_at(s, row, q), f), s, row, q)


@algebra
def _store_frames(points: Field, cells: Ints, c: int, corners: Ints, inverses: Field, s: Field) -> None:
    """The frames at the corners of a cell, W^-1 there, and the signs that turn edges into derivatives."""
    for q in range(8):
        here = cells[c, q]
        for i in range(3):
            there, sign = cells[c, corners[q, i]], corners[q, 3 + i]
            s[SIGN + i, q] = sign
            for k in range(3):
                s[_FRAME + 3 * i + k, q] = sign * (points[there, k] - points[here, k])
    store_inverses(inverses, c, s, INVERSE)
    if len(inverses) > 0:
        for q in range(8):
            store(matrix_product(transpose(frame_at(s, INVERSE, q)), frame_at(s, _FRAME, q)), s, _FRAME, q)


@algebra
def _directions(f: Frame) -> tuple[Frame, Vector]:
    """Unit columns of a frame and their reciprocal lengths."""
    u0, r0 = polar(f[0])
    u1, r1 = polar(f[1])
    u2, r2 = polar(f[2])
    return (u0, u1, u2), (r0, r1, r2)


@algebra
def _chain(u: Frame, r: Vector, v: Frame) -> Frame:
    """Derivatives with respect to the unit columns become derivatives with respect to the columns."""
    return (
        combine(r[0], v[0], -r[0] * dot(v[0], u[0]), u[0]),
        combine(r[1], v[1], -r[1] * dot(v[1], u[1]), u[1]),
        combine(r[2], v[2], -r[2] * dot(v[2], u[2]), u[2]),
    )


@algebra
def _store_densities(s: Field, eps: float, distortion: float, angle: float, stiffness: float) -> None:
    """Density of each corner, and the margin that has to be positive there."""
    for q in range(8):
        f = frame_at(s, _FRAME, q)
        d = determinant(f)
        s[_DENSITY, q] = distortion * frame_density(f) * barrier_factor(d, eps)[0]
        s[_MARGIN, q] = d if eps == 0.0 else 1.0
    if angle > 0.0:
        for q in range(8):
            u, _ = _directions(frame_at(s, _FRAME, q))
            d = determinant(u)
            density = (frame_density(u) + _JACOBIAN_WEIGHT) * barrier_factor(d, 0.0)[0] - _JACOBIAN_WEIGHT
            margin = 1.0 - stiffness * density
            s[_DENSITY, q] += angle * density / margin
            s[_MARGIN, q] = min(s[_MARGIN, q], min(margin, d))


@algebra
def _add_distortion(s: Field, eps: float, weight: float) -> None:
    """Density of each corner, its derivative, and the convex Hessian, of the whole distortion."""
    for q in range(8):
        f = frame_at(s, _FRAME, q)
        d = determinant(f)
        density, g = frame_gradient(f)
        a = cofactor(f)
        factor, slope, curvature = barrier_factor(d, eps)
        curvature = max(curvature, 2.0 * slope * slope / factor)
        s[_DENSITY, q] = weight * density * factor
        s[_MARGIN, q] = d if eps == 0.0 else 1.0
        store(plus(times(weight * factor, g), times(weight * density * slope, a)), s, COLUMN, q)
        along = times(weight * slope, a)
        across = plus(times(weight * slope, g), times(weight * density * curvature, a))
        k = 4.0 * weight * factor
        same = (2.0 * k, 0.0, 0.0), (0.0, 2.0 * k, 0.0), (0.0, 0.0, 2.0 * k)
        store(plus(same, outer_sum(g[0], along[0], a[0], across[0])), s, BLOCKS, q)
        turn = cross_matrix(k, plane_normal(f[0], f[1]))
        store(plus(turn, outer_sum(g[0], along[1], a[0], across[1])), s, BLOCKS + 9, q)
        turn = cross_matrix(k, plane_normal(f[0], f[2]))
        store(plus(turn, outer_sum(g[0], along[2], a[0], across[2])), s, BLOCKS + 18, q)
        store(plus(same, outer_sum(g[1], along[1], a[1], across[1])), s, BLOCKS + 27, q)
        turn = cross_matrix(k, plane_normal(f[1], f[2]))
        store(plus(turn, outer_sum(g[1], along[2], a[1], across[2])), s, BLOCKS + 36, q)
        store(plus(same, outer_sum(g[2], along[2], a[2], across[2])), s, BLOCKS + 45, q)


@algebra
def _unit_cross_block(k: float, u: Vector, v: Vector) -> Frame:
    """k P_u [n]x P_v, n the normal of the plane of the unit vectors u and v: -k |u x v| (n x u) (n x v)^T."""
    c = cross(u, v)
    n, _ = polar(c)
    m, t = scale(-k, cross(n, u)), cross(c, v)
    return scale(m[0], t), scale(m[1], t), scale(m[2], t)


@algebra
def _add_angles(s: Field, weight: float, stiffness: float) -> None:
    """Add the same of phi(e(u)), u the unit columns."""
    for q in range(8):
        f = frame_at(s, _FRAME, q)
        u, r = _directions(f)
        d = determinant(u)
        density, g = frame_gradient(u)
        density += _JACOBIAN_WEIGHT
        factor, slope, curvature = barrier_factor(d, 0.0)
        curvature = max(curvature, 2.0 * slope * slope / factor)
        g, a = _chain(u, r, g), _chain(u, r, cofactor(u))
        e = density * factor - _JACOBIAN_WEIGHT
        margin = 1.0 - stiffness * e
        s[_DENSITY, q] += weight * e / margin
        s[_MARGIN, q] = min(s[_MARGIN, q], min(margin, d))
        first = weight / (margin * margin)
        second = 2.0 * stiffness * first / margin
        down = density * slope
        _add_to(plus(times(first * factor, g), times(first * down, a)), s, COLUMN, q)
        # first * (slope (g a^T + a g^T) + density bend a a^T) + second * (factor g + down a) (factor g + down a)^T
        both = first * slope + second * factor * down
        along = plus(times(second * factor * factor, g), times(both, a))
        across = plus(times(both, g), times(first * density * curvature + second * down * down, a))
        k = 4.0 * first * factor
        _add_to(
            plus(orthogonal_projection(2.0 * k * r[0] * r[0], u[0]), outer_sum(g[0], along[0], a[0], across[0])),
            s,
            BLOCKS,
            q,
        )
        turn = _unit_cross_block(k * r[0] * r[1], u[0], u[1])
        _add_to(plus(turn, outer_sum(g[0], along[1], a[0], across[1])), s, BLOCKS + 9, q)
        turn = _unit_cross_block(k * r[0] * r[2], u[0], u[2])
        _add_to(plus(turn, outer_sum(g[0], along[2], a[0], across[2])), s, BLOCKS + 18, q)
        _add_to(
            plus(orthogonal_projection(2.0 * k * r[1] * r[1], u[1]), outer_sum(g[1], along[1], a[1], across[1])),
            s,
            BLOCKS + 27,
            q,
        )
        turn = _unit_cross_block(k * r[1] * r[2], u[1], u[2])
        _add_to(plus(turn, outer_sum(g[1], along[2], a[1], across[2])), s, BLOCKS + 36, q)
        _add_to(
            plus(orthogonal_projection(2.0 * k * r[2] * r[2], u[2]), outer_sum(g[2], along[2], a[2], across[2])),
            s,
            BLOCKS + 45,
            q,
        )


@loop
def corner_sums(  # type: ignore[no-untyped-def]
    points, cells, corners, inverses, eps, distortion, angle, stiffness, derivatives, forces, data, places
):
    """Sum of shape * e(f) + angle * phi(e(u)) over all corners, u the unit columns of f.

    phi(e) = e / (1 - stiffness e) rises without bound as the worst corner nears 1 / stiffness. Infinite where a
    corner is folded (eps = 0) or beyond that bound. With derivatives, adds the first to forces (n, 3) and the
    convex Hessian to the 3 x 3 blocks data at places (m, 36), those of
    :func:`hexconformal.energy.block_matrix.block_places`.
    """
    s, local = np.empty((_ROWS, 8)), np.empty((36, 3, 3))
    total = 0.0
    for c in range(len(cells)):
        _store_frames(points, cells, c, corners, inverses, s)
        if derivatives:
            _add_distortion(s, eps, distortion)
            if angle > 0.0:
                _add_angles(s, angle, stiffness)
        else:
            _store_densities(s, eps, distortion, angle, stiffness)
        for q in range(8):
            if not (s[_MARGIN, q] > 0.0 and s[_DENSITY, q] < _FOLDED):
                return np.inf
            total += s[_DENSITY, q]
        if not derivatives:
            continue
        if len(inverses) > 0:
            pull_back(s)
        to_nodes(s)
        add_forces(s, cells, c, corners, forces)
        add_blocks(s, cells, c, corners, places, local, data)
    return total


@loop
def corner_densities(first, last, points, cells, corners, inverses, smallest, distortion, angle):  # type: ignore[no-untyped-def]
    """Per cell: smallest corner determinant of J W^-1, largest density e(f), largest e(u); inf where folded."""
    s = np.empty((_ROWS, 8))
    for c in range(first, last):
        _store_frames(points, cells, c, corners, inverses, s)
        for q in range(8):
            f = frame_at(s, _FRAME, q)
            u, _ = _directions(f)
            s[_MARGIN, q] = determinant(f)
            s[_DENSITY, q] = frame_density(f) * barrier_factor(determinant(f), 0.0)[0]
            s[COLUMN, q] = (frame_density(u) + _JACOBIAN_WEIGHT) * barrier_factor(determinant(u), 0.0)[
                0
            ] - _JACOBIAN_WEIGHT
        smallest[c], distortion[c], angle[c] = np.inf, 0.0, 0.0
        for q in range(8):
            smallest[c] = min(smallest[c], s[_MARGIN, q])
            distortion[c] = max(distortion[c], s[_DENSITY, q])
            angle[c] = max(angle[c], s[COLUMN, q])
        if not smallest[c] > 0.0:
            distortion[c] = angle[c] = np.inf
