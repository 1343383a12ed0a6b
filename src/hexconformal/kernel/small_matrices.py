"""Algebra of 3 x 3 matrices given by their rows, for compiled loops; a frame is one, its columns being the rows."""

from __future__ import annotations

from typing import Any

from .jit import algebra
from .quaternion import Vector, add, combine, scale

__all__ = [
    "Matrix",
    "cross_matrix",
    "matrix_product",
    "orthogonal_projection",
    "outer_sum",
    "plus",
    "times",
    "transpose",
]

Matrix = tuple[Vector, Vector, Vector]


@algebra
def plus(a: Matrix, b: Matrix) -> Matrix:
    """Sum of two matrices."""
    return add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2])


@algebra
def times(t: Any, a: Matrix) -> Matrix:
    """Number times matrix."""
    return scale(t, a[0]), scale(t, a[1]), scale(t, a[2])


@algebra
def transpose(a: Matrix) -> Matrix:
    """Transpose."""
    return (a[0][0], a[1][0], a[2][0]), (a[0][1], a[1][1], a[2][1]), (a[0][2], a[1][2], a[2][2])


@algebra
def matrix_product(a: Matrix, b: Matrix) -> Matrix:
    """Matrix product.

    >>> matrix_product(((0, 1, 0), (0, 0, 1), (1, 0, 0)), ((1, 2, 3), (4, 5, 6), (7, 8, 9)))
    ((4, 5, 6), (7, 8, 9), (1, 2, 3))
    """
    return (
        add(combine(a[0][0], b[0], a[0][1], b[1]), scale(a[0][2], b[2])),
        add(combine(a[1][0], b[0], a[1][1], b[1]), scale(a[1][2], b[2])),
        add(combine(a[2][0], b[0], a[2][1], b[1]), scale(a[2][2], b[2])),
    )


@algebra
def outer_sum(a: Vector, b: Vector, c: Vector, d: Vector) -> Matrix:
    """Sum of two outer products, a b^T + c d^T."""
    return combine(a[0], b, c[0], d), combine(a[1], b, c[1], d), combine(a[2], b, c[2], d)


@algebra
def cross_matrix(k: Any, n: Vector) -> Matrix:
    """k [n]x: the matrix of the cross product with n, times a number.

    >>> cross_matrix(2, (1, 0, 0))
    ((0.0, 0, 0), (0, 0.0, -2), (0, 2, 0.0))
    """
    n = scale(k, n)
    return (0.0, -n[2], n[1]), (n[2], 0.0, -n[0]), (-n[1], n[0], 0.0)


@algebra
def orthogonal_projection(k: Any, u: Vector) -> Matrix:
    """k (1 - u u^T): the projection orthogonal to a unit vector, times a number.

    >>> orthogonal_projection(2, (1, 0, 0))
    ((0, 0, 0), (0, 2, 0), (0, 0, 2))
    """
    w = scale(-k, u)
    return (
        (k + u[0] * w[0], u[0] * w[1], u[0] * w[2]),
        (u[1] * w[0], k + u[1] * w[1], u[1] * w[2]),
        (u[2] * w[0], u[2] * w[1], k + u[2] * w[2]),
    )
