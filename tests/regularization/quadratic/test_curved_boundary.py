"""What keeps the boundary of quadratic hexahedra: which nodes are held, what distances are measured, what is told."""

import numpy as np
import pytest
import pyvista as pv
from meshes.quadratic_cells import curved_cylinder

import hexconformal as hc
from hexconformal.generate import box
from hexconformal.geometry import hausdorff
from hexconformal.mesh import boundary_quads, find_regions
from hexconformal.regularization.quadratic.curved_boundary import CurvedBoundary
from hexconformal.regularization.quadratic.curved_surface import largest_bend
from hexconformal.regularization.quadratic.cut_mesh import CutMesh
from hexconformal.regularization.quadratic.schedule import QuadraticSchedule


def boundary_of(mesh, **options):
    return CurvedBoundary.of(mesh, hc.Options(**options), QuadraticSchedule())


def test_what_the_user_holds_is_held():
    mesh = curved_cylinder(20)
    held = mesh.points[:, 0] > 0.3
    free = boundary_of(mesh, fixed=held).admissible.free(len(mesh.points))
    assert not free[held].any()
    assert free[~held].any()


def test_what_is_held_afterwards_does_not_slide_either():
    mesh = curved_cylinder(20)
    boundary = boundary_of(mesh)
    side = np.abs(np.linalg.norm(mesh.points[:, :2], axis=1) - 1.0) < 1e-9
    held = side & (mesh.points[:, 0] > 0.0)
    assert boundary.admissible.free(len(side))[held].any()
    again = boundary.with_held(held)
    assert not again.admissible.free(len(side))[held].any()
    moved = boundary.start + [0.01, 0.02, 0.0]
    # What is brought back to the surface is not what is held: that is where it was before.
    for one, stays in ((boundary, False), (again, True)):
        directions = one.sliding.admissible(moved)
        assert (not directions.free(len(side))[held].any()) == stays


def test_distances_are_those_of_curved_faces():
    mesh = curved_cylinder(20)
    boundary, moved = boundary_of(mesh, hausdorff=0.05), mesh.points.copy()
    side = np.abs(np.linalg.norm(moved[:, :2], axis=1) - 1.0) < 1e-9
    moved[side, :2] *= 1.02
    diagonal = np.linalg.norm(np.ptp(mesh.points, axis=0))
    assert boundary.distance(moved) == pytest.approx(0.02 / diagonal, rel=0.05)
    assert 0.1 * 0.02 / diagonal < boundary.mean_distance(moved) < 0.02 / diagonal
    assert boundary.distance(mesh.points) == 0.0


def test_a_region_is_all_parts_of_its_cells():
    points, cells = box((3, 2, 2))
    mesh = hc.elevated((points, cells), 27)
    first = (points[cells].mean(axis=1)[:, 0] < 0.4).astype(np.int64)
    boundary = boundary_of(mesh, interfaces=first)
    regions = find_regions(hc.HexMesh(points, cells), first)
    (row,), _ = boundary.interface_rows(regions, mesh.points)
    assert (row.quads, row.moved, row.distance) == (4, 0, 0.0)


def test_kinds_of_faces_inside_are_those_of_their_parts():
    points, cells = box((2, 2, 1))
    mesh = hc.elevated((points, cells), 20)
    labels = np.array([0, 1, 2, 2])
    boundary = boundary_of(mesh, interfaces=labels)
    middle = np.abs(mesh.points[:, :2] - 0.5).max(axis=1) < 1e-9
    inner = middle & (np.abs(mesh.points[:, 2] - 0.5) < 1e-9)
    assert inner.sum() == 1
    (node,) = np.flatnonzero(inner)
    where = np.flatnonzero(boundary.admissible.nodes == node)
    # Three regions meet there, along the third axis.
    directions = np.zeros((len(mesh.points), 3))
    directions[node] = 1.0
    np.testing.assert_allclose(boundary.admissible.project(directions)[node], [0, 0, 1], atol=1e-12)
    assert len(where) == 1


