"""A run that begins where an earlier one has come to: the same problem, no worse than the start, or refused by name."""

from itertools import islice

import numpy as np
import pytest
import pyvista as pv
from meshes.coupled import periodic_box

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements import is_valid
from hexconformal.mesh import NormalizedMesh
from hexconformal.regularization import Start
from hexconformal.regularization.acceptance import Distances
from hexconformal.regularization.setting import Setting

CYLINDER = generate.jittered(*generate.cylinder(4, 3, 6), 0.3, seed=4)
BALL = generate.jittered(*generate.ball(3, 2), 0.3, seed=1)


def tangled():
    """A box with nodes inside where they fold cells."""
    points, cells = generate.box((4, 4, 4))
    inside = (np.abs(points - 0.5) < 0.4).all(axis=1)
    points[inside] += np.random.default_rng(1).uniform(-0.2, 0.2, (inside.sum(), 3))
    return points, cells


FOLDED = tangled()


def left_after(count, mesh, **options):
    run = hc.Regularization(mesh, hc.Options(**options))
    records = list(islice(run, count))
    return run.reached(), records


@pytest.mark.parametrize("mesh", [CYLINDER, BALL], ids=["cylinder", "ball"])
def test_from_its_own_result_a_run_gains_next_to_nothing_and_loses_nothing(mesh):
    first = hc.regularize(mesh)
    again = hc.regularize(mesh, start=first.points).report
    assert again.before == first.report.before
    one, other = (report.after.scaled_jacobian for report in (first.report, again))
    assert -1e-6 <= other.min - one.min < 2e-3
    assert abs(other.mean - one.mean) < 1e-3
    assert again.hausdorff <= 0.005
    assert "begun where an earlier run had come to" in again.notes


@pytest.mark.long
@pytest.mark.parametrize("count", [3, 7])
@pytest.mark.parametrize("mesh", [CYLINDER, BALL], ids=["cylinder", "ball"])
def test_a_run_left_half_way_and_gone_on_with_ends_as_one_that_was_not(mesh, count):
    whole = hc.regularize(mesh).report.after.scaled_jacobian
    start, records = left_after(count, mesh)
    run = hc.Regularization(mesh, start=start)
    begun = list(run)
    # The same problem: energies are measured as they were, the input is what it was.
    assert [record.phase for record in begun[:2]] == ["input", "start"]
    assert begun[0].energy == records[0].energy
    assert begun[1].energy == pytest.approx(records[-1].energy, rel=1e-9)
    assert begun[1].min_scaled_jacobian == pytest.approx(records[-1].min_scaled_jacobian, abs=1e-12)
    # Once the worst cells are raised the distortion does not come first again.
    assert ("distortion" in {record.phase for record in begun}) == (records[-1].phase == "distortion")
    ended = run.result().report.after.scaled_jacobian
    assert ended.min == pytest.approx(whole.min, abs=2e-3)
    assert ended.mean == pytest.approx(whole.mean, abs=1e-3)


def test_volume_targets_and_report_are_those_of_the_mesh():
    points, cells = BALL
    start = 1.002 * points
    again = hc.regularize(BALL, start=start, conserve_volume=True).report
    assert abs(again.volume_change) < 1e-10
    assert again.before == hc.quality(BALL).summary()
    # The half-done mesh by itself would keep its own, .6 % more.
    alone = hc.regularize((start, cells), conserve_volume=True).report
    assert alone.after.total_volume > 1.005 * again.after.total_volume
    half = hc.regularize(BALL, max_iterations=3).points
    begun = list(islice(hc.Regularization(BALL, hc.Options(target="input"), start=half), 2))[1]
    known = next(iter(hc.Regularization((half, cells), hc.Options(target=points))))
    assert begun.energy == pytest.approx(known.energy, rel=1e-9)
    assert begun.energy != pytest.approx(
        next(iter(hc.Regularization((half, cells), hc.Options(target="input")))).energy
    )


UNFOLDING = {"harmonic start", "untangle", "untangle patches", "untangle interior"}


def test_what_is_folded_is_unfolded_from_there():
    points, cells = FOLDED
    whole = hc.regularize(FOLDED)
    assert whole.report.before.invalid > 0 == whole.report.after.invalid
    # One node is where it was, so that cells are folded that were so in the mesh.
    for node in np.flatnonzero((whole.points != points).any(axis=1)):
        start = np.array(whole.points)
        start[node] = points[node]
        folded = ~is_valid(start, cells)
        if folded.any() and not is_valid(points, cells)[folded].any():
            break
    run = hc.Regularization(FOLDED, start=start)
    phases = [record.phase for record in run]
    assert phases[:3] == ["input", "start", "untangle patches"]  # as few are folded, which all of the mesh's are not
    assert "harmonic start" in {record.phase for record in whole.history}
    ended = run.result()
    assert is_valid(ended.points, cells).all()
    assert ended.report.after.scaled_jacobian.min == pytest.approx(whole.report.after.scaled_jacobian.min, abs=0.02)


def test_no_cell_is_lost_that_was_valid_at_the_start_though_not_in_the_mesh():
    normalized = NormalizedMesh(hc.HexMesh(*FOLDED))
    better = normalized.from_user(hc.regularize(FOLDED).points)
    assert Setting(normalized, hc.Options()).keeps_valid(normalized.points)
    assert not Setting(normalized, hc.Options(), start=better).keeps_valid(normalized.points)


