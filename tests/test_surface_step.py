"""One step of remeshing as a linear problem: what is minimized, directly and by iterations, and who stays."""

import numpy as np
import pytest
from surface_shapes import mixed_sphere, shaken

from surface import step
from surface.barrier import Barrier
from surface.features import detect_features, holding
from surface.geometry import transport_vectors
from surface.reference import reference_shapes
from surface.step import Linear, solve_constrained


@pytest.fixture(scope="module")
def problem():
    """A matrix, loads, held directions and stiffnesses of a shaken sphere."""
    points, cells = shaken(mixed_sphere(4), 0.05)
    energy = Barrier(cells, reference_shapes("equilateral", points, cells), len(points))
    held = holding(transport_vectors(points, points, cells, "linear"), points, detect_features(points, cells, None))
    stiffness = np.random.default_rng(0).uniform(1.0, 5.0, len(points))
    return energy.hessian(points), -energy.gradient(points), held, stiffness


def residual(problem, v):
    hessian, rhs, held, stiffness = problem
    return (hessian @ v.ravel()).reshape(-1, 3) + stiffness[:, None] * np.einsum("nij,nj->ni", held, v) - rhs


@pytest.mark.parametrize("direct", [step.DIRECT, 0])
def test_the_displacement_is_stationary(problem, direct, monkeypatch):
    monkeypatch.setattr(step, "DIRECT", direct)
    v = solve_constrained(*problem, tolerance=1e-9)
    assert np.abs(v).max() > 1e-3
    assert np.abs(residual(problem, v)).max() < 1e-7 * np.abs(problem[1]).max()


def test_without_relaxation_nobody_moves_in_a_held_direction_and_who_stays_stays(problem):
    hessian, rhs, held, _ = problem
    moving = np.arange(len(rhs)) % 5 > 0
    fewer = moving & (np.arange(len(rhs)) % 7 > 0)
    linear = Linear(hessian, held, None, moving)
    for some, v in ((moving, linear.solve(rhs, 1e-9)), (fewer, linear.solve(rhs, 1e-9, fewer))):
        assert (v[~some] == 0).all()
        assert np.abs(v[some]).max() > 1e-3
        assert np.abs(np.einsum("nij,nj->ni", held, v)).max() < 1e-12
        open_ = np.eye(3) - held
        left = np.einsum("nij,nj->ni", open_, (hessian @ v.ravel()).reshape(-1, 3) - rhs)
        assert np.abs(left[some]).max() < 1e-7 * np.abs(rhs).max()
