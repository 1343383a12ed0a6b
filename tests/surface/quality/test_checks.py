"""Surfaces that cannot be remeshed are refused, with the reason and the cells; what is only doubtful is noted."""

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.surfaces import grid, icosphere, mixed_sphere, no_cells, quad_cube

import surface
from hexconformal.common.errors import MeshError, OptionError
from hexconformal.geometry import Faces
from surface.quality.checks import require_sound

CLOUD = np.random.default_rng(0).random((8, 3))


def checked(points, *cells):
    return require_sound(surface.as_surface_mesh((points, *cells)))


def sphere():
    points, cells = icosphere(1)
    return points.copy(), cells.triangles.copy()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_points_that_are_not_finite(value):
    points, triangles = sphere()
    points[[3, 7], 1] = value
    with pytest.raises(MeshError, match=r"NaN or infinite coordinates: 2 \(ids 3, 7\)"):
        checked(points, triangles)


@pytest.mark.parametrize("node", [-1, 42])
def test_nodes_that_are_no_points(node):
    points, triangles = sphere()
    triangles[5, 1] = node
    with pytest.raises(MeshError, match=r"node ids outside 0\.\.41: 1 \(ids 5\)"):
        checked(points, triangles)


def test_ids_that_start_at_one_are_named_so():
    points, triangles = sphere()
    with pytest.raises(MeshError, match="ids start at 1 here, subtract 1"):
        checked(points, triangles + 1)


def test_repeated_nodes_in_triangles_and_quadrilaterals():
    points, cells = mixed_sphere(2)
    triangles, quads = cells.triangles.copy(), cells.quads.copy()
    triangles[1, 2] = triangles[1, 0]
    quads[2, 3] = quads[2, 0]
    with pytest.raises(MeshError, match=rf"repeated node: 2 \(ids 1, {len(triangles) + 2}\)"):
        checked(points, triangles, quads)


def test_cells_are_numbered_as_in_the_file():
    points, cells = mixed_sphere(2)
    quads = cells.quads.copy()
    quads[2, 3] = quads[2, 0]
    mesh = meshio.Mesh(points, [("vertex", [[0]]), ("quad", quads), ("triangle", cells.triangles)])
    with pytest.raises(MeshError, match=r"repeated node: 1 \(ids 3\)"):
        surface.remesh(mesh)


def test_cells_given_twice():
    points, triangles = sphere()
    with pytest.raises(MeshError, match=r"same nodes as an earlier one: 2 \(ids 80, 81\)"):
        checked(points, np.concatenate([triangles, np.roll(triangles[[4, 9]], 1, axis=1)]))


def test_three_sheets_at_one_edge():
    points = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0.0]])
    with pytest.raises(MeshError, match=r"edges of more than two cells .*: 1 \(nodes \(0, 1\)\), at cells"):
        checked(points, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]))


def test_neighbours_that_disagree():
    points, triangles = sphere()
    triangles[11] = triangles[11, ::-1]
    with pytest.raises(MeshError, match=r"disagree on which side is out: .*turn them round"):
        checked(points, triangles)


def test_two_pieces_may_point_different_ways():
    points, triangles = sphere()
    assert checked(np.concatenate([points, points + 3]), np.concatenate([triangles, triangles[:, ::-1] + 42])) == ()


def test_a_klein_bottle_has_one_side_only():
    n = 12
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))

    def node(i, j):
        # Once round the first way turns the second round.
        turned = (i // n) % 2 == 1
        return (i % n) * n + np.where(turned, -j, j) % n

    quads = np.stack([node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)], axis=1)
    u, v = 2 * np.pi * i / n, 2 * np.pi * j / n
    r = 3 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    points = np.stack([r * np.cos(u), r * np.sin(u), np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)], axis=1)
    with pytest.raises(MeshError, match="one side"):
        checked(points, quads)


def test_cells_without_area():
    points, triangles = sphere()
    points[triangles[3]] = points[triangles[3]].mean(axis=0)
    with pytest.raises(MeshError, match=r"cells without area: .*3.*remove them"):
        checked(points, triangles)


