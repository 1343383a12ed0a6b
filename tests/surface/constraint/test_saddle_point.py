"""One step of remeshing as a linear problem: what is minimized, directly and by iterations, and who stays."""

import numpy as np
import pytest
from meshes.surfaces import grid, icosphere, mixed_sphere, quad_sphere, shaken

from hexconformal.geometry import CURVE, enclosed_volume
from surface.constraint.features import curve_tangents, find_features, held_projectors
from surface.constraint.saddle_point import ConstrainedSystem, constraint_normals, displacement
from surface.energy.barrier import Barrier
from surface.energy.target import target_shapes


@pytest.fixture(scope="module")
def problem():
    """A matrix, loads, held directions and stiffnesses of a shaken sphere."""
    points, cells = shaken(mixed_sphere(4), 0.05)
    energy = Barrier(cells, target_shapes("equilateral", points, cells), len(points))
    held = held_projectors(
        constraint_normals(points, points, cells, "linear"), points, find_features(points, cells, None)
    )
    stiffness = np.random.default_rng(0).uniform(1.0, 5.0, len(points))
    return energy.hessian(points), -energy.gradient(points), held, stiffness


def residual(problem, v):
    hessian, rhs, held, stiffness = problem
    return (hessian @ v.ravel()).reshape(-1, 3) + stiffness[:, None] * np.einsum("nij,nj->ni", held, v) - rhs


@pytest.mark.parametrize(
    "solve", [ConstrainedSystem.solve_directly, lambda linear, rhs: linear.solve_iteratively(rhs, 1e-9)]
)
def test_the_displacement_is_stationary(problem, solve):
    hessian, rhs, held, stiffness = problem
    v = solve(ConstrainedSystem(hessian, held, stiffness, np.ones(len(rhs), dtype=bool)), rhs)
    assert np.abs(v).max() > 1e-3
    assert np.abs(residual(problem, v)).max() < 1e-7 * np.abs(problem[1]).max()


def test_without_relaxation_nobody_moves_in_a_held_direction_and_who_stays_stays(problem):
    hessian, rhs, held, _ = problem
    moving = np.arange(len(rhs)) % 5 > 0
    fewer = moving & (np.arange(len(rhs)) % 7 > 0)
    linear = ConstrainedSystem(hessian, held, None, moving)
    for some, v in ((moving, linear.solve_iteratively(rhs, 1e-9)), (fewer, linear.solve_iteratively(rhs, 1e-9, fewer))):
        assert (v[~some] == 0).all()
        assert np.abs(v[some]).max() > 1e-3
        assert np.abs(np.einsum("nij,nj->ni", held, v)).max() < 1e-12
        open_ = np.eye(3) - held
        left = np.einsum("nij,nj->ni", open_, (hessian @ v.ravel()).reshape(-1, 3) - rhs)
        assert np.abs(left[some]).max() < 1e-7 * np.abs(rhs).max()


def test_nodes_of_a_curve_move_along_its_tangent_half_way():
    # Part of a sphere between four great circles.
    points, cells, inner = grid(8, jitter=0.3)
    points = 2 * points - [1, 1, -1]
    points[~inner, :2] += 0.05 * np.sin(5 * points[~inner, :2]) * (np.abs(points[~inner, :2]) < 1)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    features = find_features(points, cells, None)
    curve = features.kind == CURVE
    assert curve.sum() == 28
    energy = Barrier(cells, target_shapes("equilateral", points, cells), len(points))
    v = displacement(energy, points, cells, features, 1e-12)[0][curve]
    assert np.linalg.norm(v, axis=1).max() > 0.02
    away = []
    for share in (0.0, 0.5):
        moved = points.copy()
        moved[curve] += share * v
        t = curve_tangents(moved, features)[curve]
        away.append(np.linalg.norm(v - (v * t).sum(axis=1, keepdims=True) * t, axis=1).max())
    assert away[0] > 0.02
    assert away[1] < 0.005 * away[0]


@pytest.mark.parametrize("surface", [icosphere(2), quad_sphere(6), mixed_sphere(6)])
def test_simpson_normal_gives_the_change_of_volume_exactly(surface):
    points, cells = surface
    v = 0.3 * np.random.default_rng(1).normal(size=points.shape)
    change = enclosed_volume(points + v, cells) - enclosed_volume(points, cells)
    assert (v * constraint_normals(points, points + v, cells, "simpson")).sum() == pytest.approx(change, abs=2e-14)
    assert abs((v * constraint_normals(points, points + v, cells, "middle")).sum() - change) > 1e-6


def test_the_middle_normal_is_orthogonal_to_third_order():
    """Gruber & Aulisa: <f(x + t v) - f(x), N(x + t v / 2)> = O(t^3), with the old normal only O(t^2)."""

    def f(u, v):
        return np.stack([u, v, 0.3 * u**2 - 0.2 * u * v + 0.5 * v**2 + 0.1 * u**3 + 0.2 * v**2 * u], axis=-1)

    def normal(u, v):
        n = np.stack([-(0.6 * u - 0.2 * v + 0.3 * u**2 + 0.2 * v**2), -(-0.2 * u + v + 0.4 * u * v), 1.0])
        return n / np.linalg.norm(n)

    t = np.array([0.1, 0.05, 0.025, 0.0125])
    chord = [f(0.2 + 0.7 * s, 0.1 - 0.4 * s) - f(0.2, 0.1) for s in t]
    middle = [abs(c @ normal(0.2 + 0.35 * s, 0.1 - 0.2 * s)) for c, s in zip(chord, t, strict=True)]
    old = [abs(c @ normal(0.2, 0.1)) for c in chord]
    assert np.log2(np.divide(middle[:-1], middle[1:])).min() > 2.9
    assert np.log2(np.divide(old[:-1], old[1:])).max() < 2.2
