"""Convex blocks of the distortion at quadrature points, and second derivatives of terms that have none of their own."""

import numpy as np
import pytest
from corner_problems import CUBES, convex, jittered_cubes
from differences import observed_order

from hexconformal.energy import CornerTerm, CornerWeights, DistortionTerm, Patch, VolumeTerm
from hexconformal.energy.term import Term
from hexconformal.mesh.topology import node_rings

RULES = pytest.mark.parametrize("quadrature", ["gauss", "corners"])
SOME_TARGETS = pytest.mark.parametrize("shape", [None, (1, 1), (27, 1), (1, 8), (27, 8)])
ENERGIES = pytest.mark.parametrize("eps", [None, 0.0, 0.1], ids=["quaternionic", "barrier", "smoothed barrier"])
STEPS = (2e-4, 1e-4)


def term_of(cells, points, shape, eps, quadrature, scaled=True):
    """A term with random targets and weights of cells."""
    rng = np.random.default_rng(7)
    inverses = None if shape is None else np.linalg.inv(np.eye(3) + 0.1 * rng.normal(size=(*shape, 3, 3)))
    scales = rng.uniform(0.5, 2.0, len(cells)) if scaled else None
    return DistortionTerm(cells, len(points), scales, inverses, eps, quadrature)


@RULES
@SOME_TARGETS
@ENERGIES
def test_blocks_come_with_the_value_and_its_gradient_and_are_semidefinite(eps, shape, quadrature):
    points, cells = jittered_cubes(3, 0.35)
    term = term_of(cells, points, shape, eps, quadrature)
    value, gradient, full = convex(term, points, cells, diagonals=True)
    assert value == pytest.approx(term.value(points), rel=1e-12)
    np.testing.assert_allclose(gradient, term.value_gradient(points)[1], rtol=0, atol=1e-12 * np.abs(gradient).max())
    variation = np.random.default_rng(0).uniform(-1, 1, points.shape)
    slope = np.vdot(gradient, variation)
    assert observed_order(lambda t: term.value(points + t * variation), slope, STEPS) == pytest.approx(2, abs=0.1)
    assert np.abs(full - full.T).max() < 1e-13 * np.abs(full).max()
    values = np.linalg.eigvalsh(full)
    assert values[0] > -1e-12 * values[-1]
    assert values[-1] > 1.0


