"""The line search and when a minimization ends."""

from types import SimpleNamespace

import numpy as np
import pytest
from hexconformal.solver.minimizers import Iterate, Problem, initial_iterate, lbfgs, line_search

import hexconformal as hc
from hexconformal.elements.validity import is_valid
from hexconformal.generate import boundary_layer, box, jittered, sheared_cube
from hexconformal.mesh.normalized_mesh import NormalizedMesh
from hexconformal.regularization.minimize import Minimization
from hexconformal.regularization.options import Options
from hexconformal.solver.admissible import boundary_directions


def problem(value, gradient, acceptable=lambda points: True):
    """Minimize a function of one number, which is x of the only point."""

    def both(points):
        x = points[0, 0]
        return float(value(x)), np.array([[float(gradient(x)), 0.0, 0.0]])

    energy = SimpleNamespace(value_gradient=both)
    return Problem(energy, lambda field: field, lambda field: field, acceptable)


def at(p, x):
    return initial_iterate(p, np.array([[float(x), 0.0, 0.0]]))


def test_a_step_that_lowers_the_energy_enough_is_taken_whole():
    p = problem(lambda x: 0.5 * x**2, lambda x: x)
    found = line_search(p, at(p, 2.0), np.array([[-2.0, 0.0, 0.0]]))
    assert (found.points[0, 0], found.energy, found.step) == (0.0, 0.0, 1.0)


def test_a_step_that_goes_too_far_is_halved_until_it_does_not():
    # Full and half steps end at a higher energy, a quarter at a lower one.
    p = problem(lambda x: x**2, lambda x: 2 * x)
    found = line_search(p, at(p, 1.0), np.array([[-6.0, 0.0, 0.0]]))
    assert found.step == 0.25
    assert found.energy < 1.0


def test_a_step_up_is_never_taken():
    p = problem(lambda x: x**2, lambda x: 2 * x)
    before = at(p, 1.0)
    found = line_search(p, before, np.array([[1.0, 0.0, 0.0]]))
    assert found.step == 0.0
    assert found.points is before.points
    # A tiny rise counts as a rise, though the slope be large.
    p = problem(lambda x: 1.0 + 1e-9 * (x != 0.0), lambda x: 1.0)
    assert line_search(p, at(p, 0.0), np.array([[-1e-3, 0.0, 0.0]])).step == 0.0


def test_what_is_not_acceptable_or_not_finite_is_not_taken():
    p = problem(lambda x: -x, lambda x: -1.0, acceptable=lambda points: points[0, 0] < 0.3)
    assert line_search(p, at(p, 0.0), np.array([[1.0, 0.0, 0.0]])).step == 0.25
    for nonsense in (np.nan, -np.inf):
        p = problem(lambda x, n=nonsense: n if x > 0.3 else -x, lambda x: -1.0)
        assert line_search(p, at(p, 0.0), np.array([[1.0, 0.0, 0.0]])).step == 0.25
    p = problem(lambda x: -x, lambda x: np.nan if x > 0.3 else -1.0)
    assert line_search(p, at(p, 0.0), np.array([[1.0, 0.0, 0.0]])).step == 0.25


def test_at_the_level_of_rounding_the_slope_decides():
    # The energy is as good as constant: a step is right if it does not make the slope as steep the other way.
    p = problem(lambda x: 1e6 + 1e-12 * (x > 0), lambda x: x - 1.0)
    assert line_search(p, at(p, 0.0), np.array([[1.0, 0.0, 0.0]])).step == 1.0
    assert line_search(p, at(p, 0.0), np.array([[4.0, 0.0, 0.0]])).step == 0.25


def test_lbfgs_learns_no_negative_curvature():
    # On top of a cosine the slope falls with x: a pair from there would turn the direction round, for a search in vain.
    evaluated = []

    def value(x):
        evaluated.append(x)
        return np.cos(x)

    p = problem(value, lambda x: -np.sin(x))
    energies = [iterate.energy for iterate, _ in zip(lbfgs(p, at(p, 0.3)), range(12), strict=False)]
    assert energies[-1] == pytest.approx(-1.0, abs=1e-12)
    assert evaluated[:4] == sorted(evaluated[:4])
    assert len(evaluated) < 40


