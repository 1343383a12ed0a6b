"""Surfaces read from files as targets of volumes: faces, or the skin of solid cells."""

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.hexahedra import block

import surface
from hexconformal import HexMesh
from hexconformal.common.errors import MeshError, ReadError
from hexconformal.geometry.closest_point import SurfaceLocator
from hexconformal.io import read_write as io
from hexconformal.io.formats import SURFACE_EXTENSIONS

SURFACES = (".obj", ".off", ".ply", ".stl", ".vtp", ".vtk", ".vtu", ".msh")


def sphere_file(folder, extension):
    path, sphere = folder / f"sphere{extension}", pv.Sphere(theta_resolution=12, phi_resolution=9)
    if extension == ".vtu":
        sphere.cast_to_unstructured_grid().save(path)
    elif extension in (".off", ".msh"):
        mesh = meshio.Mesh(sphere.points, [("triangle", sphere.regular_faces), ("line", sphere.regular_faces[:2, :2])])
        mesh.cells = mesh.cells[:1] if extension == ".off" else mesh.cells
        meshio.write(path, mesh, file_format={".msh": "gmsh22"}.get(extension))
    else:
        sphere.save(path)
    return path, sphere


@pytest.mark.parametrize("extension", SURFACES)
def test_surfaces_are_read(extension, tmp_path, capfd):
    path, sphere = sphere_file(tmp_path, extension)
    capfd.readouterr()
    surface = io.read_surface(path)
    assert (surface.n_points, surface.n_cells) == (sphere.n_points, sphere.n_cells)
    assert surface.area == pytest.approx(sphere.area, rel=1e-5)
    assert surface.volume == pytest.approx(sphere.volume, rel=1e-5)
    ours = SurfaceLocator.from_pyvista(surface)
    assert ours.faces.shape == (sphere.n_cells, 3)
    assert ours.closest([[0.0, 0.0, 2.0]]).distances[0] == pytest.approx(1.5, rel=1e-6)
    data = path.read_bytes()
    for fraction in (0, 0.02, 0.3, 0.6, 0.97):
        path.write_bytes(data[: int(fraction * len(data))])
        with pytest.raises(ReadError, match="cannot read"):
            io.read_surface(path)
    assert capfd.readouterr() == ("", "")


def test_the_surface_of_solid_cells_is_their_skin(tmp_path):
    points, cells = block(3)
    io.write(tmp_path / "a.vtu", HexMesh(points, cells))
    assert io.read_surface(tmp_path / "a.vtu").n_cells == 2 * 54
    # Faces inside, such as those between two materials, do not belong to it.
    meshio.write(tmp_path / "b.vtu", meshio.Mesh(points, [("hexahedron", cells), ("quad", cells[13:14, :4])]))
    assert io.read_surface(tmp_path / "b.vtu").n_cells == 2 * 54


def test_separate_triangles_are_joined(tmp_path):
    sphere = pv.Sphere(theta_resolution=12, phi_resolution=9)
    corners = sphere.points[sphere.regular_faces].reshape(-1, 3)
    pv.PolyData.from_regular_faces(corners, np.arange(len(corners)).reshape(-1, 3)).save(tmp_path / "soup.vtp")
    surface = io.read_surface(tmp_path / "soup.vtp")
    assert (surface.n_points, surface.n_cells) == (sphere.n_points, sphere.n_cells)


def test_what_is_no_surface_is_refused(tmp_path):
    pv.Line().save(tmp_path / "line.vtp")
    with pytest.raises(MeshError, match="this one has none"):
        io.read_surface(tmp_path / "line.vtp")
    sphere = pv.Sphere()
    sphere.points[7] = np.nan
    sphere.save(tmp_path / "nan.vtp")
    with pytest.raises(MeshError, match="NaN"):
        io.read_surface(tmp_path / "nan.vtp")
    (tmp_path / "a.step").write_text("x")
    with pytest.raises(ReadError, match=r"unknown extension \.step"):
        io.read_surface(tmp_path / "a.step")
    for extension in SURFACE_EXTENSIONS:
        (tmp_path / f"bad{extension}").write_bytes(b"\x00\xff\xfe garbage \x80" * 50)
        with pytest.raises(ReadError, match="bad"):
            io.read_surface(tmp_path / f"bad{extension}")


@pytest.mark.parametrize("extension", [".obj", ".off", ".ply", ".stl"])
def test_both_packages_read_the_same_points_and_faces(extension, tmp_path):
    path, _ = sphere_file(tmp_path, extension)
    mesh = surface.read(path)
    target = io.read_surface(path)
    np.testing.assert_array_equal(target.points[target.regular_faces], mesh.points[mesh.cells.triangles])


def test_a_target_may_have_larger_polygons_and_arrays(tmp_path):
    solid = pv.Dodecahedron()
    solid.save(tmp_path / "a.obj")
    target = io.read_surface(tmp_path / "a.obj")
    assert target.n_cells == 36
    assert target.volume == pytest.approx(solid.triangulate().volume, rel=1e-6)
    sphere = pv.Icosphere(nsub=1)
    sphere.cell_data["tag"] = np.arange(sphere.n_cells)
    surface.write(tmp_path / "b.ply", sphere)
    np.testing.assert_array_equal(io.read_surface(tmp_path / "b.ply").n_cells, sphere.n_cells)
