"""What counts as better than the input, which comes back otherwise."""

import numpy as np
import pytest
from meshes.hexahedra import wavy_layers, with_rough_surface

import hexconformal as hc
from hexconformal import generate
from hexconformal.mesh import NormalizedMesh

CURVED = {"cylinder": generate.cylinder(4, 3, 6), "ball": generate.ball(3, 2)}


def test_a_mesh_comes_back_rather_than_a_worse_one():
    run = hc.Regularization(generate.bent_bar())
    records = list(run)
    report = run.result().report
    # The smallest scaled Jacobian, or the mean, is below the input's in every iteration but the first.
    assert len(records) > 1
    for record in records[1:]:
        change = record.min_scaled_jacobian - records[0].min_scaled_jacobian
        assert min(change, record.mean_scaled_jacobian - records[0].mean_scaled_jacobian) < -1e-5
    assert report.largest_displacement == 0.0
    assert report.reason.endswith("nothing better than the input was found")
    assert report.energy_after == report.energy_before


def test_a_corner_that_is_held_does_not_keep_the_rest_from_getting_better():
    # The smallest scaled Jacobian is that of the input's edges, which it can only approach from below.
    report = hc.regularize(generate.sheared_block(5, 1.0)).report
    assert report.after.scaled_jacobian.min == pytest.approx(0.5**0.5, abs=1e-6)
    assert report.after.scaled_jacobian.mean > 0.9


def test_emphasis_on_the_worst_raises_it_and_never_ends_below_the_input():
    points, cells = generate.cylinder()
    mesh = generate.jittered(points, cells, 0.3, seed=4)
    plain = hc.regularize(mesh, boundary="fixed", emphasis="mean").report
    raised = hc.regularize(mesh, boundary="fixed").report
    assert raised.after.scaled_jacobian.min > plain.after.scaled_jacobian.min + 0.01
    assert raised.after.scaled_jacobian.min >= raised.before.scaled_jacobian.min
    assert raised.after.scaled_jacobian.mean >= raised.before.scaled_jacobian.mean


def test_the_input_comes_back_if_the_surface_went_too_far_after_all(monkeypatch):

    points, cells = with_rough_surface(CURVED["ball"])
    far = 0.02 * NormalizedMesh(hc.HexMesh(points, cells)).diagonal
    monkeypatch.setattr("hexconformal.regularization.acceptance.hausdorff", lambda *_, **__: far)
    result = hc.regularize((points, cells))
    assert np.array_equal(result.points, points)
    assert "the surface would move by 0.02" in result.report.reason
    assert not result.converged
    assert result.report.energy_after == result.report.energy_before
    assert result.report.hausdorff == 0.0


def test_the_input_comes_back_if_an_interface_went_too_far_after_all(monkeypatch):
    mesh = wavy_layers(6)
    for module in ("stages", "acceptance"):
        monkeypatch.setattr(f"hexconformal.regularization.{module}.sheets_distance", lambda *_: 0.02)
    result = hc.regularize(mesh, hausdorff=0.019)
    assert np.array_equal(result.points, mesh.points)
    assert "an interface would move by 0.02" in result.report.reason
    assert not result.converged
