"""The descent: when it goes on and ends, what it holds, and where it begins again."""

import numpy as np
import pytest
from meshes.surfaces import icosphere, scattered_sphere, shaken

import surface
from hexconformal.geometry import mean_edge_length
from surface.constraint.input_surface import InputSurface
from surface.quality.assessment import smallest_angles
from surface.remeshing.descent import Termination, descend
from surface.remeshing.schedules import Schedules, StepSchedule


def test_a_cell_that_stands_in_the_way_is_held(monkeypatch):
    points, cells = shaken(icosphere(2), 0.04)
    cells = cells.triangles
    mesh = points, cells
    home = surface.Remeshing(mesh)._start

    def turned_over(shape, x):
        turned = np.zeros(len(cells), dtype=bool)
        turned[7] = np.abs(x[cells[7]] - home[cells[7]]).max() > 0
        return turned

    monkeypatch.setattr(InputSurface, "turned_over", turned_over)
    result = surface.remesh(mesh)
    np.testing.assert_array_equal(result.points[cells[7]], points[cells[7]])
    assert result.report.turned == 0
    assert result.report.after.mean_angle > result.report.before.mean_angle + 5
    assert [record.iteration for record in result.history] == list(range(len(result.history)))
    assert any(note.startswith("nodes held, whose cells would be spoiled: 3 ") for note in result.report.notes)
    assert result.report.iterations > 12
    assert surface.remesh(mesh, max_iterations=12).report.iterations == 12

    monkeypatch.setattr(InputSurface, "turned_over", lambda shape, x: np.full(len(cells), np.abs(x - home).max() > 0))
    result = surface.remesh(mesh)
    np.testing.assert_array_equal(result.points, points)
    assert "nothing better was found without spoiling a cell" in result.report.reason


def test_a_rough_surface_ends_where_only_a_few_hopeless_cells_still_gain():
    points, cells = icosphere(2)
    rng, edge = np.random.default_rng(0), mean_edge_length(points, cells)
    rough = points * (1 + 0.25 * edge * rng.normal(size=(len(points), 1)))
    rough = rough + 0.2 * edge * rng.normal(size=points.shape)
    report = surface.remesh((rough, cells.triangles)).report
    assert report.converged
    assert report.iterations < 50
    assert report.after.mean_angle > 44.0


@pytest.mark.long
@pytest.mark.parametrize("seed", [200, 211])
def test_a_run_goes_on_while_cells_gain_against_their_own_normals(seed):
    # On a rough surface the energy that is lowered stalls first, since not all normals are taken anew.
    points, triangles = scattered_sphere(300, seed)
    rng = np.random.default_rng(seed)
    problem = surface.Remeshing((points * (1 + 0.02 * rng.standard_normal((300, 1))), triangles))._problem
    termination, tolerance = Termination(), 3e-4
    own = [
        problem.energy.value_at_own_normals(at.points)
        for at in descend(problem, tolerance, termination, np.zeros(300, dtype=bool))
    ]
    assert termination.converged
    falls = -np.diff(np.log(own))
    assert (falls[-5:] < 1.5 * tolerance).all() or falls[-10:].sum() < 10 * tolerance


def thin_wall(level, seed=0, noise=0.2):
    """A flattened sphere, with nodes at random along it."""
    points, cells = icosphere(level)
    rng, edge = np.random.default_rng(seed), mean_edge_length(points, cells)
    points = points + noise * edge * rng.normal(size=points.shape)
    return points * [1.0, 1.0, 0.02] / np.linalg.norm(points, axis=1, keepdims=True), cells.triangles


@pytest.mark.long
@pytest.mark.parametrize(
    ("wall", "mean"), [((3,), 53), ((2, 2, 0.2), 47), ((2, 2, 0.35), 29), ((3, 2, 0.35), 27), ((3, 1, 0.2), 50)]
)
def test_where_cells_of_a_thin_wall_turn_over_it_begins_again_with_care(wall, mean):
    run = surface.Remeshing(thin_wall(*wall))
    for _ in run:
        pass
    report = run.result().report
    assert max(record.turned for record in run.history) > 0
    assert report.turned == 0
    assert report.after.mean_angle > mean > report.before.mean_angle
    assert report.after.min_angle > (1 - 1e-3) * report.before.min_angle


@pytest.mark.parametrize("everybody", [False, True])
def test_who_waits_stays_until_no_cell_may_turn_over(everybody):
    points, cells = shaken(icosphere(2), 0.03)
    problem = surface.Remeshing((points, cells.triangles))._problem
    waiting = np.full(len(points), everybody)
    waiting[:30] = True
    released = False
    for at in descend(problem, 3e-4, Termination(), waiting):
        moved = np.linalg.norm(at.points - problem.start, axis=1)
        assert moved[waiting].any() == released
        released = problem.input_surface.forbid_turning
    assert released
    assert (moved[waiting] > 0).all()


def test_a_descent_that_begins_again_does_not_take_the_latest_surface_back():
    # A search that gives up early, so that the first descent ends stuck.
    schedules = Schedules(step=StepSchedule(max_tries=4))
    points, cells = shaken(icosphere(2), 0.08)
    run = surface.Remeshing(
        (points, cells.triangles), surface.Options(max_iterations=10, feature_angle=None), schedules
    )
    latest = [smallest_angles(run.last_points, cells).mean() for _ in run]
    means = np.array([record.mean_angle for record in run.history])
    again = int(np.argmin(np.diff(means))) + 1
    assert means[again] < means[again - 1] - 2
    assert min(latest[again:]) >= latest[again - 1]