def test_coincident_points_are_noted():
    points, triangles = sphere()
    apart = triangles.copy()
    apart[0] = [42, 43, 44]
    notes = checked(np.concatenate([points, points[triangles[0]] + 1e-15]), apart)
    assert len(notes) == 1
    assert notes[0].startswith("points that coincide with another: 6 ")
    assert "merge them" in notes[0]


def test_points_without_cells_are_noted_and_kept():
    points, triangles = sphere()
    more = np.concatenate([points, [[9.0, 9, 9]]])
    result = surface.remesh((more, triangles), max_iterations=1)
    assert result.report.notes == ("points in no cell (kept): 1 (ids 42)",)
    assert (result.points[42] == 9).all()


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_sound_whatever_the_unit_and_the_place(scale):
    points, triangles = sphere()
    assert checked(scale * (points + 1000), triangles) == ()


@pytest.mark.parametrize(
    ("points", "cells", "said"),
    [
        (np.eye(3), [[0, 1]], r"\(m, 3\) or \(m, 4\)"),
        (np.eye(3), [[0, 1, 2], [0, 1]], "array of node ids"),
        (np.eye(3), [[0.0, 1.0, 2.0]], "integer node ids, not float64"),
        (np.eye(3), np.empty((0, 3), int), "no triangles or quadrilaterals"),
        (np.empty((0, 3)), np.empty((0, 3), int), "no triangles or quadrilaterals"),
        (np.zeros((3, 4)), [[0, 1, 2]], r"\(n, 3\) array"),
        (np.eye(3) * 1j, [[0, 1, 2]], "real numbers"),
        ([["a", "b", "c"]] * 3, [[0, 1, 2]], "real numbers"),
    ],
)
def test_arrays_that_make_no_sense(points, cells, said):
    with pytest.raises(MeshError, match=said):
        surface.as_surface_mesh((points, cells))


def test_other_things_are_refused():
    with pytest.raises(OptionError, match="cannot make a surface of dict"):
        surface.as_surface_mesh({})
    with pytest.raises(MeshError, match="MultiBlock"):
        surface.as_surface_mesh(pv.MultiBlock([pv.Sphere()]))


@pytest.mark.parametrize(
    ("mesh", "said"),
    [
        (pv.ImageData(dimensions=(2, 2, 2)).cast_to_unstructured_grid(), "1 voxel.*take the surface first"),
        (pv.Sphere().delaunay_3d(), "tetra.*take the surface first"),
        (meshio.Mesh(CLOUD[:6], [("triangle6", [range(6)])]), "triangle6: 1;.*higher order"),
        (meshio.Mesh(CLOUD, [("quad8", [range(8)])]), "quad8: 1;.*higher order"),
        (meshio.Mesh(np.eye(3), [("triangle", [[0, 1, 2]]), ("tetra", [[0, 1, 2, 0]])]), "tetra: 1;"),
        (pv.PolyData(CLOUD[:5], [5, 0, 1, 2, 3, 4]), "1 polygon;"),
        (meshio.Mesh(np.eye(3), [("line", [[0, 1]])]), "no triangles or quadrilaterals"),
        (pv.PolyData(np.eye(3)), "no triangles or quadrilaterals"),
    ],
    ids=["voxel", "tetra", "triangle6", "quad8", "mixed", "pentagon", "lines", "points"],
)
def test_meshes_that_are_no_surface(mesh, said):
    with pytest.raises(MeshError, match=said):
        surface.as_surface_mesh(mesh)


def test_points_in_the_plane_stay_there():
    points, cells, _ = grid(6, jitter=0.3)
    flat = surface.remesh((points[:, :2], cells.triangles), max_iterations=3)
    assert (flat.points[:, 2] == 0).all()
    assert flat.mesh[0].shape == (49, 2)
    np.testing.assert_array_equal(flat.mesh[0], flat.points[:, :2])
    assert np.abs(flat.mesh[0] - points[:, :2]).max() > 1e-3
    planar = surface.remesh(meshio.Mesh(points[:, :2], [("triangle", cells.triangles)]), max_iterations=3).mesh
    np.testing.assert_array_equal(planar.points, flat.mesh[0])