def test_where_nothing_is_folded_at_the_start_nothing_is_unfolded():
    result = hc.regularize(FOLDED)
    assert result.history[1].phase in UNFOLDING
    assert [record.phase for record in hc.Regularization(FOLDED, start=result.points)][2] not in UNFOLDING


def test_a_start_may_be_a_mesh_or_a_file_of_one(tmp_path):
    result = hc.regularize(CYLINDER)
    hc.write(tmp_path / "half.vtu", result.mesh)
    for start in (result.mesh, (result.points, CYLINDER[1]), tmp_path / "half.vtu", result.points.tolist()):
        run = hc.Regularization(CYLINDER, start=start)
        next(iter(run))
        next(iter(run))
        np.testing.assert_allclose(run.points, result.points, atol=1e-12)


def test_nodes_that_the_start_has_not_moved_are_bit_identical():
    held = np.arange(0, len(BALL[0]), 3)
    result = hc.regularize(BALL, fixed=held)
    again = hc.regularize(BALL, fixed=held, start=result.points)
    assert np.array_equal(again.points[held], BALL[0][held])
    assert (again.points != BALL[0]).any()


def moved(points, node, by):
    points = np.array(points)
    points[node] += by
    return points


@pytest.mark.parametrize(
    ("start", "options", "kind", "said"),
    [
        (BALL[0][:-1], {}, hc.OptionError, "start must be the .* points of the mesh, not"),
        (BALL[0][:, :2], {}, hc.OptionError, r"start must be \(n, 3\) points"),
        (np.full_like(BALL[0], np.nan), {}, hc.MeshError, "start: points with NaN"),
        (moved(BALL[0], 0, 0.01), {"fixed": [0]}, hc.MeshError, r"nodes that are held are not where .*: 1 \(ids 0\)"),
        (1.001 * BALL[0], {"boundary": "fixed"}, hc.MeshError, "nodes that are held are not where the mesh has them"),
        (1.1 * BALL[0], {}, hc.MeshError, "start: the surface is 0.0.* away .*, more than hausdorff = 0.005 allows"),
        (BALL[0] * [1.0, 1.0, -1.0], {}, hc.MeshError, "start: cells that are valid in the mesh are not"),
        (BALL[0], {"surface": "ball.stl"}, hc.OptionError, "without another surface"),
    ],
)
def test_what_cannot_be_gone_on_from_is_refused(start, options, kind, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if "surface" in options:
        pv.Sphere(radius=float(np.linalg.norm(BALL[0], axis=1).max())).save("ball.stl")
    with pytest.raises(kind, match=said):
        hc.regularize(BALL, start=start, **options)


def test_coupled_nodes_must_have_gone_together_and_quadratic_cells_are_refused():
    points, cells, pairs = periodic_box()
    result = hc.regularize((points, cells), couplings=pairs)
    again = hc.regularize((points, cells), couplings=pairs, start=result.points)
    assert again.report.after.scaled_jacobian.min >= result.report.after.scaled_jacobian.min - 1e-6
    node = int(pairs[len(pairs) // 2, 0])
    inward = 1e-4 * (points.mean(axis=0) - points[node])
    with pytest.raises(hc.MeshError, match="nodes that"):
        hc.regularize((points, cells), couplings=pairs, start=moved(result.points, node, inward))
    curved = hc.elevated(generate.sheared_cube(2), 20)
    with pytest.raises(hc.OptionError, match="second order there is no start yet"):
        hc.regularize(curved, start=curved.points)


def test_features_that_were_let_go_are_so_from_the_start():
    points, cells = generate.jittered(*generate.box((4, 4, 4)), 0.2)
    corner = int(np.argmin(points.sum(axis=1)))
    start = moved(points, corner, 0.002)
    run = hc.Regularization((points, cells), start=start)
    assert "features='soft' instead, as nodes that these hold are elsewhere at the start" in run.result().report.notes
    with pytest.raises(hc.MeshError, match=rf"nodes that are held are not where .* \(ids {corner}\)"):
        hc.regularize((points, cells), start=start, features="keep")


def test_a_run_comes_back_to_its_start_where_it_led_too_far(monkeypatch):
    first = hc.regularize(BALL, max_iterations=3)
    run = hc.Regularization(BALL, start=first.points)
    far = [0.02, 0.001]
    monkeypatch.setattr("hexconformal.regularization.run.distances", lambda *_: Distances(far.pop(0)))
    for _ in run:
        pass
    result = run.result()
    np.testing.assert_allclose(result.points, first.points, atol=1e-12)
    assert "the surface would move by 0.02: the start is returned" in result.report.reason
    assert result.report.hausdorff == 0.001
    assert not result.converged
    assert result.report.energy_after == pytest.approx(run.history[1].energy)


def test_a_start_out_of_the_bound_in_the_middle_of_a_run_is_brought_back():
    far = 1.02 * BALL[0]
    with pytest.raises(hc.MeshError, match="the surface is"):
        hc.Regularization(BALL, start=far)
    result = hc.Regularization(BALL, start=Start(far, on_the_way=True))
    records = list(result)
    report = result.result().report
    assert records[1].phase == "start"
    assert report.hausdorff <= 0.005
    assert report.after.scaled_jacobian.min > report.before.scaled_jacobian.min


def test_a_start_that_is_worse_than_the_input_does_not_make_the_result_so():
    good = hc.regularize(BALL)
    result = hc.regularize((good.points, BALL[1]), start=BALL[0], hausdorff=0.02, max_iterations=1)
    assert result.report.after.scaled_jacobian.min >= good.report.after.scaled_jacobian.min - 1e-6