def minimization(points, cells, boundary="fixed", **options):
    normalized = NormalizedMesh(hc.HexMesh(points, cells))
    constraint = boundary_directions(normalized.points, normalized.quads, boundary)
    return Minimization(normalized, constraint, Options(boundary=boundary, **options), normalized.points), normalized


def test_valid_cells_are_watched_beside_folded_ones():
    points, cells = jittered(*box((4, 4, 4)), 0.7, seed=1, valid=False)
    run, normalized = minimization(points, cells, energy="quaternionic", method="lbfgs")
    valid = is_valid(normalized.points, cells)
    assert 0 < valid.sum() < len(cells)
    broken = normalized.points.copy()
    first = cells[np.flatnonzero(valid)[-1]]
    broken[first[0]] += 2 * (broken[first[6]] - broken[first[0]])
    assert run._acceptable(normalized.points)
    assert not run._acceptable(broken)
    # The folded ones may stay as they are.
    for _, step in zip(range(3), run, strict=False):
        assert is_valid(step.points, cells)[valid].all()


def test_the_end_is_told_and_reached():
    run, _ = minimization(*sheared_cube(5), boundary="slide", emphasis="mean", gradient_tolerance=1e-3)
    gradients = [step.gradient for step in run]
    assert run.converged
    assert "gradient fell below 0.001" in run.reason
    assert len(gradients) > 2
    assert gradients[-1] <= 1e-3 < gradients[-2]


def test_a_stall_ends_it_where_the_worst_cells_are_raised_afterwards():
    points, cells = jittered(*box((5, 5, 5)), 0.45, seed=2, keep_boundary=False)
    run, _ = minimization(points, cells, emphasis="worst", gradient_tolerance=1e-12)
    energies = [step.energy for step in run]
    assert run.reason == "the energy stalls"
    drops = -np.diff(energies) / np.array(energies[:-1])
    assert (drops[-2:] < 3e-3).all()
    assert (drops[:-2] >= 3e-3).any()


def test_newton_takes_over_from_lbfgs():
    run, _ = minimization(*sheared_cube(6), boundary="fixed", emphasis="mean", gradient_tolerance=1e-10)
    phases = [step.phase for step in run]
    assert phases[:5] == ["lbfgs"] * 5
    assert phases[-1] == "newton"


def test_newton_takes_over_after_so_many_iterations_at_the_latest(monkeypatch):
    monkeypatch.setattr("hexconformal.regularization.minimize._HANDOVER", 3)
    run, _ = minimization(*sheared_cube(6), boundary="fixed", emphasis="mean", gradient_tolerance=1e-10)
    assert [step.phase for step, _ in zip(run, range(4), strict=False)] == ["lbfgs"] * 3 + ["newton"]


def test_large_cells_count_more_by_their_volume():
    points, cells = boundary_layer((3, 3, 4), 4.0)
    points, cells = jittered(points, cells, 0.2)
    run, normalized = minimization(points, cells, weight="volume")
    plain, _ = minimization(points, cells, weight="reference")
    volumes = hc.quality((normalized.points, cells)).volume
    each, weighted = (one._energy.cell_energies(normalized.points) for one in (plain, run))
    np.testing.assert_allclose(weighted, each * volumes / volumes.mean(), rtol=1e-12)


def test_thin_cells_are_stiffer_in_the_metric():
    points, cells = boundary_layer((3, 3, 4), 4.0)
    run, normalized = minimization(points, cells)
    stiffness, volumes = run._stiffness(), hc.quality((normalized.points, cells)).volume
    np.testing.assert_allclose(stiffness, volumes ** (-2 / 3), rtol=1e-9)
    assert isinstance(initial_iterate(problem(lambda x: x, lambda x: 1.0), np.zeros((1, 3))), Iterate)
