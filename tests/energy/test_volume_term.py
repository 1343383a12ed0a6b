"""What cells pay for losing and gaining volume."""

import numpy as np
import pytest
from corner_problems import CUBES, all_free, dense, jittered_cubes
from hexconformal.energy.corner_energy import CornerEnergy, Weights

from hexconformal import generate
from hexconformal.elements.lengths_volumes import cell_volumes
from hexconformal.mesh.topology import node_rings

SIZES = Weights(0.0, volume=1.0)


def sized(points, cells, sizes):
    return CornerEnergy(cells, CUBES, all_free(points), target_volumes=sizes)


def test_cells_pay_for_volume_as_the_formula_says_and_not_without_a_size():
    points, cells = jittered_cubes()
    volumes = cell_volumes(points, cells)
    wanted = np.random.default_rng(3).uniform(0.2, 3.0, len(cells))
    expected = volumes / wanted + wanted / volumes - 2.0
    assert sized(points, cells, wanted).value(points, SIZES) == pytest.approx(expected.sum(), rel=1e-12)
    assert sized(points, cells, volumes).value(points, SIZES) == pytest.approx(0.0, abs=1e-12)
    wanted[::2] = 0.0
    assert sized(points, cells, wanted).value(points, SIZES) == pytest.approx(expected[1::2].sum(), rel=1e-12)
    assert sized(points, cells, np.empty(0)).value(points, SIZES) == 0.0
    assert sized(points, cells, wanted).value(points, Weights(0.0)) == 0.0


def test_gradient_of_the_sizes_agrees_with_differences_to_second_order():
    points, cells = jittered_cubes()
    problem = sized(points, cells, np.random.default_rng(3).uniform(0.2, 3.0, len(cells)))
    gradient = problem.value_gradient_hessian(points, SIZES)[1]
    direction = np.random.default_rng(0).normal(size=points.shape)
    slope = np.einsum("ij,ij->", gradient, direction)
    errors = []
    for step in (4e-3, 2e-3):
        ahead, behind = (problem.value(points + s * step * direction, SIZES) for s in (1, -1))
        errors.append(abs((ahead - behind) / (2 * step) - slope))
    assert errors[1] < 1e-3 * abs(slope)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_hessian_of_the_sizes_is_semidefinite_and_exact_where_all_cells_shrink():
    points, cells = jittered_cubes(3, 0.35)
    problem = sized(points, cells, np.random.default_rng(3).uniform(0.2, 3.0, len(cells)))
    full = dense(problem.value_gradient_hessian(points, SIZES)[2])
    values = np.linalg.eigvalsh(full)
    assert np.abs(full - full.T).max() < 1e-12 * values[-1]
    assert values[0] > -1e-12 * values[-1]
    # One cube that grows by t in every direction has the volume (1 + t)^3; what is left out is r g^T dg.
    points, cells = generate.box((1, 1, 1))
    for wanted in (0.5, 1.0, 4.0):
        full = dense(sized(points, cells, np.array([wanted])).value_gradient_hessian(points, SIZES)[2])
        ratio = 1.0 / wanted
        kept = 9.0 * max(2.0 / ratio, ratio + 1.0 / ratio)
        grown = (points - 0.5).ravel()
        # Both ends of a diagonal pay the same, so what stands in for their mixed terms vanishes.
        assert grown @ full @ grown == pytest.approx(kept, rel=1e-12)


def test_a_patch_has_the_sizes_of_its_cells():
    points, cells = jittered_cubes(6)
    wanted = np.random.default_rng(3).uniform(0.2, 3.0, len(cells))
    problem = sized(points, cells, wanted)
    core = node_rings(cells, len(points), np.arange(len(cells)) == 100, 0)
    patch, nodes = problem.restricted(core, points)
    around = core[cells].any(axis=1)
    expected = sized(points, cells[around], wanted[around]).value(points, SIZES)
    assert patch.value(points[nodes], SIZES) == pytest.approx(expected, rel=1e-13)
