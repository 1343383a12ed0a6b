"""Cells with next to no volume: flattened corners and layers without thickness."""

import numpy as np
import pytest
from meshes.flat import flattened, padded

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements import corner_scaled_jacobian, is_valid
from hexconformal.regularization import Regularization
from hexconformal.untangling import thicken


def ball():
    return generate.jittered(*generate.ball(5, 3), 0.25)


@pytest.mark.long
@pytest.mark.parametrize("count", [1, 12])
def test_however_flat_a_corner_is_the_result_is_the_same(count):
    results = {}
    for flatness in (1e-2, 1e-4, 1e-7, 1e-11, 1e-100, 0.0, -1e-12, -1e-4):
        points, cells = flattened(*ball(), flatness, count)
        assert corner_scaled_jacobian(points, cells).min() <= flatness + 1e-6 * abs(flatness) + 1e-14
        after = hc.regularize((points, cells)).report.after
        results[flatness] = after.scaled_jacobian.min, after.scaled_jacobian.mean
        assert after.invalid == 0
    smallest, means = np.array(list(results.values())).T
    assert smallest.min() > 0.7
    assert np.ptp(smallest) < 0.01
    assert np.ptp(means) < 0.002


@pytest.mark.parametrize("thickness", [1e-8, 1e-12, 0.0])
@pytest.mark.parametrize("mesh", [ball(), generate.jittered(*generate.box((5, 5, 5)), 0.2)], ids=["ball", "box"])
def test_a_layer_without_thickness_gets_one(mesh, thickness):
    points, cells = padded(*mesh, thickness)
    report = hc.regularize((points, cells)).report
    assert report.after.invalid == 0
    assert report.after.edge_ratio.max < 6.0
    assert report.after.shape.min > 0.4
    assert report.converged


def test_a_thin_layer_that_may_be_meant_stays_thin():
    points, cells = padded(*ball(), 1e-4)
    report = hc.regularize((points, cells)).report
    assert report.after.edge_ratio.max > 0.5 * report.before.edge_ratio.max


def test_thickening_folds_no_cell_and_makes_the_thinnest_thicker():
    points, cells = padded(*ball(), 1e-8)
    run = Regularization((points, cells))
    setting = run._setting
    formulation, points = setting.formulation(run._boundary), setting.normalized.points
    before = formulation.measures(points).fullness.min()
    assert is_valid(points, formulation.cells).all()
    for iteration in thicken(formulation, points):
        now = formulation.measures(iteration.points).fullness.min()
        assert now > before
        assert is_valid(iteration.points, formulation.cells).all()
        before = now
    assert before > 0.01


def test_a_mesh_that_keeps_cells_without_volume_is_not_converged():
    points, cells = generate.box((2, 2, 2))
    points[:, 2] *= 1e-12
    report = hc.regularize((points, cells), boundary="fixed").report
    assert not report.converged
    assert "no volume, or next to none" in report.reason


@pytest.mark.parametrize(("edge", "seed"), [(16, 0), (20, 1), (28, 0)])
def test_thin_cells_cost_no_iterations_where_only_the_distortion_counts(edge, seed):
    points, cells = generate.jittered(*generate.box((edge, edge, edge)), 0.25, seed=seed)
    assert 0.0 < corner_scaled_jacobian(points, cells).min() < 0.05
    result = hc.regularize((points, cells), boundary="fixed")
    assert result.report.after.scaled_jacobian.min > 0.9999
    # Without that phase they take 24, 20 and 19; with the barrier itself in it, eps = 0, the first goes an eighth.
    assert result.report.iterations < 16
    steps = [record.step for record in result.history if record.phase == "thicken"]
    assert 0 < len(steps) < 3
    assert min(steps) >= 0.5