def test_tags_of_quadrilaterals_are_those_of_all_their_parts():
    points, cells = box((4, 2, 1))
    quads, _ = boundary_quads(cells)
    lid = quads[(points[quads][:, :, 2] == 1.0).all(axis=1)]
    hexahedra, flat = np.insert(cells, 0, 8, axis=1).ravel(), np.insert(lid, 0, 4, axis=1).ravel()
    types = np.repeat(np.array([12, 9], np.uint8), [len(cells), len(lid)])
    grid = pv.UnstructuredGrid(np.concatenate([hexahedra, flat]), types, points)
    grid.cell_data["tag"] = [*np.zeros(len(cells), int), *np.where(points[lid].mean(axis=1)[:, 0] > 0.5, 2, 1)]
    mesh = hc.elevated(hc.as_hex_mesh(grid), 20)
    boundary = boundary_of(mesh)
    directions = boundary.admissible.project(np.ones_like(mesh.points))
    on_lid = (mesh.points[:, 2] == 1.0) & (np.abs(mesh.points[:, 0] - 0.5) < 0.4) & (mesh.points[:, 1] % 1.0 > 0.1)
    between = on_lid & (np.abs(mesh.points[:, 0] - 0.5) < 1e-9)
    assert between.sum() == 3
    np.testing.assert_allclose(directions[between], np.tile([0.0, 1.0, 0.0], (3, 1)), atol=1e-12)
    others = on_lid & ~between
    np.testing.assert_allclose(directions[others], np.tile([1.0, 1.0, 0.0], (others.sum(), 1)), atol=1e-12)


def test_the_bound_is_less_what_parts_are_off():
    mesh = curved_cylinder(20)
    boundary = boundary_of(mesh, hausdorff=0.005)
    normalized, bend = boundary.normalized, largest_bend(mesh, boundary_quads(mesh.table)[0])
    assert bend > 0.05
    off = bend / (normalized.diagonal * normalized.unit) / boundary.parts**2
    assert boundary.boundary.barrier.bound / normalized.diagonal == pytest.approx(0.005 - off, rel=1e-9)
    assert boundary.bound == 0.005


@pytest.mark.parametrize("bound", [0.05, 0.2])
def test_faces_inside_are_measured_as_they_bend(bound):
    # What is outside is flat; the middle of the face between two cells stands out, and moves along the face.
    mesh = hc.elevated(box((1, 1, 2), (2.0, 2.0, 4.0)), 27)
    (middle,) = np.flatnonzero(np.abs(mesh.points - [1.0, 1.0, 2.0]).max(axis=1) < 1e-9)
    before = mesh.points.copy()
    before[middle, 2] += 0.3
    mesh, after = mesh.replaced(before), before.copy()
    after[middle] += [0.3, 0.0, -0.3 * 0.3**2]
    boundary, cut = boundary_of(mesh, interfaces=np.array([0, 1]), hausdorff=bound), CutMesh(mesh, 32)
    nodes, quads = np.unique(cut.faces(boundary.sheets).nodes, return_inverse=True)
    apart = hausdorff(cut.matrix(nodes) @ after, cut.matrix(nodes) @ before, quads.reshape(-1, 4)) / boundary.diagonal
    assert apart > 0.01
    assert boundary.distance(after) == pytest.approx(apart, abs=0.02 * bound)
    assert boundary.distance(before) == 0.0


def test_the_barrier_samples_nodes_of_parts_that_are_none_of_the_mesh_and_draws_none():
    boundary = boundary_of(curved_cylinder(20), hausdorff=0.02)
    forward, faces = boundary.boundary.barrier.forward, boundary.boundary.barrier.original.faces
    assert (forward.weights.max(axis=1) == 1.0).all()
    assert not forward.attraction.any()
    places = np.take_along_axis(faces[forward.faces], forward.weights.argmax(axis=1)[:, None], axis=1).ravel()
    skin = np.unique(boundary.normalized.quads)
    np.testing.assert_array_equal(np.sort(places), skin[skin >= len(boundary.start)])
