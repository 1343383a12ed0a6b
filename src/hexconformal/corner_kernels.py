"""Compiled loops of the corner energy: values, gradients and convex Hessian blocks, cell by cell.

Every corner of a cell sees a frame f = [f1 f2 f3] J W^-1. With q the quaternionic distortion of the frame
(:mod:`hexconformal.distortion`), d its determinant and s = chi_eps(d)^(-2/3), its density is e = q s. The
exact Hessian of e is indefinite; freezing the normals turns q into a convex quadratic that majorizes it, and
q s(d) is jointly convex in (f, d) once s s'' >= 2 s'^2. Both together give a positive semidefinite block in
closed form, without eigenvalues:

    s K + s' (G a^T + a G^T) + q s'' a a^T,     K the frozen Hessian, G = dq/df, a = dd/df,

equation (11) of docs/mathematics.md.

The angles alone are measured on the unit columns u of f. Their determinant is the scaled Jacobian, and what counts
in the end, so e(u) = (q + c) s - c has a constant c: without it, corners with one bad angle get worse while others,
with three that are not as bad, get better.

One scratch array holds the corners of a cell: a column per corner, a row per component, so that loops over its
columns work on several corners at once (see :mod:`hexconformal.kernels`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .compiled import algebra, loop
from .distortion import Frame, barrier_factor, cofactor, determinant, frame_density, frame_gradient, plane_normal
from .quaternion import Vector, combine, cross, dot, polar, scale
from .small_matrices import cross_matrix, orthogonal, outer, plus, product, times, transposed

__all__ = ["corner_densities", "corner_sums"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_HUGE = 1e290  # a density beyond this is a folded corner
_JACOBIAN = 8.0  # weight of the scaled Jacobian beside the distortion of the unit columns

# First rows of what the scratch array holds. Blocks: the pairs of columns 11, 12, 13, 22, 23, 33, nine rows each;
# then those of each neighbour with the corner itself, and of the corner with itself.
_FRAME, _COLUMN, _BLOCKS, _MIXED, _OWN, _INVERSE, _SIGN, _DENSITY, _MARGIN, _ROWS = (
    0, 9, 18, 72, 99, 108, 117, 120, 121, 122,
)  # fmt: skip


@algebra
def _vector(s: Field, row: int, q: int) -> Vector:
    return s[row, q], s[row + 1, q], s[row + 2, q]


@algebra
def _frame(s: Field, row: int, q: int) -> Frame:
    return _vector(s, row, q), _vector(s, row + 3, q), _vector(s, row + 6, q)


@algebra
def _put(f: Frame, s: Field, row: int, q: int) -> None:
    s[row, q], s[row + 1, q], s[row + 2, q] = f[0]
    s[row + 3, q], s[row + 4, q], s[row + 5, q] = f[1]
    s[row + 6, q], s[row + 7, q], s[row + 8, q] = f[2]


@algebra
def _add(f: Frame, s: Field, row: int, q: int) -> None:
    _put(plus(_frame(s, row, q), f), s, row, q)


@algebra
def _load(points: Field, cells: Ints, c: int, corners: Ints, inverses: Field, s: Field) -> None:
    """The frames at the corners of a cell, W^-1 there, and the signs that turn edges into derivatives."""
    for q in range(8):
        here = cells[c, q]
        for i in range(3):
            there, sign = cells[c, corners[q, i]], corners[q, 3 + i]
            s[_SIGN + i, q] = sign
            for k in range(3):
                s[_FRAME + 3 * i + k, q] = sign * (points[there, k] - points[here, k])
    if len(inverses) > 0:
        target = c if len(inverses) > 1 else 0
        step = 1 if inverses.shape[1] > 1 else 0
        for q in range(8):
            for i in range(3):
                for j in range(3):
                    s[_INVERSE + 3 * i + j, q] = inverses[target, q * step, i, j]
        for q in range(8):
            _put(product(transposed(_frame(s, _INVERSE, q)), _frame(s, _FRAME, q)), s, _FRAME, q)


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
def _values(s: Field, eps: float, shape: float, angle: float, stiffness: float) -> None:
    """Density of each corner, and what has to be positive there."""
    for q in range(8):
        f = _frame(s, _FRAME, q)
        d = determinant(f)
        s[_DENSITY, q] = shape * frame_density(f) * barrier_factor(d, eps)[0]
        s[_MARGIN, q] = d if eps == 0.0 else 1.0
    if angle > 0.0:
        for q in range(8):
            u, _ = _directions(_frame(s, _FRAME, q))
            d = determinant(u)
            density = (frame_density(u) + _JACOBIAN) * barrier_factor(d, 0.0)[0] - _JACOBIAN
            room = 1.0 - stiffness * density
            s[_DENSITY, q] += angle * density / room
            s[_MARGIN, q] = min(s[_MARGIN, q], min(room, d))


@algebra
def _shape_part(s: Field, eps: float, weight: float) -> None:
    """Density of each corner, its derivative, and the convex Hessian, of the whole distortion."""
    for q in range(8):
        f = _frame(s, _FRAME, q)
        d = determinant(f)
        density, g = frame_gradient(f)
        a = cofactor(f)
        factor, slope, bend = barrier_factor(d, eps)
        bend = max(bend, 2.0 * slope * slope / factor)
        s[_DENSITY, q] = weight * density * factor
        s[_MARGIN, q] = d if eps == 0.0 else 1.0
        _put(plus(times(weight * factor, g), times(weight * density * slope, a)), s, _COLUMN, q)
        along = times(weight * slope, a)
        across = plus(times(weight * slope, g), times(weight * density * bend, a))
        k = 4.0 * weight * factor
        same = (2.0 * k, 0.0, 0.0), (0.0, 2.0 * k, 0.0), (0.0, 0.0, 2.0 * k)
        _put(plus(same, outer(g[0], along[0], a[0], across[0])), s, _BLOCKS, q)
        turn = cross_matrix(k, plane_normal(f[0], f[1]))
        _put(plus(turn, outer(g[0], along[1], a[0], across[1])), s, _BLOCKS + 9, q)
        turn = cross_matrix(k, plane_normal(f[0], f[2]))
        _put(plus(turn, outer(g[0], along[2], a[0], across[2])), s, _BLOCKS + 18, q)
        _put(plus(same, outer(g[1], along[1], a[1], across[1])), s, _BLOCKS + 27, q)
        turn = cross_matrix(k, plane_normal(f[1], f[2]))
        _put(plus(turn, outer(g[1], along[2], a[1], across[2])), s, _BLOCKS + 36, q)
        _put(plus(same, outer(g[2], along[2], a[2], across[2])), s, _BLOCKS + 45, q)


@algebra
def _unit_turn(k: float, u: Vector, v: Vector) -> Frame:
    """k P_u [n]x P_v, n the normal of the plane of the unit vectors u and v: -k |u x v| (n x u) (n x v)^T."""
    c = cross(u, v)
    n, _ = polar(c)
    m, t = scale(-k, cross(n, u)), cross(c, v)
    return scale(m[0], t), scale(m[1], t), scale(m[2], t)


@algebra
def _angle_part(s: Field, weight: float, stiffness: float) -> None:
    """Adds the same of phi(e(u)), u the unit columns."""
    for q in range(8):
        f = _frame(s, _FRAME, q)
        u, r = _directions(f)
        d = determinant(u)
        density, g = frame_gradient(u)
        density += _JACOBIAN
        factor, slope, bend = barrier_factor(d, 0.0)
        bend = max(bend, 2.0 * slope * slope / factor)
        g, a = _chain(u, r, g), _chain(u, r, cofactor(u))
        e = density * factor - _JACOBIAN
        room = 1.0 - stiffness * e
        s[_DENSITY, q] += weight * e / room
        s[_MARGIN, q] = min(s[_MARGIN, q], min(room, d))
        first = weight / (room * room)
        second = 2.0 * stiffness * first / room
        down = density * slope
        _add(plus(times(first * factor, g), times(first * down, a)), s, _COLUMN, q)
        # first * (slope (g a^T + a g^T) + density bend a a^T) + second * (factor g + down a) (factor g + down a)^T
        both = first * slope + second * factor * down
        along = plus(times(second * factor * factor, g), times(both, a))
        across = plus(times(both, g), times(first * density * bend + second * down * down, a))
        k = 4.0 * first * factor
        _add(plus(orthogonal(2.0 * k * r[0] * r[0], u[0]), outer(g[0], along[0], a[0], across[0])), s, _BLOCKS, q)
        turn = _unit_turn(k * r[0] * r[1], u[0], u[1])
        _add(plus(turn, outer(g[0], along[1], a[0], across[1])), s, _BLOCKS + 9, q)
        turn = _unit_turn(k * r[0] * r[2], u[0], u[2])
        _add(plus(turn, outer(g[0], along[2], a[0], across[2])), s, _BLOCKS + 18, q)
        _add(plus(orthogonal(2.0 * k * r[1] * r[1], u[1]), outer(g[1], along[1], a[1], across[1])), s, _BLOCKS + 27, q)
        turn = _unit_turn(k * r[1] * r[2], u[1], u[2])
        _add(plus(turn, outer(g[1], along[2], a[1], across[2])), s, _BLOCKS + 36, q)
        _add(plus(orthogonal(2.0 * k * r[2] * r[2], u[2]), outer(g[2], along[2], a[2], across[2])), s, _BLOCKS + 45, q)


@algebra
def _pull_back(s: Field) -> None:
    """Derivatives with respect to J W^-1 become derivatives with respect to J."""
    for q in range(8):
        _put(product(_frame(s, _INVERSE, q), _frame(s, _COLUMN, q)), s, _COLUMN, q)
    for k in range(3):
        for l in range(k + 1):
            one, two = _BLOCKS + 3 * k + l, _BLOCKS + 3 * l + k
            for q in range(8):
                # Entries (k, l) of all nine blocks, as a matrix over the pairs of columns.
                m = (
                    (s[one, q], s[one + 9, q], s[one + 18, q]),
                    (s[two + 9, q], s[one + 27, q], s[one + 36, q]),
                    (s[two + 18, q], s[two + 36, q], s[one + 45, q]),
                )
                w = _frame(s, _INVERSE, q)
                m = product(product(w, m), transposed(w))
                s[one, q], s[one + 9, q], s[one + 18, q] = m[0]
                s[two + 9, q], s[one + 27, q], s[one + 36, q] = m[1]
                s[two + 18, q], s[two + 36, q], s[one + 45, q] = m[2]
                s[two, q], s[two + 27, q], s[two + 45, q] = m[0][0], m[1][1], m[2][2]


@algebra
def _to_nodes(s: Field) -> None:
    """Derivatives with respect to edges, then to the nodes: moving the corner itself moves all three edges back."""
    for q in range(8):
        x, y, z = s[_SIGN, q], s[_SIGN + 1, q], s[_SIGN + 2, q]
        f = _frame(s, _COLUMN, q)
        _put((scale(x, f[0]), scale(y, f[1]), scale(z, f[2])), s, _COLUMN, q)
        b00, b11, b22 = _frame(s, _BLOCKS, q), _frame(s, _BLOCKS + 27, q), _frame(s, _BLOCKS + 45, q)
        b01 = times(x * y, _frame(s, _BLOCKS + 9, q))
        b02 = times(x * z, _frame(s, _BLOCKS + 18, q))
        b12 = times(y * z, _frame(s, _BLOCKS + 36, q))
        _put(b01, s, _BLOCKS + 9, q)
        _put(b02, s, _BLOCKS + 18, q)
        _put(b12, s, _BLOCKS + 36, q)
        m0 = plus(b00, plus(b01, b02))
        m1 = plus(transposed(b01), plus(b11, b12))
        m2 = plus(transposed(b02), plus(transposed(b12), b22))
        _put(times(-1.0, m0), s, _MIXED, q)
        _put(times(-1.0, m1), s, _MIXED + 9, q)
        _put(times(-1.0, m2), s, _MIXED + 18, q)
        _put(plus(m0, plus(m1, m2)), s, _OWN, q)


@algebra
def _add_block(s: Field, row: int, q: int, a: int, b: int, local: Field) -> None:
    """Add block (a, b) of the cell's nodes to local (36, 3, 3), which holds the pairs a >= b."""
    if a >= b:
        pair = a * (a + 1) // 2 + b
        for r in range(3):
            for c in range(3):
                local[pair, r, c] += s[row + 3 * r + c, q]
    else:
        pair = b * (b + 1) // 2 + a
        for r in range(3):
            for c in range(3):
                local[pair, c, r] += s[row + 3 * r + c, q]


