"""Where the boundary stays out of its bound, the points go back towards earlier ones: as few of them as will do."""

from types import SimpleNamespace

import numpy as np
import pytest

from hexconformal import HexMesh, Options, generate
from hexconformal.elements import is_valid
from hexconformal.formulation import ReturnSchedule
from hexconformal.geometry import DistanceBarrier, SurfaceLocator
from hexconformal.mesh import SERIAL, NormalizedMesh, boundary_quads
from hexconformal.regularization import Regularization
from hexconformal.regularization.boundary import boundary_of
from hexconformal.regularization.return_to_surface import _falling, return_to_surface, towards
from hexconformal.regularization.setting import Setting
from hexconformal.regularization.stages import Stages

BOUND = 0.02


def situation(bumps):
    """A ball, its barrier, and the ball turned a little inside, with so many nodes of the boundary out of the bound."""
    points, cells = generate.ball(8, 4)
    quads = boundary_quads(cells)[0]
    surface = np.unique(quads)
    moved = points.copy()
    inner = np.setdiff1d(np.arange(len(points)), surface)
    moved[inner] *= 1.01
    moved[surface[:: len(surface) // bumps][:bumps]] *= 1.05
    assert is_valid(moved, cells).all()
    barrier = DistanceBarrier.around(SurfaceLocator(points, quads), BOUND)
    assert barrier.exceeded(moved)
    return points, moved, cells, barrier


@pytest.mark.parametrize("bumps", [1, 3])
def test_only_what_is_around_goes_back(bumps):
    points, moved, cells, barrier = situation(bumps)
    found = towards(barrier, moved, points, cells, ReturnSchedule())
    assert not barrier.exceeded(found)
    assert is_valid(found, cells).all()
    elsewhere = (found == moved).all(axis=1)
    assert elsewhere.mean() > 0.7
    assert (found[~elsewhere] != moved[~elsewhere]).any()


def test_what_comes_out_of_the_bound_on_the_way_back_goes_back_too():
    """A cylinder turned about its axis around a bump: half-way back its nodes are on chords, below the surface."""
    points, cells = generate.cylinder(4, 3, 24)
    quads = boundary_quads(cells)[0]
    barrier = DistanceBarrier.around(SurfaceLocator(points, quads), BOUND)
    x, y, z = points.T
    angle = 0.4 * np.clip(1.0 - np.abs(z - 1.0) / 0.7, 0.0, None)
    moved = np.stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, z], axis=1)
    moved[np.setdiff1d(np.arange(len(points)), quads), :2] *= 1.01
    assert not barrier.exceeded(moved)
    moved[np.argmin(np.linalg.norm(points - [1.0, 0.0, 1.0], axis=1)), :2] *= 1.06
    assert barrier.exceeded(moved)
    found = towards(barrier, moved, points, cells, ReturnSchedule(parts_back=(1.0,), rings_back=(4,), shares_back=()))
    assert not barrier.exceeded(found)
    assert is_valid(found, cells).all()
    there, moves = (found == moved).all(axis=1), (moved != points).any(axis=1)
    assert (there & moves).sum() > 0.2 * moves.sum()


def test_all_goes_back_where_that_is_not_enough():
    points, moved, cells, barrier = situation(1)
    found = towards(barrier, moved, points, cells, ReturnSchedule(rings_back=()))
    assert not barrier.exceeded(found)
    share = np.linalg.norm(found - moved) / np.linalg.norm(points - moved)
    np.testing.assert_allclose(found, moved + share * (points - moved), atol=1e-14)
    assert 0.0 < share < 1.0


def test_points_within_the_bound_stay():
    points, _, cells, barrier = situation(1)
    inside = 1.001 * points
    assert towards(barrier, inside, points, cells, ReturnSchedule()) is inside


def test_the_points_are_looked_at_once(monkeypatch):
    points, moved, cells, barrier = situation(3)
    looks = []
    look = DistanceBarrier.nodes_beyond
    monkeypatch.setattr(DistanceBarrier, "nodes_beyond", lambda of, x: looks.append(x is moved) or look(of, x))
    towards(barrier, moved, points, cells, ReturnSchedule(parts_back=(0.01, 1.0)))
    assert len(looks) > 3
    assert sum(looks) == 1


