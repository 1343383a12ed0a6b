"""What is promised of meshes that do not untangle: no valid cell is lost on the way, and nothing is divided by zero."""

import numpy as np
import pytest
from independent_validity import corner_scaled_jacobian, surely_invalid, surely_valid

import hexconformal as hc
from hexconformal import generate


def knotted(seed):
    """A small cylinder with a cell upside down, and a node pulled through the opposite corner of another."""
    rng = np.random.default_rng(seed)
    points, cells = generate.jittered(*generate.cylinder(2, 1, 2), 0.3, seed=seed)
    points = points.copy()
    one, other = cells[rng.choice(len(cells), 2, replace=False)]
    points[one, 2] = 2.0 * points[one, 2].mean() - points[one, 2]
    points[other[0]] += 1.5 * (points[other[6]] - points[other[0]])
    return points, cells


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 6, 7, 12])
def test_a_valid_cell_of_a_tangled_mesh_stays_valid_in_every_iterate(seed):
    points, cells = knotted(seed)
    valid = cells[surely_valid(points, cells)]
    assert 0 < len(valid) < len(cells)
    run = hc.Regularization((points, cells), hc.Options(boundary="fixed"))
    for record in run:
        assert not surely_invalid(run.points, valid).any(), record
    result = run.result()
    assert not surely_invalid(result.points, valid).any()
    # Nor is the way given up: fewer are inverted than were.
    assert result.report.after.inverted < result.report.before.inverted
    assert corner_scaled_jacobian(result.points, cells).mean() > corner_scaled_jacobian(points, cells).mean()


def test_what_a_record_tells_is_true_of_a_mesh_without_loss():
    points, cells = generate.jittered(*generate.ball(3, 2), 0.9, seed=3, valid=False)
    valid = cells[surely_valid(points, cells)]
    run = hc.Regularization((points, cells))
    hidden = 0
    for iteration in run._stages._iterations():
        hidden += surely_invalid(run._normalized.to_user(iteration.points), valid).any()
    assert hidden > 0  # the way leads through meshes that have lost cells,
    for iteration in hc.Regularization((points, cells))._stages:
        assert not surely_invalid(run._normalized.to_user(iteration.points), valid).any()  # of which nothing is seen
    assert hc.regularize((points, cells)).report.after.invalid == 0


def test_perfect_cells_upside_down_have_no_energy_to_divide_by():
    points, cells = generate.box((1, 1, 1))
    upside_down = points * [1.0, 1.0, -1.0] + [9.0, 0.0, 0.0]
    mesh = np.concatenate([points, points + 3.0, upside_down]), np.concatenate([cells, cells + 8, cells + 16])
    for options in ({"boundary": "free"}, {"boundary": "fixed"}, {"conserve_volume": True}):
        report = hc.regularize(mesh, **options).report
        assert report.before.inverted == report.after.inverted == 1


@pytest.mark.long
def test_volumes_that_cancel_can_be_conserved():
    points, cells = generate.jittered(*generate.box((3, 3, 3)), 0.3, seed=1, valid=False)
    turned = points * [1.0, 1.0, -1.0] + [9.0, 0.0, 0.0]
    mesh = np.concatenate([points, turned]), np.concatenate([cells, cells + len(points)])
    report = hc.regularize(mesh, conserve_volume=True).report
    assert report.before.inverted == len(cells)
    assert abs(report.before.total_volume) < 1e-12
