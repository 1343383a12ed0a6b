"""The kernel against its closed forms, the published identities, and differences."""

from decimal import Decimal, getcontext
from functools import partial

import numpy as np
import pytest
from differences import observed_order

from hexconformal.kernel.distortion import (
    barrier_density,
    barrier_factor,
    barrier_gradient,
    barrier_second,
    determinant,
    frame_density,
    frame_frozen_second,
    frame_gradient,
    frame_second,
    inverse_cube_root,
    plane_density,
    plane_gradient,
    plane_normal,
    plane_second,
    regularised,
)
from hexconformal.kernel.quaternion import conjugate, imaginary_product, norm2, product

STEPS = (1e-2, 5e-3)


def vectors(rng, count, size=20_000):
    return [tuple(rng.normal(size=(3, size))) for _ in range(count)]


def directions(rng, size=20_000):
    n = rng.normal(size=(3, size))
    return tuple(n / np.linalg.norm(n, axis=0))


def deviations(f1, f2, n):
    """Q1 = f2 - N f1 and Q2 = -(f1 + N f2), written out with quaternion products."""
    n_f1, n_f2 = imaginary_product(n, f1), imaginary_product(n, f2)
    q1 = (-n_f1[0], *(f2[k] - n_f1[k + 1] for k in range(3)))
    q2 = (-n_f2[0], *(-f1[k] - n_f2[k + 1] for k in range(3)))
    return q1, q2


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def test_quaternion_form_and_closed_form(rng):
    f1, f2 = vectors(rng, 2)
    n = directions(rng)
    q1, q2 = deviations(f1, f2, n)
    size = dot(f1, f1) + dot(f2, f2)
    closed = 2 * size - 4 * dot(n, np.cross(f1, f2, axis=0))
    np.testing.assert_allclose(plane_density(f1, f2, n) / size, (norm2(q1) + norm2(q2)) / size, atol=1e-13)
    np.testing.assert_allclose(plane_density(f1, f2, n) / size, closed / size, rtol=0, atol=1e-13)


def test_second_deviation_is_the_first_turned(rng):
    f1, f2 = vectors(rng, 2)
    n = directions(rng)
    q1, q2 = deviations(f1, f2, n)
    turned = product((np.zeros_like(n[0]), *n), q1)
    np.testing.assert_allclose(np.array(q2), -np.array(turned), atol=1e-13)


def test_true_density_is_the_gap_of_singular_values(rng):
    f1, f2 = vectors(rng, 2)
    s = np.linalg.svd(np.stack([np.stack(f1), np.stack(f2)], axis=-1).transpose(1, 0, 2), compute_uv=False)
    np.testing.assert_allclose(plane_density(f1, f2, plane_normal(f1, f2)), 2 * (s[:, 0] - s[:, 1]) ** 2, atol=1e-12)


def test_frozen_normal_majorizes(rng):
    f1, f2 = vectors(rng, 2)
    n = plane_normal(f1, f2)
    true, frozen = plane_density(f1, f2, n), plane_density(f1, f2, directions(rng))
    assert np.all(frozen >= true * (1 - 1e-13))
    q1, q2 = deviations(f1, f2, n)
    np.testing.assert_allclose(true, norm2(q1) + norm2(q2), rtol=1e-12)


def test_cross_product_instead_of_quaternion_product_does_not_majorize():
    f1, f2 = np.array([1.0, 0.0, 0.0]), np.array([0.0, 4.0, 0.0])
    tilt = np.deg2rad(20.0)
    # Tilted about the short side, the normal is no longer orthogonal to the long one.
    n = np.array([0.0, np.sin(tilt), np.cos(tilt)])
    true = plane_density(tuple(f1), tuple(f2), plane_normal(tuple(f1), tuple(f2)))
    without_real_part = sum(np.sum(q**2) for q in (f2 - np.cross(n, f1), f1 + np.cross(n, f2)))
    assert round(true, 2) == 18.00
    assert round(plane_density(tuple(f1), tuple(f2), tuple(n)), 2) == 18.96
    assert round(without_real_part, 2) == 17.09
    assert without_real_part < true


def test_metric_weighting(rng):
    f1, f2 = vectors(rng, 2)
    n = directions(rng)
    q1, q2 = deviations(f1, f2, n)
    a = rng.normal(size=(2, 2, 20_000))
    g = np.einsum("ikp,jkp->pij", a, a) + 0.1 * np.eye(2)
    inverse = np.linalg.inv(g)
    weighted = (
        inverse[:, 0, 0] * norm2(q1)
        + inverse[:, 1, 1] * norm2(q2)
        + 2 * inverse[:, 0, 1] * sum(x * y for x, y in zip(q1, q2, strict=True))
    )
    expected = np.trace(inverse, axis1=1, axis2=2) / 2 * plane_density(f1, f2, n)
    np.testing.assert_allclose(weighted, expected, rtol=1e-10)


def test_zero_exactly_on_scaled_rotations_and_reflections(rng):
    for _ in range(50):
        q = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.1, 10)
        for f in (q, -q):
            frame = tuple(tuple(f[:, k]) for k in range(3))
            scale = np.sum(f**2)
            # A sum of squares of round-off: far below what a difference of equal numbers could reach.
            assert frame_density(frame) < 1e-29 * scale
            assert np.abs(np.array(frame_gradient(frame)[1])).max() < 1e-14 * np.sqrt(scale)


