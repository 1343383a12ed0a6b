"""Plain VTK datasets go in and come out with all they carried; pyvista and meshio are not needed on the way."""

import subprocess
import sys

import numpy as np
import pytest
import pyvista as pv
from vtk_datasets import array, plain
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData, vtkUnstructuredGrid

import hexconformal as hc
import surface
import surface.io.vtk_mesh
from hexconformal import generate
from hexconformal.io.vtk_mesh import from_vtk


def grid(points, cells, types=None):
    """A vtkUnstructuredGrid of rows of node ids."""
    result = vtkUnstructuredGrid()
    places = vtkPoints()
    places.SetDataTypeToDouble()
    for point in points:
        places.InsertNextPoint(point)
    result.SetPoints(places)
    for nodes, code in zip(cells, types or [12] * len(cells), strict=True):
        result.InsertNextCell(code, len(nodes), list(map(int, nodes)))
    return result


def positions(dataset):
    return vtk_to_numpy(dataset.GetPoints().GetData())


def test_cells_and_points_are_those_of_pyvista():
    points, cells = generate.jittered(*generate.box((3, 2, 2)), 0.2)
    mesh = from_vtk(grid(points, cells))
    np.testing.assert_array_equal(mesh.cells, cells)
    np.testing.assert_array_equal(mesh.points, points)


def test_what_a_grid_carries_comes_back_untouched():
    points, cells = generate.sheared_cube(3)
    carrying = pv.wrap(grid(points, [[0, 1], *cells], [3] + [12] * len(cells)))
    carrying.point_data["pressure"] = np.arange(len(points), dtype=np.float32)
    carrying.cell_data["number"] = np.arange(len(cells) + 1)
    carrying.field_data["made by"] = np.array([7])
    names = vtkStringArray()
    names.SetName("names")
    for k in range(len(cells) + 1):
        names.InsertNextValue(f"cell {k}")
    source = plain(carrying)
    source.GetCellData().AddArray(names)
    result = hc.regularize(from_vtk(source))
    out = result.mesh.to_source_type()
    assert type(out) is vtkUnstructuredGrid
    np.testing.assert_array_equal(positions(out), result.points)
    assert array(out.GetPointData(), "pressure").dtype == np.float32
    np.testing.assert_array_equal(array(out.GetCellData(), "number"), np.arange(len(cells) + 1))
    assert out.GetCellData().GetAbstractArray("names").GetValue(3) == "cell 3"
    assert out.GetFieldData().GetNumberOfArrays() == 1
    scaled = array(out.GetCellData(), "scaled_jacobian")
    assert np.isnan(scaled[0])
    np.testing.assert_array_equal(scaled[1:], hc.quality((result.points, cells)).scaled_jacobian)
    np.testing.assert_allclose(points + array(out.GetPointData(), "moved_by"), result.points, rtol=0, atol=1e-15)
    # The source is as it was.
    np.testing.assert_array_equal(positions(source), points)
    assert source.GetCellData().GetNumberOfArrays() == 2
    assert source.GetPointData().GetNumberOfArrays() == 1


def test_an_array_that_is_there_already_keeps_its_values_on_other_cells():
    points, cells = generate.box((2, 1, 1))
    source = grid(points, [*cells, [0, 1]], [12, 12, 3])
    once = from_vtk(source).replaced(cell_data={"a": np.array([1.0, 2.0])}).to_source_type()
    pv.wrap(once).cell_data["a"][2] = 5.0
    twice = from_vtk(once).replaced(cell_data={"a": np.array([3.0, 4.0])}).to_source_type()
    np.testing.assert_array_equal(array(twice.GetCellData(), "a"), [3.0, 4.0, 5.0])
    np.testing.assert_array_equal(array(once.GetCellData(), "a"), [1.0, 2.0, 5.0])


def test_voxels_are_hexahedra():
    points, cells = generate.box((1, 1, 1))
    mesh = from_vtk(grid(points, [cells[0][[0, 1, 3, 2, 4, 5, 7, 6]]], [11]))
    np.testing.assert_array_equal(mesh.cells, cells)
    assert mesh.notes == ("1 voxels are taken as hexahedra",)


def test_other_cells_are_named_and_held_if_kept():
    points, cells = generate.box((2, 1, 1))
    apex = [[3.0, 0.5, 0.5]]
    beside = np.setdiff1d(cells[1], cells[0])
    face = [beside[0], beside[1], beside[3], beside[2]]
    mixed = grid(np.concatenate([points, apex]), [*cells, [*face, len(points)]], [12, 12, 14])
    with pytest.raises(hc.MeshError, match="1 pyramid"):
        from_vtk(mixed)
    mesh = from_vtk(mixed, "keep")
    assert set(np.flatnonzero(mesh.held)) == {*map(int, face), len(points)}


def test_cells_of_higher_order_are_taken_by_their_corners_on_request():
    nodes = pv.examples.cells.QuadraticHexahedron()
    with pytest.raises(hc.MeshError, match="higher order"):
        from_vtk(plain(nodes))
    mesh = from_vtk(plain(nodes), linearize=True)
    assert mesh.cells.tolist() == [list(range(8))]
    moved = mesh.points + [0.5, 0.0, 0.0] * (np.arange(20) == 1)[:, None]
    out = positions(mesh.replaced(points=moved).to_source_type())
    np.testing.assert_allclose(out[1], mesh.points[1] + [0.5, 0.0, 0.0])
    np.testing.assert_allclose(out[8], moved[[0, 1]].mean(axis=0))