@algebra
def _gather(s: Field, corners: Ints, local: Field) -> None:
    """Blocks of the cell's nodes from those of its corners."""
    local[:] = 0.0
    for q in range(8):
        x, y, z = corners[q, 0], corners[q, 1], corners[q, 2]
        _add_block(s, _BLOCKS, q, x, x, local)
        _add_block(s, _BLOCKS + 9, q, x, y, local)
        _add_block(s, _BLOCKS + 18, q, x, z, local)
        _add_block(s, _BLOCKS + 27, q, y, y, local)
        _add_block(s, _BLOCKS + 36, q, y, z, local)
        _add_block(s, _BLOCKS + 45, q, z, z, local)
        _add_block(s, _MIXED, q, x, q, local)
        _add_block(s, _MIXED + 9, q, y, q, local)
        _add_block(s, _MIXED + 18, q, z, q, local)
        _add_block(s, _OWN, q, q, q, local)


@loop
def corner_sums(  # type: ignore[no-untyped-def]
    points, cells, corners, inverses, eps, shape, angle, stiffness, derivatives, forces, data, places
):
    """Sum of shape * e(f) + angle * phi(e(u)) over all corners, u the unit columns of f.

    phi(e) = e / (1 - stiffness e) rises without bound as the worst corner nears 1 / stiffness. Infinite where a
    corner is folded (eps = 0) or beyond that bound. With derivatives, adds the first to forces (n, 3) and the
    convex Hessian to the 3 x 3 blocks data at places (m, 36) (see :func:`hexconformal.block_matrix.cell_places`).
    """
    s, local = np.empty((_ROWS, 8)), np.empty((36, 3, 3))
    total = 0.0
    for c in range(len(cells)):
        _load(points, cells, c, corners, inverses, s)
        if derivatives:
            _shape_part(s, eps, shape)
            if angle > 0.0:
                _angle_part(s, angle, stiffness)
        else:
            _values(s, eps, shape, angle, stiffness)
        for q in range(8):
            if not (s[_MARGIN, q] > 0.0 and s[_DENSITY, q] < _HUGE):
                return np.inf
            total += s[_DENSITY, q]
        if not derivatives:
            continue
        if len(inverses) > 0:
            _pull_back(s)
        _to_nodes(s)
        for q in range(8):
            for i in range(3):
                for k in range(3):
                    force = s[_COLUMN + 3 * i + k, q]
                    forces[cells[c, corners[q, i]], k] += force
                    forces[cells[c, q], k] -= force
        _gather(s, corners, local)
        for a in range(8):
            for b in range(a + 1):
                pair = a * (a + 1) // 2 + b
                place = places[c, pair]
                if place < 0:
                    continue
                if cells[c, a] >= cells[c, b]:
                    for r in range(3):
                        for k in range(3):
                            data[place, r, k] += local[pair, r, k]
                else:
                    for r in range(3):
                        for k in range(3):
                            data[place, r, k] += local[pair, k, r]
    return total


@loop
def corner_densities(first, last, points, cells, corners, inverses, smallest, shape, angle):  # type: ignore[no-untyped-def]
    """Per cell: smallest corner determinant of J W^-1, largest density e(f), largest e(u); inf where folded."""
    s = np.empty((_ROWS, 8))
    for c in range(first, last):
        _load(points, cells, c, corners, inverses, s)
        for q in range(8):
            f = _frame(s, _FRAME, q)
            u, _ = _directions(f)
            s[_MARGIN, q] = determinant(f)
            s[_DENSITY, q] = frame_density(f) * barrier_factor(determinant(f), 0.0)[0]
            s[_COLUMN, q] = (frame_density(u) + _JACOBIAN) * barrier_factor(determinant(u), 0.0)[0] - _JACOBIAN
        smallest[c], shape[c], angle[c] = np.inf, 0.0, 0.0
        for q in range(8):
            smallest[c] = min(smallest[c], s[_MARGIN, q])
            shape[c] = max(shape[c], s[_DENSITY, q])
            angle[c] = max(angle[c], s[_COLUMN, q])
        if not smallest[c] > 0.0:
            shape[c] = angle[c] = np.inf
