"""Runs that conserve the volume of every region."""

from dataclasses import replace

import numpy as np
import pytest
from corner_problems import all_free, boundary_held, dense, formulation_of, jittered_cubes
from meshes.hexahedra import off_boundary

import hexconformal as hc
from hexconformal import generate
from hexconformal.energy import CornerWeights
from hexconformal.formulation import Schedules
from hexconformal.geometry import nodal_area_vectors
from hexconformal.mesh import NormalizedMesh, find_regions, region_surfaces
from hexconformal.regularization import volume_restoration
from hexconformal.regularization.acceptance import with_volume_restored
from hexconformal.regularization.volume_restoration import enclosed_volumes, restore_volumes
from hexconformal.solver import solve_blocks

LAYERS = np.array([0, 1, 1, 2])


@pytest.fixture
def layered():
    """A block of 4^3 jittered cubes in three layers across x: points, cells, labels, surfaces and volumes."""
    points, cells = jittered_cubes()
    labels = LAYERS[np.floor(generate.box((4, 4, 4))[0][cells].mean(axis=1)[:, 0] * 4).astype(int)]
    surfaces = region_surfaces(cells, labels)
    return points, cells, labels, surfaces, enclosed_volumes(points, surfaces)


def test_every_region_gets_a_volume_of_its_own(layered):
    points, cells, labels, surfaces, volumes = layered
    wanted = volumes * [1.05, 0.97, 1.02]
    found = restore_volumes(formulation_of(points, cells), points, surfaces, wanted)
    measured = hc.quality((found, cells))
    np.testing.assert_allclose(np.bincount(labels, measured.volume), wanted, rtol=1e-12)
    assert measured.valid.all()


def test_where_the_skin_stays_regions_exchange_volume(layered):
    """Pressures in all of them cancel out, so that the equations for them depend on one another."""
    points, cells, _, surfaces, volumes = layered
    exchanged = volumes + np.array([0.5, -1.0, 0.5])
    formulation = formulation_of(points, cells, boundary_held(points, cells))
    found = restore_volumes(formulation, points, surfaces, exchanged)
    np.testing.assert_allclose(enclosed_volumes(found, surfaces), exchanged, rtol=1e-12)
    assert np.array_equal(found[~off_boundary(points, cells)], points[~off_boundary(points, cells)])


def test_volumes_that_contradict_each_other_come_as_near_as_can_be(layered, monkeypatch):
    points, cells, _, surfaces, volumes = layered
    formulation = formulation_of(points, cells, boundary_held(points, cells))
    solves = []
    monkeypatch.setattr(
        volume_restoration, "solve_blocks", lambda *_, **how: solves.append(1) or solve_blocks(*_, **how)
    )
    found = restore_volumes(formulation, points, surfaces, volumes + np.array([0.5, 0.0, 0.0]))
    assert len(solves) < 5 * len(surfaces)  # it is seen that there is no progress
    after = enclosed_volumes(found, surfaces)
    assert after.sum() == pytest.approx(volumes.sum(), rel=1e-12)
    assert 0.05 < after[0] - volumes[0] < 0.5
    assert hc.quality((found, cells)).valid.all()


def test_the_change_is_that_of_least_energy(layered):
    """Compared with the minimizer of the quadratic model under three linear equations, from dense matrices."""
    points, cells, _, surfaces, volumes = layered
    exact = Schedules(volume=replace(Schedules().volume, tolerance=1e-12, iterations=1000, shift=1e-9))
    formulation = replace(formulation_of(points, cells, base_held(points)), schedules=exact)
    gaps = 1e-5 * volumes * [1.0, 0.0, -0.5]
    found = restore_volumes(formulation, points, surfaces, volumes + gaps)

    stiffness = exact.volume.stiffness / formulation.measures(points).angle.max()
    assembly = formulation.equation.assembly
    objective = formulation.objective(CornerWeights(angle=1.0, stiffness=stiffness), exact.minimization.volume_weight)
    objective.convex(points, assembly)
    free = np.repeat(points[:, 2] > 0.0, 3)
    hessian = dense(assembly.matrix)[np.ix_(free, free)]
    normals = np.stack([nodal_area_vectors(points, quads).ravel()[free] for quads in surfaces], axis=1)
    ways = np.linalg.solve(hessian, normals)
    expected = np.zeros(3 * len(points))
    expected[free] = ways @ np.linalg.solve(normals.T @ ways, gaps)
    difference = (found - points).ravel() - expected
    assert np.linalg.norm(difference) < 1e-4 * np.linalg.norm(expected)


