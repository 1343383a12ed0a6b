"""Densities of frames with their convex second derivatives, equations (11) and (12), at the eight points of a cell.

Every point sees a frame f = [f1 f2 f3] J W^-1. With q the quaternionic distortion of the frame
(:mod:`hexconformal.kernel.distortion`), d its determinant and s = chi_eps(d)^(-2/3), its density is e = q s. The
exact Hessian of e is indefinite; freezing the normals turns q into a convex quadratic that majorizes it, and
q s(d) is jointly convex in (f, d) once s s'' >= 2 s'^2. Both together give a positive semidefinite block in
closed form, without eigenvalues:

    s K + s' (G a^T + a G^T) + q s'' a a^T,     K the frozen Hessian, G = dq/df, a = dd/df,

equation (11) of docs/mathematics.md.

The angles alone are measured on the unit columns u of f. Their determinant is the scaled Jacobian, and what counts
in the end, so e(u) = (q + c) s - c has a constant c: without it, corners with one bad angle get worse while others,
with three that are not as bad, get better.

The angles say nothing of lengths, and the distortion of a flat brick little: cells get thin for the sake of angles. Of
every two edges at a corner, l1 >= l2 relative to their target, the density is

    w (x^2 + 8 x^4),    x = max(log(l1 / l2) - log(slender), 0),

zero up to a ratio that does no harm, mild up to twice that, steep beyond. Its Gauss-Newton part is what the convex
Hessian gets.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import (
    Frame,
    Lanes,
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
    frame_gradient,
    orthogonal_projection,
    outer_sum,
    plane_normal,
    plus,
    polar,
    scale,
    store,
    times,
    vector_at,
)
from .corner_blocks import BLOCKS, COLUMN, END

__all__ = ["DENSITY", "FOLDED", "FRAME", "JACOBIAN_WEIGHT", "MARGIN", "ROWS", "STEEP"]
__all__ += ["add_angles", "add_proportions", "add_shapes", "directions", "of_columns", "store_distortion"]
__all__ += ["store_quaternionic"]

Field = NDArray[np.float64]

FOLDED = 1e290  # a density beyond this is a folded corner
STEEP = 8.0  # weight of x^4 beside x^2
JACOBIAN_WEIGHT = 8.0  # weight of the scaled Jacobian beside the distortion of the unit columns

# First rows of what the work array holds besides.
FRAME, DENSITY, MARGIN, ROWS = END, END + 9, END + 10, END + 11


@algebra
def _add_to(f: Frame, s: Field, row: int, q: int) -> None:
    store(plus(frame_at(s, row, q), f), s, row, q)


@algebra
def directions(f: Frame) -> tuple[Frame, Vector]:
    """Unit columns of a frame and their reciprocal lengths."""
    u0, r0 = polar(f[0])
    u1, r1 = polar(f[1])
    u2, r2 = polar(f[2])
    return (u0, u1, u2), (r0, r1, r2)


@algebra
def of_columns(u: Frame, r: Vector, v: Frame) -> Frame:
    """Derivatives with respect to the unit columns become derivatives with respect to the columns."""
    return (
        combine(r[0], v[0], -r[0] * dot(v[0], u[0]), u[0]),
        combine(r[1], v[1], -r[1] * dot(v[1], u[1]), u[1]),
        combine(r[2], v[2], -r[2] * dot(v[2], u[2]), u[2]),
    )


@algebra
def store_distortion(s: Field, eps: float, weight: float, lanes: Lanes) -> None:
    """Density of each corner, its derivative, and the convex Hessian, of the whole distortion."""
    for q in range(len(lanes)):
        f = frame_at(s, FRAME, q)
        d = determinant(f)
        density, g = frame_gradient(f)
        a = cofactor(f)
        factor, slope, curvature = barrier_factor(d, eps)
        curvature = max(curvature, 2.0 * slope * slope / factor)
        s[DENSITY, q] = weight * density * factor
        s[MARGIN, q] = d if eps == 0.0 else 1.0
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
def store_quaternionic(s: Field, weight: float, lanes: Lanes) -> None:
    """Density of each point, its derivative, and the frozen Hessian (5), of the quaternionic distortion."""
    for q in range(len(lanes)):
        f = frame_at(s, FRAME, q)
        density, g = frame_gradient(f)
        s[DENSITY, q] = weight * density
        s[MARGIN, q] = 1.0
        store(times(weight, g), s, COLUMN, q)
        k = 4.0 * weight
        same = (2.0 * k, 0.0, 0.0), (0.0, 2.0 * k, 0.0), (0.0, 0.0, 2.0 * k)
        store(same, s, BLOCKS, q)
        store(cross_matrix(k, plane_normal(f[0], f[1])), s, BLOCKS + 9, q)
        store(cross_matrix(k, plane_normal(f[0], f[2])), s, BLOCKS + 18, q)
        store(same, s, BLOCKS + 27, q)
        store(cross_matrix(k, plane_normal(f[1], f[2])), s, BLOCKS + 36, q)
        store(same, s, BLOCKS + 45, q)


@algebra
def _unit_cross_block(k: float, u: Vector, v: Vector) -> Frame:
    """k P_u [n]x P_v, n the normal of the plane of the unit vectors u and v: -k |u x v| (n x u) (n x v)^T."""
    c = cross(u, v)
    n, _ = polar(c)
    m, t = scale(-k, cross(n, u)), cross(c, v)
    return scale(m[0], t), scale(m[1], t), scale(m[2], t)


@algebra
def _add_stiffened(
    s: Field, q: int, weight: float, stiffness: float, offset: float, d: float, density: float, g: Frame, a: Frame
) -> tuple[float, Frame, Frame]:
    """Add phi(e), e = density factor - offset, and its derivative, of those of density (g) and determinant d (a).

    Returns the weight of the second derivative of the density, and two frames v, w: (r, c) of the remaining convex
    Hessian is g_r v_c^T + a_r w_c^T.
    """
    factor, slope, curvature = barrier_factor(d, 0.0)
    curvature = max(curvature, 2.0 * slope * slope / factor)
    e = density * factor - offset
    margin = 1.0 - stiffness * e
    s[DENSITY, q] += weight * e / margin
    s[MARGIN, q] = min(s[MARGIN, q], min(margin, d))
    first = weight / (margin * margin)
    second = 2.0 * stiffness * first / margin
    down = density * slope
    _add_to(plus(times(first * factor, g), times(first * down, a)), s, COLUMN, q)
    # first * (slope (g a^T + a g^T) + density bend a a^T) + second * (factor g + down a) (factor g + down a)^T
    both = first * slope + second * factor * down
    along = plus(times(second * factor * factor, g), times(both, a))
    across = plus(times(both, g), times(first * density * curvature + second * down * down, a))
    return first * factor, along, across


@algebra
def _add_block(s: Field, q: int, row: int, block: Frame, g: Vector, along: Vector, a: Vector, across: Vector) -> None:
    _add_to(plus(block, outer_sum(g, along, a, across)), s, row, q)


@algebra
def add_angles(s: Field, weight: float, stiffness: float, lanes: Lanes) -> None:
    """Add the same of phi(e(u)), u the unit columns."""
    for q in range(len(lanes)):
        f = frame_at(s, FRAME, q)
        u, r = directions(f)
        density, g = frame_gradient(u)
        g, a = of_columns(u, r, g), of_columns(u, r, cofactor(u))
        density += JACOBIAN_WEIGHT
        k, v, w = _add_stiffened(s, q, weight, stiffness, JACOBIAN_WEIGHT, determinant(u), density, g, a)
        k *= 4.0
        own = orthogonal_projection(2.0 * k * r[0] * r[0], u[0])
        _add_block(s, q, BLOCKS, own, g[0], v[0], a[0], w[0])
        turn = _unit_cross_block(k * r[0] * r[1], u[0], u[1])
        _add_block(s, q, BLOCKS + 9, turn, g[0], v[1], a[0], w[1])
        turn = _unit_cross_block(k * r[0] * r[2], u[0], u[2])
        _add_block(s, q, BLOCKS + 18, turn, g[0], v[2], a[0], w[2])
        own = orthogonal_projection(2.0 * k * r[1] * r[1], u[1])
        _add_block(s, q, BLOCKS + 27, own, g[1], v[1], a[1], w[1])
        turn = _unit_cross_block(k * r[1] * r[2], u[1], u[2])
        _add_block(s, q, BLOCKS + 36, turn, g[1], v[2], a[1], w[2])
        own = orthogonal_projection(2.0 * k * r[2] * r[2], u[2])
        _add_block(s, q, BLOCKS + 45, own, g[2], v[2], a[2], w[2])


@algebra
def add_shapes(s: Field, weight: float, stiffness: float, lanes: Lanes) -> None:
    """Add the same of phi(e(f)), f the whole frame: at corners whose three edges belong together."""
    for q in range(len(lanes)):
        f = frame_at(s, FRAME, q)
        density, g = frame_gradient(f)
        a = cofactor(f)
        k, v, w = _add_stiffened(s, q, weight, stiffness, 0.0, determinant(f), density, g, a)
        k *= 4.0
        same = (2.0 * k, 0.0, 0.0), (0.0, 2.0 * k, 0.0), (0.0, 0.0, 2.0 * k)
        _add_block(s, q, BLOCKS, same, g[0], v[0], a[0], w[0])
        _add_block(s, q, BLOCKS + 9, cross_matrix(k, plane_normal(f[0], f[1])), g[0], v[1], a[0], w[1])
        _add_block(s, q, BLOCKS + 18, cross_matrix(k, plane_normal(f[0], f[2])), g[0], v[2], a[0], w[2])
        _add_block(s, q, BLOCKS + 27, same, g[1], v[1], a[1], w[1])
        _add_block(s, q, BLOCKS + 36, cross_matrix(k, plane_normal(f[1], f[2])), g[1], v[2], a[1], w[2])
        _add_block(s, q, BLOCKS + 45, same, g[2], v[2], a[2], w[2])


@algebra
def add_proportions(s: Field, weight: float, slender: float, order: int, lanes: Lanes) -> None:
    """Add the densities of all corners, with derivatives from order 1 on."""
    widest = 0.0
    for q in range(len(lanes)):
        f = frame_at(s, FRAME, q)
        a, b, c = dot(f[0], f[0]), dot(f[1], f[1]), dot(f[2], f[2])
        widest = max(widest, max(a, max(b, c)) / min(a, min(b, c)))
    # Few cells are slender: for the others there is nothing to do.
    if widest > slender * slender:
        limit = np.log(slender)
        for q in range(len(lanes)):
            _add_pair(s, q, weight, limit, order, 0, 1, BLOCKS, BLOCKS + 9, BLOCKS + 27)
            _add_pair(s, q, weight, limit, order, 0, 2, BLOCKS, BLOCKS + 18, BLOCKS + 45)
            _add_pair(s, q, weight, limit, order, 1, 2, BLOCKS + 27, BLOCKS + 36, BLOCKS + 45)


@algebra
def _add_pair(
    s: Field, q: int, weight: float, limit: float, order: int, i: int, j: int, own: int, mixed: int, other: int
) -> None:
    f, g = vector_at(s, FRAME + 3 * i, q), vector_at(s, FRAME + 3 * j, q)
    a, b = dot(f, f), dot(g, g)
    log = 0.5 * np.log(a / b)
    over = abs(log) - limit
    if over > 0.0:
        square = over * over
        s[DENSITY, q] += weight * square * (1.0 + STEEP * square)
        if order > 0:
            slope = weight * over * (2.0 + 4.0 * STEEP * square) * (1.0 if log > 0.0 else -1.0)
            bend = weight * (2.0 + 12.0 * STEEP * square)
            u, v = scale(1.0 / a, f), scale(-1.0 / b, g)
            for k in range(3):
                s[COLUMN + 3 * i + k, q] += slope * u[k]
                s[COLUMN + 3 * j + k, q] += slope * v[k]
            _add_outer(s, own, q, bend, u, u)
            _add_outer(s, mixed, q, bend, u, v)
            _add_outer(s, other, q, bend, v, v)


@algebra
def _add_outer(s: Field, row: int, q: int, weight: float, u: Vector, v: Vector) -> None:
    for r in range(3):
        for c in range(3):
            s[row + 3 * r + c, q] += weight * u[r] * v[c]
