"""Unfolding, and what the boundary has to do with it."""

from dataclasses import replace

import numpy as np
import pytest

import hexconformal as hc
from hexconformal.formulation import Work
from hexconformal.mesh import NormalizedMesh, boundary_quads
from hexconformal.regularization.boundary import boundary_of
from hexconformal.regularization.setting import Setting
from hexconformal.regularization.unfolding import Unfolded, _or_with_boundary_held
from hexconformal.untangling import folded_cells, untangle


def test_an_outline_that_would_be_left_too_far_behind_is_kept_by_a_barrier():
    points, cells = hc.generate.box((6, 6, 6))
    node = np.isclose(points, [1 / 6, 0.5, 1.0]).all(axis=1)
    points[node, 0] = -0.01 * np.sqrt(3)  # past the edge, in the plane of the face
    report = hc.regularize((points, cells)).report
    assert report.before.invalid == 2
    assert report.after.invalid == 0
    assert 0.001 < report.hausdorff <= 0.005
    assert any("features='soft' instead" in note for note in report.notes)


def test_where_the_boundary_must_come_back_it_is_held_while_what_is_inside_is_unfolded():
    ball, cells = hc.generate.ball(3, 2)
    skin = np.unique(boundary_quads(cells)[0])
    inside = ~np.isin(np.arange(len(ball)), skin)
    points = ball + 0.2 * inside[:, None] * np.random.default_rng(1).normal(size=ball.shape)
    setting = Setting(NormalizedMesh(hc.HexMesh(points, cells)), hc.Options(features="soft"))
    boundary = boundary_of(setting.normalized, setting.options, setting.schedules)
    formulation, start = setting.formulation(boundary), setting.normalized.points
    bad = folded_cells(formulation, start)
    assert bad.sum() > 3
    # All are unfolded but one, with a boundary that is nowhere near.
    away = Unfolded(boundary, formulation, 1.5 * start, np.arange(len(cells)) == np.argmax(bad))
    steps = _or_with_boundary_held(setting, away)
    instead = away
    try:
        while True:
            next(steps)
    except StopIteration as ended:
        instead = ended.value
    assert not folded_cells(formulation, instead.points).any()
    quads = setting.normalized.quads
    np.testing.assert_array_equal(instead.points[quads], start[quads])


@pytest.mark.long
def test_faces_that_are_held_turned_over_are_told():
    points, cells = hc.generate.box((4, 4, 2))
    floor = points[:, 2] == 0
    node = int(np.flatnonzero(floor & (np.abs(points[:, :2] - 0.5).max(axis=1) < 1e-9))[0])
    points[node, 0] = 0.8  # beyond the next one
    notes = hc.regularize((points, cells), boundary="fixed").report.notes
    ids = f"{node}, {node + 1}"
    assert f"no valid mesh has these nodes where they are held: 2 (ids {ids}); faces there are turned over" in notes


def two_neighbours_twice():
    """A box, and beside it two cells with two faces in common, one of which has to be flat or worse."""
    points, cells = hc.generate.box((3, 3, 3))
    twice = np.array([[0, 1, 2, 3, 4, 5, 6, 7], [0, 3, 8, 1, 4, 7, 9, 5]])
    ring = [[0, 0], [1, 0], [1, 1], [0, 1]]
    beside = [[*at, z] for z in (0, 1) for at in ring] + [[0.9, 0.9, 0.0], [0.9, 0.9, 1.0]]
    return np.concatenate([points, [3.0, 0, 0] + np.array(beside, dtype=float)]), np.concatenate([cells, twice + 64])


@pytest.mark.long
def test_cells_that_cannot_all_be_valid_are_tried_once():
    points, cells = two_neighbours_twice()
    setting = Setting(NormalizedMesh(hc.HexMesh(points, cells)), hc.Options())
    boundary = boundary_of(setting.normalized, setting.options, setting.schedules)
    formulation = setting.formulation(boundary)
    assert setting.ids(formulation.impossible).tolist() == [27, 28]
    unaware = replace(formulation, attainable=np.ones(len(cells)))
    steps, left = [], []
    for one in (formulation, unaware):
        work, reached = Work(1e9, 1), setting.first
        for iteration in untangle(one.with_work(work), reached):
            reached = iteration.points
        steps.append(1e9 - work.left)
        left.append(int(folded_cells(one, reached).sum()))
    assert left[0] == left[1] == 1
    # One attempt in one round, instead of several in each of several.
    assert 0 < steps[0] < 0.05 * steps[1]


def test_without_what_is_folded_there_the_others_may_be_as_good_as_any():
    points, cells = two_neighbours_twice()
    setting = Setting(NormalizedMesh(hc.HexMesh(points, cells)), hc.Options())
    boundary = boundary_of(setting.normalized, setting.options, setting.schedules)
    formulation = setting.formulation(boundary)
    others = formulation.without(np.arange(len(cells)) == np.flatnonzero(formulation.impossible)[0])
    assert len(others.cells) == len(cells) - 1
    assert not others.impossible.any()
    report = hc.regularize((points, cells)).report
    assert any("cells that are connected as they are cannot all be valid" in note for note in report.notes)


def test_more_room_is_not_tried_where_not_all_cells_can_be_valid():
    run = hc.Regularization(two_neighbours_twice(), hc.Options(features="soft"))
    phases = {record.phase for record in run}
    assert "untangle patches" in phases
    assert "untangle with more room" not in phases