def test_what_goes_back_spoils_no_cell():
    points, cells = generate.box((12, 4, 4), (12.0, 4.0, 4.0))
    barrier = DistanceBarrier.around(SurfaceLocator(points, boundary_quads(cells)[0]), BOUND)
    # One end is pushed far out: to put back its nodes alone would fold the cells behind.
    moved = points.copy()
    moved[:, 0] += 1.5 * np.clip(points[:, 0] - 6.0, 0.0, None) / 6.0 * 4.0
    schedule = ReturnSchedule(rings_back=(1, 2, 12), parts_back=(1.0,))
    found = towards(barrier, moved, points, cells, schedule)
    assert not barrier.exceeded(found)
    assert is_valid(found, cells).all()


def test_shares_fall_from_one_to_zero_over_the_rings():
    points, cells = generate.box((12, 1, 1), (12.0, 1.0, 1.0))
    shares = _falling(cells, points[:, 0] == 0.0, 8, SERIAL)
    at = [shares[np.isclose(points[:, 0], x)] for x in range(13)]
    assert all((share == share[0]).all() for share in at)
    np.testing.assert_allclose([share[0] for share in at], [1, 1, 1, 1, 1, 0.75, 0.5, 0.25, 0, 0, 0, 0, 0])


def test_worst_cells_that_were_let_go_on_the_way_back_are_raised_again(monkeypatch):
    run = Regularization(generate.jittered(*generate.ball(4, 2), 0.1, seed=1))
    for _ in run:
        pass
    stages, barrier = Stages(run._setting, run._boundary), run._boundary.barrier
    formulation, good, cells = run._setting.formulation(run._boundary), run._points, run._setting.normalized.cells
    poor = good.copy()
    node = np.setdiff1d(cells, boundary_quads(cells)[0])[0]
    neighbour = good[cells[(cells == node).any(axis=1)][0]].mean(axis=0)
    poor[node] += 0.4 * (neighbour - poor[node])
    worst = [formulation.quality(x).min() for x in (poor, good)]
    assert 0.0 < worst[0] < worst[1] - 0.2
    assert not barrier.exceeded(poor)
    out = good + 0.1 * (good - good.mean(axis=0))
    assert barrier.exceeded(out)
    stages._earlier = [poor]

    def back(formulation, points, keeps_worst):
        if not keeps_worst:
            yield poor, formulation

    monkeypatch.setattr("hexconformal.regularization.stages.return_to_surface", back)
    seen = []
    stage = stages._return_to_surface(formulation, out)
    while True:
        try:
            seen.append(next(stage))
        except StopIteration as end:
            best = end.value
            break
    assert formulation.quality(best).min() > worst[1] - 0.05
    assert not barrier.exceeded(best)
    assert not any(barrier.exceeded(iteration.points) for iteration in seen)
    # Where little going back loses nothing it is not let go at all.
    monkeypatch.setattr(stages, "_towards_earlier", lambda barrier, points: good)
    monkeypatch.setattr(stages, "_let_go", None)
    last = [iteration.points for iteration in stages._return_to_surface(formulation, out)][-1]
    assert last is good


def test_the_bound_gets_smaller_where_what_the_samples_see_is_within_it_again_and_again(monkeypatch):
    """What is farther away than they are lies between them; who goes on has the bound that was asked for."""
    setting = Setting(NormalizedMesh(HexMesh(*generate.ball(4, 2))), Options())
    boundary = boundary_of(setting.normalized, setting.options, setting.schedules)
    formulation, points, schedule = setting.formulation(boundary), setting.first, ReturnSchedule()
    bound, bounds, asked = boundary.barrier.bound, [], []

    def steps(formulation, points, weights):
        bounds.append(formulation.barrier.bound)
        yield SimpleNamespace(points=points)

    monkeypatch.setattr("hexconformal.regularization.return_to_surface.convex_newton", steps)
    monkeypatch.setattr(DistanceBarrier, "exceeded", lambda self, points: asked.append(self.bound) or True)
    monkeypatch.setattr(DistanceBarrier, "watching", lambda self, points: self)
    seen = [there.barrier.bound for _, there in return_to_surface(formulation, points, keeps_worst=False)]
    powers = np.maximum(np.arange(schedule.watches) + 1 - schedule.untightened, 0)
    np.testing.assert_allclose(bounds, bound * schedule.tighter**powers)
    assert bounds[-1] < 0.95 * bound
    assert set(seen) == set(asked) == {bound}