def test_no_hexahedra_and_no_cells():
    with pytest.raises(hc.MeshError, match="only: 1 triangle"):
        from_vtk(grid(np.eye(3), [[0, 1, 2]], [5]))
    with pytest.raises(hc.MeshError, match="no hexahedra"):
        from_vtk(vtkUnstructuredGrid())


@pytest.mark.parametrize("tagged", [False, True])
def test_tags_of_quads_are_found_as_with_pyvista(tagged):
    points, cells = generate.box((2, 2, 2))
    quads = [[0, 3, 12, 9], [9, 12, 21, 18]]
    source = pv.wrap(grid(points, [*cells, *quads], [12] * 8 + [9] * 2))
    if tagged:
        source.cell_data["tag"] = np.array([0] * 8 + [1, 2])
    for mesh in (from_vtk(plain(source)), hc.as_hex_mesh(source)):
        found = mesh.carried_cells(4)
        np.testing.assert_array_equal(found.nodes, quads)
        assert ("tag" in found.arrays) == tagged
        if tagged:
            np.testing.assert_array_equal(found.arrays["tag"], [1, 2])


def test_surfaces_of_both_kinds_with_lines_and_arrays():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]])
    source = vtkPolyData()
    places, lines, polys = vtkPoints(), vtkCellArray(), vtkCellArray()
    for point in corners:
        places.InsertNextPoint(point)
    lines.InsertNextCell(2, [0, 1])
    for nodes in ([1, 4, 5, 2], [0, 1, 2], [0, 2, 3]):
        polys.InsertNextCell(len(nodes), nodes)
    source.SetPoints(places)
    source.SetLines(lines)
    source.SetPolys(polys)
    mesh = surface.io.vtk_mesh.from_vtk(source)
    assert mesh.cells.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.cells.quads.tolist() == [[1, 4, 5, 2]]
    assert mesh.rows.tolist() == [2, 3, 1]  # as VTK counts them: the line first
    out = surface.io.vtk_mesh.to_vtk(source, mesh.replaced(corners * 2, cell_data={"a": np.array([10.0, 11.0, 12.0])}))
    np.testing.assert_array_equal(array(out.GetCellData(), "a"), [np.nan, 12.0, 10.0, 11.0])
    np.testing.assert_array_equal(positions(out), corners * 2)
    np.testing.assert_array_equal(positions(source), corners)
    assert source.GetCellData().GetNumberOfArrays() == 0


def test_surfaces_that_cannot_be_taken():
    with pytest.raises(hc.MeshError, match=r"no triangles or quadrilaterals: 1 \(ids 1\)"):
        surface.io.vtk_mesh.from_vtk(plain(pv.Polygon(n_sides=5)))  # its line is cell 0
    with pytest.raises(hc.MeshError, match="strips of triangles: "):
        surface.io.vtk_mesh.from_vtk(plain(pv.Sphere(theta_resolution=8, phi_resolution=8).strip()))
    with pytest.raises(hc.MeshError, match="there are no triangles"):
        surface.io.vtk_mesh.from_vtk(vtkPolyData())
    pointless = vtkPolyData()
    pointless.SetPolys(pv.Triangle().GetPolys())
    with pytest.raises(hc.MeshError, match="node ids outside"):
        surface.remesh(surface.io.vtk_mesh.from_vtk(pointless))


IMPORTS = """
import sys
import hexconformal, surface
unused = {"scipy.spatial", "unittest.mock", "ssl"}  # a quarter of a second
heavy = {"pyvista", "meshio", "vtkmodules", "matplotlib", "rich", "skfem", *unused} & set(sys.modules)
assert not heavy, heavy
"""

WORK = """
sys.modules.update(pyvista=None, meshio=None)  # from now on neither can be imported
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPolyData, vtkUnstructuredGrid
from vtkmodules.vtkFiltersCore import vtkAppendFilter
from vtkmodules.vtkFiltersSources import vtkSphereSource
import surface.io.vtk_mesh
from hexconformal.io.vtk_mesh import from_vtk
image, append, ball = vtkImageData(), vtkAppendFilter(), vtkSphereSource()
image.SetDimensions(3, 3, 3)
append.SetInputData(image)
append.Update()
ball.Update()
out = hexconformal.regularize(from_vtk(append.GetOutput()), max_iterations=1).mesh.to_source_type()
assert out.IsA("vtkUnstructuredGrid")
source = ball.GetOutput()
result = surface.remesh(surface.io.vtk_mesh.from_vtk(source), max_iterations=1)
assert surface.io.vtk_mesh.to_vtk(source, result.mesh).IsA("vtkPolyData")
"""


@pytest.mark.parametrize("code", [IMPORTS, IMPORTS + WORK], ids=["import", "work"])
def test_neither_pyvista_nor_meshio_is_imported(code):
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=False)
    assert ran.returncode == 0, ran.stderr