@pytest.mark.parametrize("kind", ["float32", "fortran", "strided", "frozen", "int32", "uint8", "list"])
def test_any_arrays_are_taken_and_never_changed(kind):
    points, cells = quad_cube(4)  # numbers that single precision holds
    quads = cells.quads
    points[:, 0] *= 1.5
    given, table = points.copy(), quads.copy()
    if kind == "float32":
        given = given.astype(np.float32)
    elif kind == "fortran":
        given, table = np.asfortranarray(given), np.asfortranarray(table)
    elif kind == "strided":
        given, table = np.repeat(given, 2, axis=0)[::2], np.repeat(table, 2, axis=1)[:, ::2]
    elif kind == "frozen":
        given.flags.writeable = table.flags.writeable = False
    elif kind in ("int32", "uint8"):
        table = table.astype(kind)
    else:
        given, table = given.tolist(), table.tolist()
    result = surface.remesh((given, table), max_iterations=2)
    reference = surface.remesh((points, no_cells(3), quads), max_iterations=2)
    np.testing.assert_allclose(result.points, reference.points, atol=1e-12)
    np.testing.assert_array_equal(np.array(given, dtype=float), points)
    np.testing.assert_array_equal(np.array(table), quads)


def test_open_surfaces_several_genera_and_slivers_are_sound():
    points, cells, _ = grid(4)
    sliver = points.copy()
    sliver[12, :2] = [0.5, 0.75 - 1e-9]
    torus = pv.ParametricTorus(u_res=12, v_res=8).clean().triangulate()
    for mesh in ((points, cells.triangles), (sliver, cells.triangles), torus):
        assert require_sound(surface.as_surface_mesh(mesh)) == ()


def test_a_folded_quadrilateral_is_taken():
    points = np.array([[0, 0, 0], [1, 0, 0], [0.2, 0.2, 0], [0, 1, 0.0]])
    assert require_sound(surface.SurfaceMesh(points, Faces(no_cells(3), np.array([[0, 1, 2, 3]])))) == ()


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: ([[0, 0, 0]], [[0, 1, 2, 3, 4]]), r"an \(m, 3\) array of triangles, not \(1, 5\)"),
        (lambda: (np.eye(3), [[0, 1, 1.5]]), "integer node ids, not float64"),
        (lambda: (np.eye(3), [[0, 1], [2]]), "node ids"),
        (lambda: (np.eye(3), Faces(no_cells(4), no_cells(3))), "no triangles or quadrilaterals"),
        (lambda: (np.eye(3), Faces([[0, 1, 2]], [[0, 1, 2]])), r"\(m, 4\) array of quadrilaterals, not \(1, 3\)"),
        (lambda: (np.eye(4), [[0, 1, 2]]), r"\(n, 3\) array, or \(n, 2\) in the plane, not \(4, 4\)"),
        (lambda: (["a"], [[0, 1, 2]]), "real numbers"),
        (lambda: (np.eye(3), [[0, 1, 2]], {"a": [1.0]}), r"point_data\['a'\] must have first axis 3"),
        (lambda: (np.eye(3), [[0, 1, 2]], {}, {"a": [1.0, 2.0]}), r"cell_data\['a'\] must have first axis 1"),
    ],
)
def test_a_mesh_that_makes_no_sense_is_not_made(made, said):
    with pytest.raises(MeshError, match=said):
        surface.SurfaceMesh(*made())


def test_a_mesh_does_not_change():
    points, quads = np.eye(4)[:, :3], np.array([[0, 1, 2, 3]])
    given = np.arange(4.0)
    mesh = surface.SurfaceMesh(points, quads, {"mine": given})
    points += 1.0
    quads[:] = 0
    given[:] = 0.0
    assert (mesh.points == np.eye(4)[:, :3]).all()
    assert (mesh.cells.quads == [[0, 1, 2, 3]]).all()
    assert (mesh.point_data["mine"] == np.arange(4)).all()
    for array in (mesh.points, mesh.cells.quads, mesh.cells.triangles, mesh.point_data["mine"]):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    moved = mesh.replaced(2 * mesh.points, {"new": np.zeros(4)})
    assert moved.cells is mesh.cells
    assert list(moved.point_data) == ["mine", "new"]
    with pytest.raises(MeshError, match="points must be as many as the surface has, 4, not 3"):
        mesh.replaced(mesh.points[:3])
