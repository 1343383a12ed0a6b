"""The worst cells are raised step by step, as far as held nodes allow."""

from dataclasses import replace

import numpy as np
import pytest
from corner_problems import fixed_boundary, formulation_of
from meshes.flat import flattened
from meshes.hexahedra import INVALID_INSIDE, separate

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements import CORNERS, corner_scaled_jacobian
from hexconformal.formulation import Iteration
from hexconformal.geometry import find_features
from hexconformal.mesh import boundary_quads
from hexconformal.regularization import Options, Regularization, worst_cells
from hexconformal.regularization.stages import Stages
from hexconformal.regularization.worst_cells import raise_worst, raise_worst_patches, reopen_worst, stiffened


def test_lifting_raises_the_worst_cell_step_by_step():
    points, cells = generate.jittered(*generate.cylinder(4, 3, 6), 0.35, seed=3)
    formulation = fixed_boundary(points, cells)
    lowest = [corner_scaled_jacobian(at.points, cells).min() for at in raise_worst(formulation, points)]
    assert lowest[-1] > corner_scaled_jacobian(points, cells).min() + 0.2
    assert lowest[-1] == max(lowest)


def test_little_is_left_below_what_no_corner_may_pass():
    points, cells = generate.jittered(*generate.box((3, 3, 3)), 0.3, seed=1)
    formulation = fixed_boundary(points, cells)
    worst, most = formulation.measures(points).angle.max(), stiffened(formulation, points).largest_angles(cells)
    assert (worst < most).all()
    assert (most < 1.1 * worst).all()


def test_nothing_is_lifted_once_held_corners_forbid_it():
    points, cells = generate.sheared_block(4, 1.0)
    held = fixed_boundary(points, cells)
    assert list(raise_worst_patches(held, points)) == []
    assert list(raise_worst_patches(formulation_of(points, cells), points)) != []


def test_nothing_is_tried_once_the_worst_cell_is_what_the_connections_allow(monkeypatch):
    mesh = generate.jittered(*generate.ball(4, 2), 0.1, seed=1)
    run = Regularization(mesh)
    for _ in run:
        pass
    formulation = run._setting.formulation(run._boundary)
    quality = formulation.quality(run._points)
    assert 0.999 * formulation.attainable.min() < quality.min() < formulation.attainable.min() < 0.77
    tried = []
    monkeypatch.setattr(worst_cells, "_raised", lambda seen, points, region: tried.append(region) or points)
    assert list(raise_worst_patches(formulation, run._points)) == []
    assert not tried
    assert list(raise_worst_patches(replace(formulation, attainable=np.ones(len(quality))), run._points)) == []
    assert tried


def test_cells_that_are_better_than_the_worst_can_get_are_not_raised_with_it(monkeypatch):
    points, cells = generate.jittered(*generate.box((12, 12, 12)), 0.3, seed=1)
    formulation, firsts = fixed_boundary(points, cells), []
    quality = formulation.quality(points)
    for most in (1.0, quality.min() + 0.01):
        regions = []
        monkeypatch.setattr(
            worst_cells, "_raised", lambda seen, points, region, regions=regions: regions.append(region) or points
        )
        list(raise_worst_patches(replace(formulation, attainable=np.full(len(quality), most)), points))
        firsts.append(regions[0])
    assert firsts[1].sum() < 0.7 * firsts[0].sum()
    assert firsts[1][cells[quality.argmin()]].all()


def test_others_wait_for_a_cell_that_stalls_next_to_flat_and_is_opened_then(monkeypatch):
    formulation, points = nearly_flat()
    tried = []
    monkeypatch.setattr(worst_cells, "_raised", lambda seen, points, region: tried.append(region) or points)
    assert list(raise_worst_patches(formulation, points, opens=True)) == []
    assert len(tried) == 1
    assert list(raise_worst_patches(formulation, points)) == []
    assert len(tried) > 2
    schedule = replace(formulation.schedules.worst_cells, reopened=1e-4)
    formulation = replace(formulation, schedules=replace(formulation.schedules, worst_cells=schedule))
    tried.clear()
    assert list(raise_worst_patches(formulation, points, opens=True)) == []
    assert len(tried) > 1


def drained(stage):
    """The iterations of a stage, and what it returns."""
    seen = []
    while True:
        try:
            seen.append(next(stage))
        except StopIteration as end:
            return seen, end.value


def nearly_flat():
    """A ball with four inner cells next to flat, its boundary fixed."""
    points, cells = flattened(*generate.jittered(*generate.ball(4, 2), 0.2, seed=1), 1e-3, 4)
    formulation = fixed_boundary(points, cells)
    assert formulation.quality(points).min() < 2e-3
    return formulation, points


def test_worst_cells_next_to_flat_are_opened_as_folded_ones_are():
    formulation, points = nearly_flat()
    seen, opened = drained(reopen_worst(formulation, points))
    assert seen
    assert all(iteration.points is points for iteration in seen)
    assert formulation.quality(opened).min() > 0.05
    assert (formulation.measures(opened).determinant > 0.0).all()
    assert np.array_equal(opened[~formulation.free], points[~formulation.free])
    raised = [iteration.points for iteration in raise_worst_patches(formulation, opened)][-1]
    assert formulation.quality(raised).min() > 0.3
    seen, kept = drained(reopen_worst(formulation, raised))
    assert seen == []
    assert kept is raised


