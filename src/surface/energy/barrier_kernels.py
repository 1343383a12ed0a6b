"""Compiled loops over the frames of the barrier energy; each range writes only what it owns.

A frame has a distortion e = F(f1, f2; N) / a, the frozen density of the plane kernel over its area, and counts by the
density phi(e) of equation (16) of docs/mathematics.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hexconformal.kernel import (
    Vector,
    add,
    algebra,
    combine,
    cross,
    dot,
    loop,
    plane_density,
    plane_gradient,
    plane_normal,
    scale,
    subtract,
)

__all__ = ["densities", "gradients", "hessians", "regularizations"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_TINY = 1e-300
_NO_DIRECTION = 1e-14  # of the conformal part: an anticonformal one below it is rounding


@algebra
def _frame(points: Floats, nodes: Ints, shapes: Floats, k: int) -> tuple[Vector, Vector]:
    """The derivatives f1 and f2 of the immersion."""
    f1, f2 = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for a in range(nodes.shape[1]):
        x = (points[nodes[k, a], 0], points[nodes[k, a], 1], points[nodes[k, a], 2])
        f1, f2 = combine(1.0, f1, shapes[k, a, 0], x), combine(1.0, f2, shapes[k, a, 1], x)
    return f1, f2


@algebra
def _normal(f1: Vector, f2: Vector, normals: Floats, k: int) -> Vector:
    """The normal it is measured against: its own where none are given."""
    if len(normals) == 0:
        return plane_normal(f1, f2)
    return (normals[k, 0], normals[k, 1], normals[k, 2])


@algebra
def _regularized(area: float, r: float) -> tuple[float, float]:
    """The regularized area (a + sqrt(a^2 + r^2)) / 2 and its derivative."""
    root = np.sqrt(area * area + r * r)
    return 0.5 * (area + root), 0.5 * (1.0 + area / max(root, _TINY))


@algebra
def _phi(e: float, m: float, c: float) -> tuple[float, float, float]:
    """Density of a frame of distortion e, equation (16), with its first and second derivative."""
    root = np.sqrt(1.0 + 2.0 * e / m)
    return 2.0 * e / (1.0 + root) + c * e**3 / 3.0, 1.0 / root + c * e**2, 2.0 * c * e - 1.0 / (m * root**3)


@algebra
def _measured(
    points: Floats, nodes: Ints, shapes: Floats, normals: Floats, regularization: Floats, k: int
) -> tuple[Vector, Vector, Vector, float, float]:
    """Of a frame f1, f2, its normal, and its area with the derivative, regularized."""
    f1, f2 = _frame(points, nodes, shapes, k)
    n = _normal(f1, f2, normals, k)
    area, change = _regularized(dot(n, cross(f1, f2)), regularization[k])
    return f1, f2, n, area, change


@loop
def regularizations(first, last, points, nodes, shapes, normals, factor, smallest, result):  # type: ignore[no-untyped-def]
    """By how much areas (f,) are regularized: where below a share of the size of the frame, by a factor of them."""
    for k in range(first, last):
        f1, f2 = _frame(points, nodes, shapes, k)
        area = dot(_normal(f1, f2, normals, k), cross(f1, f2))
        least = smallest * 0.5 * (dot(f1, f1) + dot(f2, f2))
        result[k] = 0.0 if area > least else np.hypot(factor * area, least)


@loop
def densities(first, last, points, nodes, shapes, weights, normals, regularization, m, c, result):  # type: ignore[no-untyped-def]
    """Weighted densities (f,); infinite where the area is not positive."""
    for k in range(first, last):
        f1, f2, n, area, _ = _measured(points, nodes, shapes, normals, regularization, k)
        result[k] = weights[k] * _phi(plane_density(f1, f2, n) / area, m, c)[0] if area > 0.0 else np.inf


@loop
def gradients(first, last, points, nodes, shapes, weights, normals, regularization, m, c, result):  # type: ignore[no-untyped-def]
    """Derivatives (f, 6) of the weighted densities with respect to f1 and f2."""
    for k in range(first, last):
        f1, f2, n, area, change = _measured(points, nodes, shapes, normals, regularization, k)
        g1, g2 = plane_gradient(f1, f2, n)
        e = plane_density(f1, f2, n) / area
        s = weights[k] * _phi(e, m, c)[1] / area
        g1 = scale(s, combine(1.0, g1, -e * change, cross(f2, n)))
        g2 = scale(s, combine(1.0, g2, -e * change, cross(n, f1)))
        for i in range(3):
            result[k, i], result[k, 3 + i] = g1[i], g2[i]


@algebra
def _store(row: Floats, u: Vector, v: Vector) -> None:
    for i in range(3):
        row[i], row[3 + i] = u[i], v[i]


@algebra
def _add_square(result: Floats, factor: float, row: Floats) -> None:
    """Add the square of a functional of (f1, f2)."""
    for i in range(6):
        for j in range(6):
            result[i, j] += factor * row[i] * row[j]


@algebra
def _unit_or(other: Vector, a: Vector, length: float, least: float) -> Vector:
    """The direction of a vector, or another one where it is too short to have one."""
    return other if length <= least else scale(1.0 / length, a)


@loop
def hessians(  # type: ignore[no-untyped-def]
    first, last, points, nodes, shapes, weights, normals, regularization, m, c, damping, tilt_stiffness, result
):
    """The part of positive curvature (f, 6, 6) of the second derivatives of the weighted densities, in closed form.

    With a = (f1 - N x f2) / 2 and b = (f1 + N x f2) / 2 in the plane of N, the conformal and anticonformal parts, the
    distortion is 8 |b|^2 / (|a|^2 - |b|^2). It depends on the lengths of a and b alone, so its Hessian splits into a
    2 x 2 block (of negative determinant) and two turning directions, of which that of b has positive curvature.
    """
    row = np.empty(6)
    for k in range(first, last):
        f1, f2, n, area, change = _measured(points, nodes, shapes, normals, regularization, k)
        _, slope, bend = _phi(plane_density(f1, f2, n) / area, m, c)
        w = weights[k] * slope
        f1, f2 = combine(1.0, f1, -dot(f1, n), n), combine(1.0, f2, -dot(f2, n), n)
        turned = cross(n, f2)
        a, b = scale(0.5, subtract(f1, turned)), scale(0.5, add(f1, turned))
        alpha, beta = np.sqrt(dot(a, a)) + _TINY, np.sqrt(dot(b, b))
        a = scale(1.0 / alpha, a)
        b = _unit_or(a, b, beta, _NO_DIRECTION * alpha)  # where b vanishes every direction will do
        na, nb = cross(n, a), cross(n, b)
        result[k, :, :] = 0.0
        if regularization[k] > 0.0:
            # Of a regularized frame the frozen density's, and the curvature of 1 / area.
            _store(row, cross(f2, n), cross(n, f1))
            _add_square(result[k], w * 16.0 * beta**2 * change**2 / area**3, row)
            along = w * 4.0 / area
        else:
            # Block 16 / area^3 [[beta^2 p, -2 alpha beta (alpha^2 + beta^2)], [., alpha^2 q]] in (|a|, |b|); directions
            # d|a| = <(a, n x a), df> / 2 and the like: hence the quarters.
            p, q = 3.0 * alpha**2 + beta**2, alpha**2 + 3.0 * beta**2
            x, y, z = beta**2 * p, -2.0 * alpha * beta * (alpha**2 + beta**2), alpha**2 * q
            largest = 0.5 * (x + z + np.hypot(x - z, 2.0 * y))
            size = max(np.hypot(y, largest - x), _TINY)
            u, v = y / size, (largest - x) / size
            _store(row, combine(u, a, v, b), combine(u, na, -v, nb))
            _add_square(result[k], w * 4.0 * largest / area**3, row)
            _store(row, nb, b)
            _add_square(result[k], w * 4.0 * alpha**2 / area**2, row)
            # What bends upwards adds the square of the gradient 16 alpha beta / area^2 (alpha d beta - beta d alpha).
            _store(row, combine(alpha, b, -beta, a), combine(-alpha, nb, -beta, na))
            _add_square(result[k], weights[k] * max(bend, 0.0) * (8.0 * alpha * beta / area**2) ** 2, row)
            along = 0.0
        along += damping[k] * 4.0 * w / area
        # Out of the plane a frozen normal gives 4 / area, but it turns with a cell that travels round a bend.
        upright = w * tilt_stiffness * 4.0 / area
        for i in range(3):
            for j in range(3):
                result[k, i, j] += upright * n[i] * n[j]
                result[k, 3 + i, 3 + j] += upright * n[i] * n[j]
        for i in range(6):
            result[k, i, i] += along
