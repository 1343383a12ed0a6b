"""Files keep the surface, and the type that comes in goes out."""

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.surfaces import icosphere, mixed_sphere, shaken

import surface


def test_type_in_is_type_out_and_data_is_kept():
    points, cells = shaken(mixed_sphere(4), 0.03)
    mesh = meshio.Mesh(
        points,
        [("quad", cells.quads), ("vertex", np.array([[0]])), ("triangle", cells.triangles)],
        point_data={"height": points[:, 2].copy()},
        cell_data={"tag": [np.arange(len(cells.quads)), np.array([7]), 100 + np.arange(len(cells.triangles))]},
    )
    before = points.copy()
    out = surface.remesh(mesh, max_iterations=2).mesh
    assert isinstance(out, meshio.Mesh)
    assert (mesh.points == before).all()
    assert (out.point_data["height"] == before[:, 2]).all()
    assert [part.tolist() for part in out.cell_data["tag"]] == [part.tolist() for part in mesh.cell_data["tag"]]
    assert np.isnan(out.cell_data["min_angle"][1]).all()
    poly = pv.PolyData(points, np.insert(cells.quads, 0, 4, axis=1).ravel())
    assert isinstance(surface.remesh(pv.Sphere(), max_iterations=1).mesh, pv.PolyData)
    assert poly.n_cells == len(cells.quads)
    array = surface.remesh((points, cells.triangles, cells.quads), max_iterations=1).mesh
    assert [part.shape for part in array] == [points.shape, cells.triangles.shape, cells.quads.shape]


@pytest.mark.parametrize("extension", [".ply", ".obj", ".stl", ".off", ".vtu", ".vtk", ".vtp", ".msh"])
def test_files_keep_the_surface(extension, tmp_path):
    points, cells = icosphere(1)
    path = tmp_path / f"sphere{extension}"
    surface.write(path, (points, cells.triangles))
    again = surface.read(path)
    assert len(again.points) == len(points)
    assert len(again.cells.triangles) == len(cells)
    order = np.lexsort(again.points.round(4).T), np.lexsort(points.round(4).T)
    assert np.abs(again.points[order[0]] - points[order[1]]).max() < 1e-6