def test_what_has_been_opened_is_lowered_and_raised_anew_and_kept_if_it_is_better():
    formulation, points = nearly_flat()
    run = Regularization((points, formulation.cells), Options(boundary="fixed"))
    stages, none = Stages(run._setting, run._boundary), np.zeros(len(formulation.cells), dtype=bool)
    formulation = run._setting.formulation(run._boundary)
    points = run._points
    seen, better = drained(stages._reopen_worst(formulation, points, none, raise_worst))
    assert formulation.quality(better).min() > 0.4
    assert {iteration.phase for iteration in seen} == {"reopen worst cells"}
    assert all(iteration.points is points for iteration in seen[:-1])
    assert seen[-1].points is better
    # What comes of it may be worse.
    worse = points.copy()
    worse[formulation.cells[0]] = 0.0
    seen, kept = drained(stages._reopen_worst(formulation, points, none, lambda *_: iter([Iteration("worse", worse)])))
    assert kept is points
    assert seen


def test_what_is_left_while_opened_cells_are_raised_is_not_called_converged():
    formulation, points = nearly_flat()
    run = Regularization((points, formulation.cells), Options(boundary="fixed"))
    stages, none, seen = Stages(run._setting, run._boundary), np.zeros(len(formulation.cells), dtype=bool), []

    def raising(whole, places, opens):
        for iteration in raise_worst(whole, places, opens):
            seen.append(stages.state)
            yield iteration

    drained(stages._reopen_worst(run._setting.formulation(run._boundary), run._points, none, raising))
    assert seen
    assert not any(state.converged for state in seen)
    assert {state.reason for state in seen} == {"interrupted"}


def test_what_opening_has_brought_out_of_the_bound_comes_back_before_it_is_lowered(monkeypatch):
    run = Regularization(flattened(*generate.jittered(*generate.ball(4, 2), 0.2, seed=1), 1e-3, 4))
    stages, points, cells = Stages(run._setting, run._boundary), run._points, run._setting.normalized.cells
    formulation, none = run._setting.formulation(run._boundary), np.zeros(len(cells), dtype=bool)
    out = points + 0.03 * (points - points.mean(axis=0))
    assert formulation.barrier.exceeded(out)

    def opened(*_):
        yield Iteration("reopen worst cells", points)
        return out

    monkeypatch.setattr("hexconformal.regularization.stages.reopen_worst", opened)
    starts = []
    monkeypatch.setattr(stages, "_minimize", lambda formulation, points, *_: iter(starts.append(points) or ()))
    drained(stages._reopen_worst(formulation, points, none, raise_worst))
    assert starts
    assert not any(formulation.barrier.exceeded(start) for start in starts)


def test_no_cell_is_given_up_inside_for_opening_others(monkeypatch):
    cube = 1.0 * CORNERS
    flat, spoiled = cube.copy(), INVALID_INSIDE + [3.0, 0.0, 0.0]
    flat[4:, 0] += 20.0
    points, cells = separate(np.array([flat, cube + [3.0, 0.0, 0.0]]))
    both = separate(np.array([cube, spoiled]))[0]
    formulation = formulation_of(points, cells)
    assert 0.0 < formulation.quality(points).min() < 0.1 < formulation.quality(both).min()
    monkeypatch.setattr(worst_cells, "untangle_interior", lambda whole, places: places)
    for opened, kept in ((both, points), (np.concatenate([both[:8], points[8:]]), None)):
        monkeypatch.setattr(worst_cells, "untangle", lambda *_, opened=opened: iter([Iteration("untangle", opened)]))
        assert np.array_equal(drained(reopen_worst(formulation, points))[1], opened if kept is None else kept)


def cylinder_with_a_rough_rim():
    """A cylinder of which the rims, sharp curves, are shaken by half of an edge."""
    points, cells = generate.cylinder(4, 3, 6)
    edges = find_features(points, boundary_quads(cells)[0], cells=cells).edges
    rim, length = np.unique(edges), np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1).mean()
    points[rim] += 0.5 * length * np.random.default_rng(3).uniform(-1.0, 1.0, (len(rim), 3))
    return points, cells


@pytest.mark.long
def test_curves_are_let_go_where_the_worst_cells_stall_at_them():
    mesh = cylinder_with_a_rough_rim()
    kept, soft = (hc.regularize(mesh, hausdorff=0.02, features=mode).report for mode in ("keep", "auto"))
    told = [note for note in soft.notes if "may go as far as the surface" in note]
    assert len(told) == 1
    assert not any("may go as far" in note for note in kept.notes)
    assert kept.after.scaled_jacobian.min < 0.45
    assert soft.after.scaled_jacobian.min > max(0.6, kept.after.scaled_jacobian.min + 0.1)
    assert f"and come to {soft.after.scaled_jacobian.min:.3f} so" in told[0]
    assert soft.hausdorff <= 0.02
    assert abs(soft.volume_change) < 0.005
