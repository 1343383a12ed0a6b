"""The line search, and what L-BFGS makes of the steps it takes."""

import numpy as np
import pytest

from hexconformal.energy import Objective, Term
from hexconformal.solver import Problem, lbfgs, line_search


class OneNumber(Term):
    """A function of one number, which is x of the only point."""

    def __init__(self, function, derivative):
        self._function, self._derivative = function, derivative

    def value(self, points):
        return float(self._function(points[0, 0]))

    def value_gradient(self, points):
        return self.value(points), np.array([[float(self._derivative(points[0, 0])), 0.0, 0.0]])

    def add_convex(self, points, gradient, assembly):
        raise NotImplementedError

    def restricted(self, patch):
        raise NotImplementedError


def problem(value, gradient, acceptable=lambda points: True):
    return Problem(Objective((OneNumber(value, gradient),)), lambda field: field, acceptable)


def at(p, x):
    return p.at(np.array([[float(x), 0.0, 0.0]]))


BOTH = pytest.mark.parametrize("with_gradient", [True, False])


@BOTH
def test_a_step_that_lowers_the_energy_enough_is_taken_whole(with_gradient):
    p = problem(lambda x: 0.5 * x**2, lambda x: x)
    found = line_search(at(p, 2.0), np.array([[-2.0, 0.0, 0.0]]), with_gradient)
    assert (found.points[0, 0], found.energy, found.step) == (0.0, 0.0, 1.0)


@BOTH
def test_a_step_that_goes_too_far_is_halved_until_it_does_not(with_gradient):
    # Full and half steps end at a higher energy, a quarter at a lower one.
    p = problem(lambda x: x**2, lambda x: 2 * x)
    found = line_search(at(p, 1.0), np.array([[-6.0, 0.0, 0.0]]), with_gradient)
    assert found.step == 0.25
    assert found.energy < 1.0


@BOTH
def test_a_step_up_is_never_taken(with_gradient):
    p = problem(lambda x: x**2, lambda x: 2 * x)
    before = at(p, 1.0)
    found = line_search(before, np.array([[1.0, 0.0, 0.0]]), with_gradient)
    assert found.step == 0.0
    assert found.points is before.points
    # A tiny rise counts as a rise, though the slope be large.
    p = problem(lambda x: 1.0 + 1e-9 * (x != 0.0), lambda x: 1.0)
    assert line_search(at(p, 0.0), np.array([[-1e-3, 0.0, 0.0]]), with_gradient).step == 0.0


@BOTH
def test_what_is_not_acceptable_or_not_finite_is_not_taken(with_gradient):
    p = problem(lambda x: -x, lambda x: -1.0, acceptable=lambda points: points[0, 0] < 0.3)
    assert line_search(at(p, 0.0), np.array([[1.0, 0.0, 0.0]]), with_gradient).step == 0.25
    for nonsense in (np.nan, -np.inf):
        p = problem(lambda x, n=nonsense: n if x > 0.3 else -x, lambda x: -1.0)
        assert line_search(at(p, 0.0), np.array([[1.0, 0.0, 0.0]]), with_gradient).step == 0.25
    if not with_gradient:
        return
    p = problem(lambda x: -x, lambda x: np.nan if x > 0.3 else -1.0)
    assert line_search(at(p, 0.0), np.array([[1.0, 0.0, 0.0]]), with_gradient).step == 0.25


@BOTH
def test_at_the_level_of_rounding_the_slope_decides(with_gradient):
    # The energy is as good as constant: a step is right if it does not make the slope as steep the other way.
    p = problem(lambda x: 1e6 + 1e-12 * (x > 0), lambda x: x - 1.0)
    assert line_search(at(p, 0.0), np.array([[1.0, 0.0, 0.0]]), with_gradient).step == 1.0
    assert line_search(at(p, 0.0), np.array([[4.0, 0.0, 0.0]]), with_gradient).step == 0.25


def test_lbfgs_learns_no_negative_curvature():
    # On top of a cosine the slope falls with x: a pair from there would turn the direction round, for a search in vain.
    evaluated = []

    def value(x):
        evaluated.append(x)
        return np.cos(x)

    p = problem(value, lambda x: -np.sin(x))
    energies = [iterate.energy for iterate, _ in zip(lbfgs(at(p, 0.3), lambda field: field), range(12), strict=False)]
    assert energies[-1] == pytest.approx(-1.0, abs=1e-12)
    assert evaluated[:4] == sorted(evaluated[:4])
    assert len(evaluated) < 40


class Cliffs(Term):
    """The sum of (x - 1)^2 over points, of which some have a cliff at their start that cannot be passed."""

    def value(self, points):
        return float(((points[:, 0] - 1.0) ** 2).sum())

    def value_gradient(self, points):
        return self.value(points), np.column_stack([2.0 * (points[:, 0] - 1.0), np.zeros((len(points), 2))])

    def add_convex(self, points, gradient, assembly):
        raise NotImplementedError

    def restricted(self, patch):
        raise NotImplementedError


@BOTH
@pytest.mark.parametrize(("cliff", "left"), [(0.05, 0.0078125), (0.0, 0.0)])
def test_nodes_that_would_spoil_something_do_not_stop_the_others(cliff, left, with_gradient):
    start = np.zeros((6, 3))
    beyond = np.array([True, False, False, True, False, False])

    def spoiled(points):
        return beyond & (points[:, 0] > cliff)

    free = Problem(Objective((Cliffs(),)), lambda field: field, lambda points: not spoiled(points).any())
    stopped = line_search(free.at(start), np.tile([1.0, 0.0, 0.0], (6, 1)), with_gradient)
    assert stopped.step < 0.1 if cliff else stopped.step == 0.0
    known = Problem(free.objective, free.project, free.acceptable, spoiled=spoiled)
    following = line_search(known.at(start), np.tile([1.0, 0.0, 0.0], (6, 1)), with_gradient)
    assert following.step == 1.0
    np.testing.assert_array_equal(following.points[:, 0], np.where(beyond, left, 1.0))


@BOTH
@pytest.mark.parametrize(("many", "held_back"), [(8, True), (9, False)])
def test_many_nodes_that_would_spoil_something_go_with_all_others(many, held_back, with_gradient):
    beyond = np.arange(40) < many

    def spoiled(points):
        return beyond & (points[:, 0] > 0.05)

    known = Problem(
        Objective((Cliffs(),)), lambda field: field, lambda points: not spoiled(points).any(), spoiled=spoiled
    )
    following = line_search(known.at(np.zeros((40, 3))), np.tile([1.0, 0.0, 0.0], (40, 1)), with_gradient)
    assert (following.step == 1.0) == held_back
    assert (len(np.unique(following.points[:, 0])) == 2) == held_back
