"""Lowering the distortion of quadratic hexahedra and raising their worst angles: when these end, what they keep."""

from dataclasses import replace

import numpy as np
import pytest
from meshes.quadratic_cells import curved_cylinder

import hexconformal as hc
from hexconformal.energy import CornerWeights
from hexconformal.regularization.quadratic.schedule import QuadraticSchedule
from hexconformal.regularization.quadratic.setting import QuadraticSetting
from hexconformal.regularization.quadratic.stages import minimize_distortion, raise_worst


def shaken(schedule=None, amount=0.04, **options):
    """The setting of a cylinder whose nodes inside are moved at random."""
    mesh = curved_cylinder(20)
    schedule = QuadraticSchedule() if schedule is None else schedule
    skin = QuadraticSetting.of(mesh, hc.Options(boundary="fixed"), schedule).boundary.on_it
    moves = np.random.default_rng(0).uniform(-amount, amount, mesh.points.shape)
    mesh = mesh.replaced(mesh.points + ~skin[:, None] * moves)
    assert hc.quality(mesh).valid.all()
    return QuadraticSetting.of(mesh, hc.Options(**options), schedule)


def gradient(setting, points):
    return setting.problem(CornerWeights(), points).at(points).gradient_norm


def test_gradients_are_told_relative_to_the_first_though_the_boundary_is_seen_anew():
    setting = shaken(QuadraticSchedule(renewal=2))
    first = gradient(setting, setting.start)
    iterations = list(minimize_distortion(setting, setting.start, 7, 1e-9))
    assert len(iterations) == 7
    assert iterations[-1].gradient < 0.2
    for iteration in iterations:
        assert iteration.gradient == pytest.approx(gradient(setting, iteration.points) / first, rel=0.3)


def test_it_is_over_when_the_gradient_is_small_enough():
    setting = shaken(boundary="fixed", emphasis="mean")
    gradients = [one.gradient for one in minimize_distortion(setting, setting.start, 200, 1e-2)]
    assert gradients[-1] <= 1e-2 < min(gradients[:-1])
    assert list(minimize_distortion(setting, setting.start, 200, 1.0)) == []


def test_it_goes_on_for_longer_where_nothing_follows():
    auto, mean = (shaken(boundary="fixed", emphasis=emphasis) for emphasis in ("auto", "mean"))
    counts = [sum(1 for _ in minimize_distortion(one, one.start, 200, 1e-12)) for one in (auto, mean)]
    assert counts[0] < counts[1] < 200


def test_valid_cells_are_kept_in_both(monkeypatch):
    kept = []
    problem = QuadraticSetting.problem

    def seen(self, weights, points, cells=None):
        kept.append(cells)
        return problem(self, weights, points, cells)

    setting = shaken(QuadraticSchedule(stiff_rounds=2, stiff_steps=1), boundary="fixed")
    monkeypatch.setattr(QuadraticSetting, "problem", seen)
    for stage in (minimize_distortion(setting, setting.start, 2, 1e-9), raise_worst(setting, setting.start)):
        kept.clear()
        list(stage)
        assert kept
        for cells in kept:
            np.testing.assert_array_equal(cells, setting.valid(setting.start))


def test_two_rounds_with_a_stiffness_that_gain_too_little_are_the_last():
    schedule = QuadraticSchedule(stiff_steps=1, stiff_rounds=8)
    setting = shaken(replace(schedule, least_gain=1.0), boundary="fixed")
    assert [one.phase for one in raise_worst(setting, setting.start)] == ["angles", "stiffen", "stiffen"]
    setting = shaken(replace(schedule, least_gain=0.0), boundary="fixed")
    phases = [one.phase for one in raise_worst(setting, setting.start)]
    assert phases == ["angles"] + 7 * ["stiffen"]


def test_no_worst_angle_of_a_round_with_a_stiffness_is_passed_in_the_next():
    setting = shaken(QuadraticSchedule(stiff_steps=1, least_gain=1e-3), boundary="fixed")
    worst = [max(setting.worst_angles(one.points).values()) for one in raise_worst(setting, setting.start)]
    assert len(worst) > 8
    for before, after in zip(worst, worst[1:], strict=False):
        assert after < before / setting.schedule.stiffness
    assert worst[-1] < 0.5 * worst[0]
