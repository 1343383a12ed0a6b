"""Bounds of the work of a phase."""

from dataclasses import replace

import numpy as np
import pytest
from corner_problems import formulation_of

import hexconformal as hc
from hexconformal import generate
from hexconformal.energy import CornerWeights
from hexconformal.formulation import Schedules, Work, convex_newton
from hexconformal.formulation.schedules import WorkSchedule
from hexconformal.regularization import Regularization


def test_a_share_is_taken_from_the_whole():
    whole = Work(10_000.0, 300)
    share = whole.share(0.5)
    assert share.take(4_500)
    assert not share.is_done
    assert share.take(1)
    assert share.is_done
    assert not share.take(1)
    assert whole.left == pytest.approx(10_000.0 - 4_501 - 600)
    assert not whole.is_done


def test_a_share_is_done_with_the_whole():
    whole = Work(1_000.0, 300)
    share = whole.share(1.0)
    whole.take(5_000)
    assert share.is_done
    assert not share.take(1)


def run(mesh, **bounds):
    schedules = replace(Schedules(), work=WorkSchedule(**bounds))
    regularization = Regularization(mesh, schedules=schedules)
    return list(regularization), regularization.result()


def test_newton_takes_the_steps_that_are_left():
    points, cells = generate.jittered(*generate.box((4, 4, 4)), 0.3)
    formulation = formulation_of(points, cells)
    few = formulation.with_work(Work(3 * (64 + 300) - 1.0, 300))
    assert len(list(convex_newton(few, points, CornerWeights(), decrease=-1.0))) == 3
    assert few.work.is_done
    assert not formulation.work.is_done
    assert formulation.within(2.0).work.left == 2.0 * formulation.schedules.work.least_cells


def test_a_run_that_could_go_on_with_the_worst_cells_has_not_converged():
    mesh = generate.jittered(*generate.ball(4, 2), 0.35, seed=1)
    result = run(mesh, patches=1e-9)[1]
    assert not result.converged
    assert "the work allowed" in result.report.reason
    assert result.report.after.scaled_jacobian.min <= hc.regularize(mesh).report.after.scaled_jacobian.min + 1e-9
    assert np.isfinite(result.points).all()
