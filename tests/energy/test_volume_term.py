"""What cells pay for losing and gaining volume."""

import numpy as np
import pytest
from corner_problems import CUBES, convex, formulation_of, jittered_cubes

from hexconformal import generate
from hexconformal.elements.lengths_volumes import cell_volumes
from hexconformal.energy import CornerTerm, CornerWeights, Patch, VolumeTerm
from hexconformal.mesh.topology import node_rings


def test_cells_pay_for_volume_as_the_formula_says_and_not_without_a_size():
    points, cells = jittered_cubes()
    volumes = cell_volumes(points, cells)
    wanted = np.random.default_rng(3).uniform(0.2, 3.0, len(cells))
    expected = volumes / wanted + wanted / volumes - 2.0
    assert VolumeTerm(cells, wanted).value(points) == pytest.approx(expected.sum(), rel=1e-12)
    assert VolumeTerm(cells, wanted, 2.5).value(points) == pytest.approx(2.5 * expected.sum(), rel=1e-12)
    assert VolumeTerm(cells, volumes).value(points) == pytest.approx(0.0, abs=1e-12)
    wanted = np.where(np.arange(len(cells)) % 2, wanted, 0.0)
    assert VolumeTerm(cells, wanted).value(points) == pytest.approx(expected[1::2].sum(), rel=1e-12)
    without = CornerTerm(cells, CUBES).value(points)
    for targets, weight, factor, more in (
        (np.empty(0), 1.0, 1.0, 0.0),
        (wanted, 0.0, 1.0, 0.0),
        (wanted, 2.0, 3.0, 6.0 * expected[1::2].sum()),
    ):
        formulation = formulation_of(points, cells, target_volumes=targets, volume_factor=factor)
        value = formulation.objective(CornerWeights(), weight).value(points)
        assert value == pytest.approx(without + more, rel=1e-12)


def test_gradient_of_the_sizes_agrees_with_differences_to_second_order():
    points, cells = jittered_cubes()
    term = VolumeTerm(cells, np.random.default_rng(3).uniform(0.2, 3.0, len(cells)), 1.5)
    value, gradient, _ = convex(term, points, cells)
    assert value == pytest.approx(term.value(points), rel=1e-14)
    np.testing.assert_array_equal(gradient, term.value_gradient(points)[1])
    direction = np.random.default_rng(0).normal(size=points.shape)
    slope = np.einsum("ij,ij->", gradient, direction)
    errors = []
    for step in (4e-3, 2e-3):
        ahead, behind = (term.value(points + s * step * direction) for s in (1, -1))
        errors.append(abs((ahead - behind) / (2 * step) - slope))
    assert errors[1] < 1e-3 * abs(slope)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_hessian_of_the_sizes_is_semidefinite_and_exact_where_all_cells_shrink():
    points, cells = jittered_cubes(3, 0.35)
    full = convex(VolumeTerm(cells, np.random.default_rng(3).uniform(0.2, 3.0, len(cells))), points, cells)[2]
    values = np.linalg.eigvalsh(full)
    assert np.abs(full - full.T).max() < 1e-12 * values[-1]
    assert values[0] > -1e-12 * values[-1]
    # One cube that grows by t in every direction has the volume (1 + t)^3; what is left out is r g^T dg.
    points, cells = generate.box((1, 1, 1))
    for wanted in (0.5, 1.0, 4.0):
        full = convex(VolumeTerm(cells, np.array([wanted])), points, cells)[2]
        ratio = 1.0 / wanted
        kept = 9.0 * max(2.0 / ratio, ratio + 1.0 / ratio)
        grown = (points - 0.5).ravel()
        # Both ends of a diagonal pay the same, so what stands in for their mixed terms vanishes.
        assert grown @ full @ grown == pytest.approx(kept, rel=1e-12)


def test_a_patch_has_the_sizes_of_its_cells():
    points, cells = jittered_cubes(6)
    wanted = np.random.default_rng(3).uniform(0.2, 3.0, len(cells))
    core = node_rings(cells, len(points), np.arange(len(cells)) == 100, 0)
    patch = Patch.around(core, cells, points)
    expected = VolumeTerm(cells[core[cells].any(axis=1)], wanted[core[cells].any(axis=1)]).value(points)
    assert VolumeTerm(cells, wanted).restricted(patch).value(points[patch.nodes]) == pytest.approx(expected, rel=1e-13)
