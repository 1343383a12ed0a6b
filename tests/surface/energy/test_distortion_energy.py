"""The conformal energies of a surface: derivatives, majorization, and one step of the method of Gruber & Aulisa."""

import numpy as np
import pytest
from meshes.surfaces import grid, icosphere, mixed_sphere, shaken

from hexconformal.geometry import edge_table, enclosed_volume, mean_edge_length
from surface.constraint.features import find_features
from surface.constraint.saddle_point import displacement
from surface.energy.barrier import Barrier
from surface.energy.distortion_energy import Quaternionic
from surface.energy.target import target_shapes


def energies(surface):
    points, cells = surface
    shapes = target_shapes("equilateral", points, cells)
    n = len(points)
    return {
        "quaternionic": Quaternionic(cells, shapes, n),
        "metric": Quaternionic(cells, shapes, n, points),
        "barrier": Barrier(cells, shapes, n),
        "severe": Barrier(cells, shapes, n, c=0.5),
        "mild": Barrier(cells, shapes, n, m=0.05, c=0.1),
    }


@pytest.mark.parametrize("name", ["quaternionic", "metric", "barrier", "severe", "mild"])
def test_gradient_is_the_derivative(name):
    points, cells = shaken(mixed_sphere(5), 0.05)
    energy = energies((points, cells))[name]
    d = np.random.default_rng(3).normal(size=points.shape)
    errors = []
    for step in (1e-4, 5e-5):
        slope = (energy.value(points + step * d) - energy.value(points - step * d)) / (2 * step)
        errors.append(abs(slope - (energy.gradient(points) * d).sum()))
    assert errors[1] < 1e-3 * abs((energy.gradient(points) * d).sum())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.3)


def test_where_the_worst_are_emphasized_they_count_more_the_worse_they_are():
    points, cells = shaken(mixed_sphere(5), 0.05)
    energy = energies((points, cells))["barrier"]
    plain = energy.densities(points)
    relative = plain / energy.frames.weights
    energy.emphasize_worst = True
    energy.adapt(points)
    counted = (energy.densities(points) / plain)[np.argsort(relative)]
    assert 1.0 <= counted[0] < 1.1
    assert (np.diff(counted) >= -1e-12).all()
    assert counted[-1] == pytest.approx(1 + relative.max() / 2, rel=1e-12)


def test_frozen_normals_majorize():
    points, cells = shaken(mixed_sphere(5), 0.1)
    energy = energies((points, cells))["quaternionic"]
    gradient, hessian, value = energy.gradient(points), energy.hessian(points), energy.value(points)
    rng = np.random.default_rng(4)
    for size in (1e-3, 0.1, 1.0, 10.0):
        v = size * rng.normal(size=points.shape)
        model = value + (gradient * v).sum() + v.ravel() @ (hessian @ v.ravel()) / 2
        assert energy.value(points + v) <= model * (1 + 1e-12)


@pytest.mark.parametrize("name", ["quaternionic", "barrier", "severe", "mild"])
def test_second_derivatives_are_symmetric_and_semidefinite(name):
    points, cells = shaken(mixed_sphere(3), 0.1)
    hessian = energies((points, cells))[name].hessian(points).toarray()
    assert np.abs(hessian - hessian.T).max() < 1e-12 * np.abs(hessian).max()
    assert np.linalg.eigvalsh(hessian)[0] > -1e-10 * np.abs(hessian).max()


def test_step_in_the_plane_is_the_graph_laplacian_embedding():
    """Tutte: equilateral reference, fixed boundary, one step; every inner node the mean of its neighbours."""
    points, cells, inner = grid(8, jitter=0.3)
    energy = Quaternionic(cells, target_shapes("equilateral", points, cells), len(points))
    features = find_features(points, cells, None, boundary="fixed")
    moved = points + displacement(energy, points, cells, features, 1e-5)[0]
    edges = edge_table(cells).nodes
    total, degree = np.zeros_like(points), np.zeros(len(points))
    for a, b in ((0, 1), (1, 0)):
        np.add.at(total, edges[:, a], moved[edges[:, b]])
        np.add.at(degree, edges[:, a], 1)
    assert np.abs(moved - total / degree[:, None])[inner].max() < 1e-12
    x = moved[cells.triangles]
    assert (np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])[:, 2] > 0).all()


def test_one_step_on_a_sphere_removes_most_of_the_distortion():
    points, cells = shaken(icosphere(3), 0.0294)
    assert len(points) == 642
    energy = energies((points, cells))["metric"]
    h = mean_edge_length(points, cells)
    features = find_features(points, cells, None)
    before = energy.value(points)
    v, _ = displacement(energy, points, cells, features, 1e-5 * h**2, "middle")
    after = energy.value(points + v)
    assert after < 3.64 / 16.8 * before
    simpson, _ = displacement(energy, points, cells, features, 1e-8 * h**2, "simpson")
    drift = [abs(enclosed_volume(points + d, cells) - enclosed_volume(points, cells)) for d in (v, simpson)]
    assert drift[1] < 1e-6
    assert drift[1] < drift[0]


def test_step_scales_with_the_unit_of_length():
    points, cells = shaken(icosphere(2), 0.05)
    features = find_features(points, cells, None)
    energy = energies((points, cells))["quaternionic"]
    v, _ = displacement(energy, points, cells, features, 1e-4)
    w, _ = displacement(energy, 1e3 * points, cells, features, 1e-4 * 1e6)
    assert np.abs(w - 1e3 * v).max() < 1e-10 * 1e3