@RULES
@SOME_TARGETS
def test_blocks_of_the_quaternionic_energy_are_the_frozen_form(shape, quadrature):
    points, cells = jittered_cubes(3, 0.35)
    term = term_of(cells, points, shape, None, quadrature)
    full = convex(term, points, cells, diagonals=True)[2]
    for seed in range(5):
        field = np.random.default_rng(seed).normal(size=points.shape)
        expected = term.frozen_product(points, field)
        product = (full @ field.ravel()).reshape(-1, 3)
        np.testing.assert_allclose(product, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@RULES
@SOME_TARGETS
def test_what_the_frozen_blocks_make_lies_above_the_energy_and_touches_it(shape, quadrature):
    points, cells = jittered_cubes(3, 0.3)
    term = term_of(cells, points, shape, None, quadrature)
    value, gradient, full = convex(term, points, cells, diagonals=True)
    rng = np.random.default_rng(1)
    for size in (1e-3, 0.1, 1.0, 10.0):
        for _ in range(5):
            step = size * rng.normal(size=points.shape)
            above = value + np.vdot(gradient, step) + 0.5 * step.ravel() @ full @ step.ravel()
            energy = term.value(points + step)
            assert above >= energy - 1e-12 * above
    # It is not above by a constant: along a similarity, which turns no normal, both are the same.
    for step in (points, np.ones_like(points)):
        above = value + np.vdot(gradient, step) + 0.5 * step.ravel() @ full @ step.ravel()
        assert above == pytest.approx(term.value(points + step), rel=1e-12)


@pytest.mark.parametrize("shape", [None, (1, 1), (27, 8)])
@pytest.mark.parametrize("eps", [0.0, 0.1])
def test_blocks_at_corners_are_an_eighth_of_those_of_the_corner_term(eps, shape):
    points, cells = jittered_cubes(3, 0.35)
    term = term_of(cells, points, shape, eps, "corners")
    frames = CUBES if term.inverses is None else term.inverses
    other = CornerTerm(cells, frames, CornerWeights(eps=eps), term.scales)
    one, other = convex(term, points, cells), convex(other, points, cells)
    for of_points, of_corners in zip(one, other, strict=True):
        np.testing.assert_allclose(8.0 * of_points, of_corners, rtol=0, atol=1e-12 * np.abs(of_corners).max())


@RULES
def test_the_barrier_is_infinite_where_a_point_of_the_rule_is_folded(quadrature):
    points, cells = jittered_cubes(3, 0.1)
    points[np.flatnonzero((np.abs(points - 1.5) < 0.7).all(axis=1))[0]] += 2.0
    term = term_of(cells, points, None, 0.0, quadrature)
    assert convex(term, points, cells, diagonals=True)[0] == np.inf
    assert term.value(points) > 1e60
    assert np.isfinite(convex(term_of(cells, points, None, 0.5, quadrature), points, cells, diagonals=True)[0])


@RULES
@ENERGIES
def test_a_patch_has_the_distortion_of_its_cells(eps, quadrature):
    points, cells = jittered_cubes(3, 0.3)
    term = term_of(cells, points, (27, 8), eps, quadrature)
    moving = node_rings(cells, len(points), np.arange(len(cells)) == 0, 0)
    patch = Patch.around(moving, cells, points)
    assert 1 < len(patch.cells) < len(cells)
    part, inside = term.restricted(patch), points[patch.nodes]
    value, gradient, full = convex(part, inside, patch.local[cells[patch.cells]], diagonals=True)
    assert value == pytest.approx(term.cell_energies(points)[patch.cells].sum(), rel=1e-12)
    whole = convex(term, points, cells, diagonals=True)
    rows = np.flatnonzero(moving)
    assert np.abs(gradient[patch.local[rows]] - whole[1][rows]).max() < 1e-12 * np.abs(whole[1]).max()
    here, there = (block.reshape(n, 3, n, 3) for block, n in ((full, len(patch.nodes)), (whole[2], len(points))))
    difference = here[patch.local[rows]][:, :, patch.local[rows]] - there[rows][:, :, rows]
    assert np.abs(difference).max() < 1e-12 * np.abs(whole[2]).max()


@RULES
@ENERGIES
def test_second_derivatives_by_differences_are_the_exact_ones(eps, quadrature):
    points, cells = jittered_cubes(3, 0.25)
    term = term_of(cells, points, (27, 1), eps, quadrature)
    for size in (1e-3, 1.0, 1e3):
        variation = size * np.random.default_rng(2).normal(size=points.shape)
        exact = term.second_product(points, variation)
        by_differences = Term.second_product(term, points, variation)
        np.testing.assert_allclose(by_differences, exact, rtol=0, atol=1e-7 * np.abs(exact).max())
    assert not Term.second_product(term, points, np.zeros_like(points)).any()


def test_terms_without_a_second_derivative_take_differences_for_it():
    points, cells = jittered_cubes(3, 0.25)
    for term in (CornerTerm(cells, CUBES, CornerWeights(0.2, 1.0, 0.01)), VolumeTerm(cells, np.full(27, 1.3))):
        one, other = np.random.default_rng(3).normal(size=(2, *points.shape))
        products = [term.second_product(points, field) for field in (one, other)]
        assert np.vdot(one, products[1]) == pytest.approx(np.vdot(other, products[0]), rel=1e-6)
        second = np.vdot(one, products[0])
        step = 1e-3
        ahead, here, behind = (term.value(points + s * step * one) for s in (1, 0, -1))
        assert second == pytest.approx((ahead - 2 * here + behind) / step**2, rel=1e-3)
        np.testing.assert_array_equal(term.frozen_product(points, one), products[0])