def base_held(points):
    """Projectors that hold the nodes of the base."""
    return all_free(points) * (points[:, 2] > 0.0)[:, None, None]


def held_layer(points, cells, labels):
    """Projectors that hold the nodes of the first layer."""
    projectors = all_free(points)
    projectors[np.unique(cells[labels == 0])] = 0.0
    return projectors


def test_a_region_that_is_held_is_named_and_the_others_are_restored(layered):
    points, cells, labels, surfaces, _ = layered
    names = {"material": labels + 7}
    normalized = NormalizedMesh(hc.HexMesh(points, cells, cell_data=names))
    swollen = normalized.points * [1.01, 1.0, 1.0]
    formulation = formulation_of(swollen, cells, held_layer(points, cells, labels))
    same, notes = with_volume_restored(swollen, normalized, formulation, find_regions(normalized.mesh))
    after, before = (enclosed_volumes(x, surfaces) for x in (same, normalized.points))
    assert after[0] == pytest.approx(1.01 * before[0], rel=1e-12)
    np.testing.assert_allclose(after[1:], before[1:], rtol=1e-10)
    assert notes[0].startswith("volume: changes of 3 regions, the largest +1.0e-02, were made up for by moving nodes")
    assert notes[1].startswith("volumes of regions are not those of the input, but differ, 7 by +1.0e-02: hausdorff")


def test_more_regions_than_the_schedule_allows_are_kept_as_one(layered):
    points, cells, labels, _, _ = layered
    normalized = NormalizedMesh(hc.HexMesh(points, cells, cell_data={"material": labels}))
    few = Schedules(volume=replace(Schedules().volume, regions=2))
    formulation = replace(formulation_of(points, cells), schedules=few)
    swollen = normalized.points * [1.01, 1.0, 1.0]
    same, notes = with_volume_restored(swollen, normalized, formulation, find_regions(normalized.mesh))
    whole = [normalized.quads]
    np.testing.assert_allclose(enclosed_volumes(same, whole), enclosed_volumes(normalized.points, whole), rtol=1e-12)
    assert notes[0] == "volume: that of all 3 regions together is kept, as they are over 2"
    assert len(notes) == 2


def two_halves():
    """A cylinder, its mantle uneven, in two halves one above the other."""
    points, cells = generate.jittered(*generate.cylinder(4, 3, 6), 0.3, seed=2)
    height = points[:, 2]
    mantle = np.isclose(np.hypot(*points[:, :2].T), 1.0) & (height > height.min()) & (height < height.max())
    points[mantle] += 0.03 * np.random.default_rng(2).normal(size=(mantle.sum(), 3))
    upper = points[cells].mean(axis=1)[:, 2] > height.mean()
    return hc.HexMesh(points, cells, cell_data={"material": upper.astype(int)})


@pytest.mark.long
def test_a_run_conserves_the_volume_of_every_region_if_asked_to():
    mesh = two_halves()
    plain = hc.regularize(mesh).report
    assert min(abs(row.volume_change) for row in plain.regions) > 1e-4
    report = hc.regularize(mesh, conserve_volume=True).report
    assert max(abs(row.volume_change) for row in report.regions) < 1e-10
    assert abs(report.volume_change) < 1e-10
    assert report.hausdorff <= 0.005
    assert report.after.invalid == 0
    whole = hc.regularize(mesh, conserve_volume=True, interfaces="ignore").report
    assert whole.regions == ()
    assert abs(whole.volume_change) < 1e-13
