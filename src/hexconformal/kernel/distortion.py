"""The kernel: quaternionic conformal distortion of a plane, and of the three planes of a frame.

An immersion f with unit normal N is conformal iff *df = N df (Gruber & Aulisa, eq. 1). For tangent
vectors f1, f2 on an orthonormal reference frame the deviation is

    Q1 = *df(d1) - N df(d1) = f2 - N f1,        Q2 = *df(d2) - N df(d2) = -(f1 + N f2)

in full quaternion products, and the density of the conformal distortion is |Q1|^2 + |Q2|^2. For every
unit N it equals 2(|f1|^2 + |f2|^2) - 4 <N, f1 x f2>; with the plane's own normal n it is smallest, so a
frozen N majorizes the true density.

Everything here works on tuples of components (see :mod:`hexconformal.kernel.quaternion`): numbers in compiled
loops, arrays in numpy. Nothing here knows of meshes. The numbers of equations are those of docs/mathematics.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .jit import algebra
from .quaternion import Vector, add, combine, cross, dot, imaginary_product, norm2, polar, scale, subtract, unit

__all__ = [
    "barrier_density",
    "barrier_gradient",
    "barrier_second",
    "determinant",
    "frame_density",
    "frame_frozen_second",
    "frame_gradient",
    "frame_second",
    "plane_density",
    "plane_gradient",
    "plane_normal",
    "plane_second",
]

Frame = tuple[Vector, Vector, Vector]


# ------------------------------------------------------------------------------------------- one plane
@algebra
def plane_normal(f1: Vector, f2: Vector) -> Vector:
    """Unit normal n = f1 x f2 / |f1 x f2| of the plane."""
    return unit(cross(f1, f2))


@algebra
def plane_density(f1: Vector, f2: Vector, n: Vector) -> Any:
    """Conformal distortion |Q1|^2 + |Q2|^2 of a plane with the unit normal n, equation (3) (Gruber & Aulisa, eq. 1).

    >>> plane_density((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 1.0))  # 2 (s1 - s2)^2
    2.0
    """
    n_f1 = imaginary_product(n, f1)
    # Q2 = -N Q1, so both have the same norm. A sum of squares: nothing cancels near zero.
    return 2.0 * norm2((-n_f1[0], f2[0] - n_f1[1], f2[1] - n_f1[2], f2[2] - n_f1[3]))


@algebra
def plane_gradient(f1: Vector, f2: Vector, n: Vector) -> tuple[Vector, Vector]:
    """Derivatives 4(f1 - f2 x n), 4(f2 - n x f1) of the density with respect to f1 and f2, equation (5).

    With n the plane's own normal this is the gradient of the true density. It is linear in (f1, f2): with
    n frozen the same map, applied to a variation, is the majorizing Hessian.
    """
    return scale(4.0, subtract(f1, cross(f2, n))), scale(4.0, subtract(f2, cross(n, f1)))


@algebra
def plane_second(f1: Vector, f2: Vector, d1: Vector, d2: Vector) -> tuple[Vector, Vector]:
    """Exact second derivative of the true density at (f1, f2), applied to the variation (d1, d2)."""
    c = cross(f1, f2)
    n, inverse = polar(c)
    dc = add(cross(d1, f2), cross(f1, d2))
    dn = combine(inverse, dc, -inverse * dot(n, dc), n)
    h1, h2 = plane_gradient(d1, d2, n)
    return combine(1.0, h1, -4.0, cross(f2, dn)), combine(1.0, h2, -4.0, cross(dn, f1))


# ----------------------------------------------------------------------- a frame: the sum of three planes
@algebra
def frame_density(f: Frame) -> Any:
    """Summed conformal distortion of the planes (e1, e2), (e1, e3), (e2, e3) of a frame, equation (6).

    >>> float(frame_density(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 2.0))))
    4.0
    """
    return (
        plane_density(f[0], f[1], plane_normal(f[0], f[1]))
        + plane_density(f[0], f[2], plane_normal(f[0], f[2]))
        + plane_density(f[1], f[2], plane_normal(f[1], f[2]))
    )


@algebra
def frame_gradient(f: Frame) -> tuple[Any, Frame]:
    """:func:`frame_density` and its derivative with respect to the three columns."""
    n12, n13, n23 = plane_normal(f[0], f[1]), plane_normal(f[0], f[2]), plane_normal(f[1], f[2])
    energy = plane_density(f[0], f[1], n12) + plane_density(f[0], f[2], n13) + plane_density(f[1], f[2], n23)
    a0, a1 = plane_gradient(f[0], f[1], n12)
    b0, b2 = plane_gradient(f[0], f[2], n13)
    c1, c2 = plane_gradient(f[1], f[2], n23)
    return energy, (add(a0, b0), add(a1, c1), add(b2, c2))


@algebra
def frame_frozen_second(f: Frame, d: Frame) -> Frame:
    """Majorizing second derivative (normals frozen at f) applied to the variation d."""
    a0, a1 = plane_gradient(d[0], d[1], plane_normal(f[0], f[1]))
    b0, b2 = plane_gradient(d[0], d[2], plane_normal(f[0], f[2]))
    c1, c2 = plane_gradient(d[1], d[2], plane_normal(f[1], f[2]))
    return add(a0, b0), add(a1, c1), add(b2, c2)


@algebra
def frame_second(f: Frame, d: Frame) -> Frame:
    """Exact second derivative of :func:`frame_density` applied to the variation d."""
    a0, a1 = plane_second(f[0], f[1], d[0], d[1])
    b0, b2 = plane_second(f[0], f[2], d[0], d[2])
    c1, c2 = plane_second(f[1], f[2], d[1], d[2])
    return add(a0, b0), add(a1, c1), add(b2, c2)


# ------------------------------------------------- the conformally invariant form, a barrier against folding
@algebra
def determinant(f: Frame) -> Any:
    """Oriented volume <f1 x f2, f3> of a frame."""
    return dot(cross(f[0], f[1]), f[2])


@algebra
def cofactor(f: Frame) -> Frame:
    """Derivative of :func:`determinant` with respect to the three columns."""
    return cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1])


@algebra
def regularized(d: Any, eps: float) -> Any:
    """The positive part chi of a determinant (Garanzha et al. 2021): (d + sqrt(eps^2 + d^2)) / 2."""
    larger = 0.5 * (abs(d) + np.sqrt(eps * eps + d * d))
    positive = d > 0.0
    # chi(d) chi(-d) = eps^2 / 4: no cancellation where d < 0.
    return positive * larger + (1 - positive) * (0.25 * eps * eps / (larger + 1e-300))


@algebra
def inverse_cube_root(x: Any) -> Any:
    """x^(-1/3) of positive normal numbers, to rounding, without branches (np.cbrt does not vectorise)."""
    # A third of the exponent, read off the upper half of the bits: 2^52 + k holds the integer k.
    upper = np.int64(np.float64(x).view(np.int64) >> 32 | 0x4330000000000000).view(np.float64) - 2.0**52
    r = np.int64(np.float64(2.0**52 + 1430185000.0 - upper / 3.0).view(np.int64) << 32).view(np.float64)
    for _ in range(2):
        # x r^3 = 1 - h; the binomial series of (1 - h)^(-1/3) multiplies the correct digits by four.
        h = 1.0 - x * r * r * r
        r = r * (1.0 + h * (1.0 / 3.0 + h * (2.0 / 9.0 + h * (14.0 / 81.0))))
    return r


@algebra
def barrier_factor(d: Any, eps: float) -> tuple[Any, Any, Any]:
    """chi^(-2/3) and its first two derivatives with respect to the determinant."""
    # The tiny numbers keep a folded frame at eps = 0 huge rather than not a number.
    root = np.sqrt(eps * eps + d * d) + 1e-100
    chi = regularized(d, eps) + 1e-150
    r = inverse_cube_root(chi)
    s, inverse = r * r, 1.0 / root
    # chi' = chi / root and chi'' = eps^2 / (2 root^3)
    curvature = 0.5 * eps * eps * (inverse * inverse * inverse)
    return s, -(2.0 / 3.0) * s * inverse, s * ((10.0 / 9.0) * (inverse * inverse) - (2.0 / 3.0) * curvature / chi)


@algebra
def barrier_density(f: Frame, eps: float) -> Any:
    """Conformally invariant density, :func:`frame_density` / chi_eps(det)^(2/3), equation (8).

    With eps = 0 it is infinite for frames that are folded or flat.
    """
    return frame_density(f) * barrier_factor(determinant(f), eps)[0]


@algebra
def barrier_gradient(f: Frame, eps: float) -> tuple[Any, Frame]:
    """:func:`barrier_density` and its derivative with respect to the three columns."""
    energy, g = frame_gradient(f)
    s, ds, _ = barrier_factor(determinant(f), eps)
    a = cofactor(f)
    slope = energy * ds
    return energy * s, (
        combine(s, g[0], slope, a[0]),
        combine(s, g[1], slope, a[1]),
        combine(s, g[2], slope, a[2]),
    )


@algebra
def barrier_second(f: Frame, d: Frame, eps: float) -> Frame:
    """Exact second derivative of :func:`barrier_density` applied to the variation d."""
    energy, g = frame_gradient(f)
    h = frame_second(f, d)
    s, ds, dds = barrier_factor(determinant(f), eps)
    a = cofactor(f)
    da = (
        add(cross(d[1], f[2]), cross(f[1], d[2])),
        add(cross(d[2], f[0]), cross(f[2], d[0])),
        add(cross(d[0], f[1]), cross(f[0], d[1])),
    )
    a_d = dot(a[0], d[0]) + dot(a[1], d[1]) + dot(a[2], d[2])
    g_d = dot(g[0], d[0]) + dot(g[1], d[1]) + dot(g[2], d[2])
    along_g, along_a, along_da = ds * a_d, ds * g_d + energy * dds * a_d, energy * ds
    return (
        add(combine(s, h[0], along_g, g[0]), combine(along_a, a[0], along_da, da[0])),
        add(combine(s, h[1], along_g, g[1]), combine(along_a, a[1], along_da, da[1])),
        add(combine(s, h[2], along_g, g[2]), combine(along_a, a[2], along_da, da[2])),
    )
