"""Unfolding, and what the boundary has to do with it."""

import numpy as np

import hexconformal as hc
from hexconformal.mesh import NormalizedMesh, boundary_quads
from hexconformal.regularization.boundary import boundary_of
from hexconformal.regularization.setting import Setting
from hexconformal.regularization.unfolding import Unfolded, _or_with_boundary_held
from hexconformal.untangling import folded_cells


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


def test_faces_that_are_held_turned_over_are_told():
    points, cells = hc.generate.box((4, 4, 2))
    floor = points[:, 2] == 0
    node = int(np.flatnonzero(floor & (np.abs(points[:, :2] - 0.5).max(axis=1) < 1e-9))[0])
    points[node, 0] = 0.8  # beyond the next one
    notes = hc.regularize((points, cells), boundary="fixed").report.notes
    ids = f"{node}, {node + 1}"
    assert f"no valid mesh has these nodes where they are held: 2 (ids {ids}); faces there are turned over" in notes