def test_frame_closed_form(rng):
    f = tuple(vectors(rng, 3))
    areas = sum(np.linalg.norm(np.cross(a, b, axis=0), axis=0) for a, b in ((f[0], f[1]), (f[0], f[2]), (f[1], f[2])))
    size = sum(dot(a, a) for a in f)
    np.testing.assert_allclose(frame_density(f) / size, 4 * (size - areas) / size, atol=1e-13)


@pytest.mark.parametrize("eps", [None, 0.0, 0.3])
def test_derivatives_of_a_frame(rng, eps):
    f = np.eye(3)[:, :, None] + 0.3 * rng.normal(size=(3, 3, 200))
    f = f[:, :, determinant(tuple(map(tuple, f))) > 0.2]
    f, d = f[:, :, :20], 0.2 * rng.normal(size=(3, 3, 20))
    if eps is None:
        density, gradient, second = frame_density, frame_gradient, frame_second
    else:
        density, gradient, second = (
            partial(part, eps=eps) for part in (barrier_density, barrier_gradient, barrier_second)
        )

    def at(t):
        return tuple(map(tuple, f + t * d))

    energy, g = gradient(at(0.0))
    np.testing.assert_allclose(energy, density(at(0.0)), rtol=1e-13)
    slope = np.sum(np.array(g) * d, axis=(0, 1))
    assert observed_order(lambda t: density(at(t)), slope, STEPS) == pytest.approx(2.0, abs=0.1)
    h = np.array(second(at(0.0), tuple(map(tuple, d))))
    assert observed_order(lambda t: np.array(gradient(at(t))[1]), h, STEPS) == pytest.approx(2.0, abs=0.1)


def test_second_derivative_of_a_plane(rng):
    f1, f2, d1, d2 = (np.array(v) for v in vectors(rng, 4, 20))
    f1[0] += 3.0
    f2[1] += 3.0

    def gradient(t):
        a, b = tuple(f1 + t * d1), tuple(f2 + t * d2)
        return np.array(plane_gradient(a, b, plane_normal(a, b)))

    h = np.array(plane_second(tuple(f1), tuple(f2), tuple(d1), tuple(d2)))
    assert observed_order(gradient, h, STEPS) == pytest.approx(2.0, abs=0.1)


def test_frozen_second_is_symmetric_positive_and_above_the_exact_one(rng):
    f, d, e = (tuple(vectors(rng, 3, 5000)) for _ in range(3))

    def inner(a, b):
        return np.sum(np.array(a) * np.array(b), axis=(0, 1))

    np.testing.assert_allclose(inner(e, frame_frozen_second(f, d)), inner(d, frame_frozen_second(f, e)), atol=1e-11)
    frozen, exact = inner(d, frame_frozen_second(f, d)), inner(d, frame_second(f, d))
    assert np.all(frozen > -1e-12)
    assert np.all(frozen >= exact - 1e-10 * np.abs(exact))
    # The quadratic form is homogeneous: along the frame itself it returns the gradient.
    np.testing.assert_allclose(np.array(frame_frozen_second(f, f)), np.array(frame_gradient(f)[1]), atol=1e-12)


def test_flat_and_vanishing_frames_stay_finite():
    flat = ((1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    nothing = ((0.0, 0.0, 0.0),) * 3
    folded = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0))
    for f in (flat, nothing, folded):
        energy, g = frame_gradient(f)
        assert np.isfinite(energy)
        assert np.isfinite(np.array(g)).all()
        assert np.isfinite(np.array(frame_second(f, folded))).all()
        assert np.isfinite(np.array(barrier_gradient(f, 1e-3)[1])).all()
        assert np.isfinite(barrier_factor(determinant(f), 0.0)).all()
    assert plane_density(flat[0], flat[1], plane_normal(flat[0], flat[1])) == pytest.approx(10.0)
    assert barrier_density(((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, -1.0)), 0.0) > 1e90


def test_barrier_does_not_see_the_scale(rng):
    f = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
    values = [barrier_density(tuple(map(tuple, s * f)), 0.0) for s in (1e-6, 1.0, 1e6)]
    np.testing.assert_allclose(values, values[1], rtol=1e-13)


def test_inverse_cube_root_to_rounding(rng):
    x = np.concatenate([np.linspace(1.0, 8.0, 100_001), 10.0 ** rng.uniform(-150, 300, 100_000)])
    np.testing.assert_allclose(inverse_cube_root(x) * np.cbrt(x), 1.0, rtol=0, atol=1e-15)
    assert inverse_cube_root(8.0) == pytest.approx(0.5, rel=1e-15)


def test_a_quaternion_times_its_conjugate_is_its_squared_norm():
    q = (1.0, -2.0, 3.0, 0.5)
    assert product(q, conjugate(q)) == (norm2(q), 0.0, 0.0, 0.0)
    assert norm2(q) == 1.0 + 4.0 + 9.0 + 0.25


@pytest.mark.parametrize("eps", [1e-8, 0.1, 3.0])
def test_the_positive_part_of_a_determinant_is_what_its_formula_says(eps):
    d = np.array([-7.0, -1.0, -1e-3, 0.0, 1e-3, 1.0, 7.0])
    getcontext().prec = 60
    exact = [float((Decimal(x) + (Decimal(eps) ** 2 + Decimal(x) ** 2).sqrt()) / 2) for x in d.tolist()]
    np.testing.assert_allclose(regularised(d, eps), exact, rtol=1e-12)
