"""The band around a surface: derivatives, limits, and what nodes on curves and corners feel."""

import numpy as np
import pytest

from hexconformal import generate
from hexconformal.band import Band
from hexconformal.block_matrix import BlockMatrix
from hexconformal.boundary import flat_normals
from hexconformal.closest import Surface
from hexconformal.constraint import free_directions
from hexconformal.features import find_features
from hexconformal.hausdorff import hausdorff
from hexconformal.topology import boundary_quads


@pytest.fixture
def cylinder():
    points, cells = generate.cylinder(4, 3, 6)
    return points, cells, boundary_quads(cells)[0]


def band_of(points, quads, bound=0.05):
    return Band(Surface(points, quads), bound, find_features(points, quads))


def test_nothing_is_felt_on_the_surface_itself(cylinder):
    points, cells, quads = cylinder
    matrix, forces = BlockMatrix.of_cells(cells, np.ones(len(points), dtype=bool)), np.zeros_like(points)
    assert band_of(points, quads).add(points, forces, matrix) < 1e-20
    assert np.abs(forces).max() < 1e-10


def test_gradient_agrees_with_differences(cylinder):
    points, cells, quads = cylinder
    rng = np.random.default_rng(0)
    moved = points + 0.004 * rng.normal(size=points.shape)
    band = band_of(points, quads)
    matrix, forces = BlockMatrix.of_cells(cells, np.ones(len(points), dtype=bool)), np.zeros_like(points)
    value = band.add(moved, forces, matrix)
    direction = rng.normal(size=points.shape)
    slope = np.einsum("ij,ij->", forces, direction)
    step = 1e-7
    ahead, behind = band.value(moved + step * direction), band.value(moved - step * direction)
    assert value == pytest.approx(band.value(moved), rel=1e-12)
    assert (ahead - behind) / (2 * step) == pytest.approx(slope, rel=1e-4)


def test_the_limit_is_a_wall(cylinder):
    points, cells, quads = cylinder
    band = band_of(points, quads, bound=0.05)
    matrix, forces = BlockMatrix.of_cells(cells, np.ones(len(points), dtype=bool)), np.zeros_like(points)
    band.add(points, forces, matrix)
    grown, radius = points.copy(), np.hypot(*points[:, :2].T)
    node = np.flatnonzero(np.isclose(radius, radius.max()) & np.isclose(points[:, 2], 1.0))[0]
    outward = np.append(points[node, :2] / np.linalg.norm(points[node, :2]), 0.0)
    grown[node] += 0.04 * outward
    assert np.isfinite(band.value(grown))
    grown[node] += 0.02 * outward
    assert band.value(grown) == np.inf


def test_the_penalty_rises_without_bound_before_the_wall(cylinder):
    points, _, quads = cylinder
    band = band_of(points, quads, bound=0.05)
    radius = np.hypot(*points[:, :2].T)
    node = np.flatnonzero(np.isclose(radius, radius.max()) & np.isclose(points[:, 2], 1.0))[0]
    outward = np.append(points[node, :2] / np.linalg.norm(points[node, :2]), 0.0)
    values = []
    for share in (0.9, 0.97, 0.979, 0.9799):
        grown = points.copy()
        grown[node] += share * 0.05 * outward
        values.append(band.value(grown))
    assert values[1] > 2 * values[0]
    assert values[2] > 5 * values[1]
    assert values[3] > 5 * values[2]
    assert np.isfinite(values[3])


def test_excess_is_the_hausdorff_distance_in_bounds(cylinder):
    points, _, quads = cylinder
    moved = points + 0.01 * np.random.default_rng(1).normal(size=points.shape)
    assert band_of(points, quads, 0.05).excess(moved) == pytest.approx(hausdorff(moved, points, quads) / 0.05, rel=1e-6)


def test_far_samples_are_skipped_without_changing_the_value(cylinder):
    points, cells, quads = cylinder
    rng = np.random.default_rng(2)
    lazy = band_of(points, quads)
    matrix, forces = BlockMatrix.of_cells(cells, np.ones(len(points), dtype=bool)), np.zeros_like(points)
    moved = points
    for _ in range(5):
        moved = moved + 0.003 * rng.normal(size=points.shape)
        lazy.add(moved, forces, matrix)
    fresh = band_of(points, quads)
    fresh._ahead_distance[:] = fresh._back_distance[:] = np.inf  # nothing may be skipped
    fresh._limit = lazy._limit
    assert lazy.value(moved) == pytest.approx(fresh.value(moved), rel=1e-9)


def test_a_patch_feels_what_its_nodes_feel(cylinder):
    points, cells, quads = cylinder
    moved = points + 0.004 * np.random.default_rng(3).normal(size=points.shape)
    band = band_of(points, quads)
    matrix, forces = BlockMatrix.of_cells(cells, np.ones(len(points), dtype=bool)), np.zeros_like(points)
    band.add(moved, forces, matrix)
    moving = np.zeros(len(points), dtype=bool)
    moving[quads[5]] = True
    around = np.flatnonzero(moving[cells].any(axis=1))
    nodes = np.unique(cells[around])
    local = np.full(len(points), -1)
    local[nodes] = np.arange(len(nodes))
    patch = band.restricted(nodes, moving, moved)
    small, felt = BlockMatrix.of_cells(local[cells[around]], np.ones(len(nodes), dtype=bool)), np.zeros((len(nodes), 3))
    patch.add(moved[nodes], felt, small)
    assert np.abs(felt[local[moving.nonzero()[0]]] - forces[moving]).max() < 1e-9 * np.abs(forces).max()


def test_a_finer_surface_draws_the_boundary_to_it():
    points, cells = generate.ball(3, 2)
    quads = boundary_quads(cells)[0]
    fine, fine_cells = generate.ball(9, 3)
    fine_quads = boundary_quads(fine_cells)[0]
    band = Band(Surface(points, quads), 0.05, reference=Surface(1.02 * fine, fine_quads))
    matrix, forces = BlockMatrix.of_cells(cells, np.ones(len(points), dtype=bool)), np.zeros_like(points)
    band.add(points, forces, matrix)
    outward = np.einsum("ij,ij->i", -forces, points)
    surface = np.unique(quads)
    assert (outward[surface] > 0).all()


def test_flat_patches_leave_their_planes_open(cylinder):
    points, _, quads = cylinder
    features = find_features(points, quads)
    free = free_directions(flat_normals(points, quads, features.patches, 1e-6))
    end = np.isclose(np.abs(points[:, 2] - points[:, 2].mean()), np.ptp(points[:, 2]) / 2)
    surface = np.zeros(len(points), dtype=bool)
    surface[quads] = True
    assert (free[surface & end] == 2).all()
    assert (free[surface & ~end] == 3).all()
