"""Quaternions and imaginary quaternions (vectors), as tuples of their components.

A component may be a number (inside compiled loops) or an array of any shape (numpy, vectorised), so the
same few lines of algebra serve both. A vector of R^3 is an imaginary quaternion, after Kamberov, Pedit
and Pinkall; its tuple holds the three imaginary components only.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .jit import algebra

__all__ = ["add", "combine", "conjugate", "cross", "dot", "imaginary_product", "norm2", "polar", "product", "scale"]
__all__ += ["subtract", "unit"]

Vector = tuple[Any, Any, Any]
Quaternion = tuple[Any, Any, Any, Any]


@algebra
def add(a: Vector, b: Vector) -> Vector:
    """Sum of two vectors."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@algebra
def subtract(a: Vector, b: Vector) -> Vector:
    """Difference of two vectors."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@algebra
def scale(s: Any, a: Vector) -> Vector:
    """Vector times number."""
    return (s * a[0], s * a[1], s * a[2])


@algebra
def combine(s: Any, a: Vector, t: Any, b: Vector) -> Vector:
    """Linear combination ``s a + t b`` of two vectors."""
    return (s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2])


@algebra
def dot(a: Vector, b: Vector) -> Any:
    """Inner product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@algebra
def cross(a: Vector, b: Vector) -> Vector:
    """Cross product of two vectors: the imaginary part of their quaternion product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@algebra
def polar(a: Vector) -> tuple[Vector, Any]:
    """Direction and reciprocal length of a vector; the third axis and 1 where it vanishes."""
    length = np.sqrt(dot(a, a))
    vanishes = length == 0.0
    inverse = 1.0 / (length + vanishes)
    return (a[0] * inverse, a[1] * inverse, a[2] * inverse + vanishes), inverse


@algebra
def unit(a: Vector) -> Vector:
    """Direction of a vector; the third axis where the vector vanishes, so that it is always a unit."""
    return polar(a)[0]


@algebra
def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Hamilton product of two quaternions (real, i, j, k).

    >>> product((0, 1, 0, 0), (0, 0, 1, 0))  # i j = k
    (0, 0, 0, 1)
    """
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@algebra
def imaginary_product(a: Vector, b: Vector) -> Quaternion:
    """Quaternion product of two vectors, ``a b = -<a, b> + a x b``.

    >>> imaginary_product((1, 0, 0), (1, 0, 0))  # i i = -1
    (-1, 0, 0, 0)
    """
    c = cross(a, b)
    return (-dot(a, b), c[0], c[1], c[2])


@algebra
def conjugate(a: Quaternion) -> Quaternion:
    """Conjugate of a quaternion."""
    return (a[0], -a[1], -a[2], -a[3])


@algebra
def norm2(a: Quaternion) -> Any:
    """Squared norm of a quaternion, ``Re(a conj(a))``."""
    return a[0] * a[0] + a[1] * a[1] + a[2] * a[2] + a[3] * a[3]
