"""The ParaView filters as algorithms of plain VTK, without ParaView: its decorators do nothing then."""

import dataclasses
import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from meshes.files import cube_beside_pyramid
from vtk_datasets import array, plain
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import VTK_STRING, vtkOutputWindow
from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkUnstructuredGrid

import hexconformal as hc
import surface
from hexconformal import generate, regularization
from hexconformal.io.convert import to_pyvista
from hexconformal.quality.assessment import MEASURES

PLUGIN = Path(hc.__file__).parent / "app" / "hexconformal_plugin.py"


def loaded():
    """The plugin as ParaView loads it: from its file, as a module of its own."""
    specification = importlib.util.spec_from_file_location("hexconformal_plugin", PLUGIN)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.fixture
def plugin(monkeypatch):
    monkeypatch.setitem(sys.modules, "paraview", None)
    return loaded()


@pytest.fixture
def errors():
    """What VTK is told to show as errors, as a list that grows."""
    told, window = [], vtkOutputWindow.GetInstance()

    def hear(caller, event, text):
        told.append(text)

    hear.CallDataType = VTK_STRING
    observer = window.AddObserver("ErrorEvent", hear)
    window.SetDisplayModeToNever()
    yield told
    window.RemoveObserver(observer)
    window.SetDisplayModeToDefault()


def grid(mesh):
    return plain(to_pyvista(hc.HexMesh(*mesh))[0])


def run(algorithm, source):
    algorithm.SetInputDataObject(source)
    algorithm.Update()
    return algorithm.GetOutputDataObject(0)


def names(attributes):
    return {attributes.GetArrayName(k) for k in range(attributes.GetNumberOfArrays())}


def report(dataset):
    lines = dataset.GetFieldData().GetAbstractArray("report")
    return "\n".join(lines.GetValue(k) for k in range(lines.GetNumberOfValues()))


def test_regularize_does_what_the_library_does(plugin, errors):
    source = pv.wrap(grid(generate.sheared_cube(4)))
    source.point_data["pressure"] = source.points[:, 0].copy()
    source.cell_data["number"] = np.arange(source.n_cells)
    source = plain(source)
    out = run(plugin.RegularizeHexahedra(), source)
    expected = hc.regularize(generate.sheared_cube(4))
    assert errors == []
    assert type(out) is vtkUnstructuredGrid
    np.testing.assert_array_equal(vtk_to_numpy(out.GetPoints().GetData()), expected.points)
    assert names(out.GetPointData()) == {"pressure", "moved_by"}
    assert names(out.GetCellData()) == {"number", "scaled_jacobian", "scaled_jacobian_change"}
    np.testing.assert_array_equal(array(out.GetCellData(), "number"), np.arange(64))
    assert array(out.GetCellData(), "scaled_jacobian").min() > 0.99
    assert "64 cells, " in report(out)
    # The input is as it was.
    assert names(source.GetCellData()) == {"number"}
    assert source.GetFieldData().GetNumberOfArrays() == 0
    np.testing.assert_array_equal(vtk_to_numpy(source.GetPoints().GetData()), generate.sheared_cube(4)[0])


@pytest.fixture
def asked(monkeypatch):
    """The options that reach the library, which then does nothing."""
    seen = []

    def refused(mesh, options):
        seen.append(options)
        raise hc.MeshError("enough")

    monkeypatch.setattr(regularization, "run_on", refused)
    monkeypatch.setattr(surface, "Remeshing", refused)
    return seen


def test_defaults_are_those_of_the_library(plugin, asked, errors):
    run(plugin.RegularizeHexahedra(), grid(generate.box((1, 1, 1))))
    run(plugin.RemeshSurface(), plain(pv.Sphere()))
    assert asked == [hc.Options(), surface.Options()]


@pytest.mark.parametrize(
    ("name", "setter", "value", "field", "arrives"),
    [
        ("RegularizeHexahedra", "SetBoundary", "fixed", "boundary", "fixed"),
        ("RegularizeHexahedra", "SetHausdorff", 0.02, "hausdorff", 0.02),
        ("RegularizeHexahedra", "SetFeatures", "soft", "features", "soft"),
        ("RegularizeHexahedra", "SetTarget", "1:1:4", "target", "1:1:4"),
        ("RegularizeHexahedra", "SetMaxIterations", 7, "max_iterations", 7),
        ("RegularizeHexahedra", "SetEmphasis", "mean", "emphasis", "mean"),
        ("RemeshSurface", "SetMaxIterations", 7, "max_iterations", 7),
        ("RemeshSurface", "SetTarget", "flat", "target", "flat"),
        ("RemeshSurface", "SetHausdorff", 0.02, "hausdorff", 0.02),
    ],
)
def test_every_property_reaches_the_library(plugin, asked, errors, name, setter, value, field, arrives):
    algorithm = getattr(plugin, name)()
    source = plain(pv.Sphere()) if name == "RemeshSurface" else grid(generate.box((1, 1, 1)))
    run(algorithm, source)
    getattr(algorithm, setter)(value)
    algorithm.Update()
    algorithm.Update()
    getattr(algorithm, setter)(value)
    algorithm.Update()
    # It ran again for the change, and for nothing else, though it failed each time.
    assert len(asked) == 2
    assert asked[1] == dataclasses.replace(asked[0], **{field: arrives})


def test_every_property_is_among_those_tested(plugin):
    setters = {f"{c.__name__}.{s}" for c in (plugin.RegularizeHexahedra, plugin.RemeshSurface) for s in vars(c)}
    tested = test_every_property_reaches_the_library.pytestmark[0].args[1]
    others = {"RegularizeHexahedra.SetOtherCells", "RegularizeHexahedra.SetLinearize"}
    assert {s for s in setters if ".Set" in s} == {f"{row[0]}.{row[1]}" for row in tested} | others


def test_other_cells_are_worked_on_or_kept(plugin, errors):
    mixed = cube_beside_pyramid()
    algorithm = plugin.RegularizeHexahedra()
    algorithm.SetBoundary("free")
    out = run(algorithm, plain(mixed))
    assert errors == []
    expected = hc.regularize(mixed, boundary="free")
    np.testing.assert_array_equal(vtk_to_numpy(out.GetPoints().GetData()), expected.points)
    assert "pyramids, scaled jac. min" in report(out)
    algorithm.SetOtherCells("keep")
    algorithm.Update()
    out = algorithm.GetOutputDataObject(0)
    assert errors == []
    np.testing.assert_array_equal(array(out.GetCellData(), "scaled_jacobian"), [1.0, np.nan])
    assert "other cells are carried along, their nodes held: 1 pyramid" in report(out)


def test_cells_that_there_is_no_way_for_are_refused(plugin, errors):
    source = plain(cube_beside_pyramid() + pv.examples.cells.Polyhedron().translate((9, 0, 0)))
    assert run(plugin.RegularizeHexahedra(), source).GetNumberOfCells() == 0
    assert "other three-dimensional cells: 1 polyhedron" in errors.pop()


def test_quadratic_hexahedra_are_measured_and_worked_on_as_they_are(plugin, errors):
    mesh = hc.elevated(generate.box((3, 3, 3)), 27)
    inside = ((mesh.points > 1e-9) & (mesh.points < 1 - 1e-9)).all(axis=1)
    moves = np.random.default_rng(0).uniform(-0.02, 0.02, mesh.points.shape)
    mesh = mesh.replaced(mesh.points + inside[:, None] * moves)
    source = plain(to_pyvista(mesh)[0])
    out = run(plugin.HexahedraQuality(), source)
    np.testing.assert_array_equal(array(out.GetCellData(), "scaled_jacobian"), hc.quality(mesh).scaled_jacobian)
    algorithm = plugin.RegularizeHexahedra()
    algorithm.SetBoundary("fixed")
    out = run(algorithm, source)
    assert errors == []
    expected = hc.regularize(mesh, boundary="fixed")
    np.testing.assert_array_equal(vtk_to_numpy(out.GetPoints().GetData()), expected.points)


@pytest.mark.parametrize("name", ["RegularizeHexahedra", "HexahedraQuality"])
def test_cells_of_higher_order_by_their_corners(plugin, errors, name):
    algorithm, source = getattr(plugin, name)(), plain(pv.examples.cells.QuadraticHexahedron())
    algorithm.SetLinearize(1)
    out = run(algorithm, source)
    assert errors == []
    assert out.GetCellData().GetArray("scaled_jacobian").GetNumberOfTuples() == 1
    assert "hexahedra of 20 nodes" not in report(out)


def test_quality_has_every_measure(plugin, errors):
    points, cells = generate.jittered(*generate.box((3, 3, 3)), 0.5)
    out = run(plugin.HexahedraQuality(), grid((points, cells)))
    expected = hc.quality((points, cells))
    assert errors == []
    assert names(out.GetCellData()) == {*MEASURES, "valid"}
    for name, values in expected.arrays().items():
        np.testing.assert_array_equal(array(out.GetCellData(), name), values)
    assert report(out) == str(expected.summary())


def test_quality_of_all_cells_that_there_are_measures_of(plugin, errors):
    mixed = cube_beside_pyramid() + pv.examples.cells.QuadraticTetrahedron().translate((9, 0, 0))
    out = run(plugin.HexahedraQuality(), plain(mixed + pv.examples.cells.Polyhedron().translate((19, 0, 0))))
    assert errors == []
    expected = hc.quality(mixed)
    np.testing.assert_array_equal(array(out.GetCellData(), "scaled_jacobian"), [*expected.scaled_jacobian, np.nan])
    np.testing.assert_array_equal(array(out.GetCellData(), "valid"), [1, 1, 1, 0])


@pytest.mark.long
def test_remesh_does_what_the_library_does(plugin, errors):
    sphere = pv.Sphere(theta_resolution=12, phi_resolution=12)
    sphere.cell_data["number"] = np.arange(sphere.n_cells)
    out = run(plugin.RemeshSurface(), plain(sphere))
    expected = surface.remesh(sphere)
    assert errors == []
    assert type(out) is vtkPolyData
    np.testing.assert_array_equal(vtk_to_numpy(out.GetPoints().GetData()), expected.points)
    assert names(out.GetPointData()) == {"Normals"}
    np.testing.assert_array_equal(array(out.GetCellData(), "number"), np.arange(sphere.n_cells))
    np.testing.assert_array_equal(array(out.GetCellData(), "min_angle"), expected.mesh.cell_data["min_angle"])
    assert f"{sphere.n_cells} cells, " in report(out)


@pytest.mark.parametrize(
    ("name", "source", "says"),
    [
        (
            "RegularizeHexahedra",
            lambda: plain(pv.examples.cells.Triangle()),
            "there are no hexahedra, wedges, pyramids, tetrahedra, only: 1 triangle",
        ),
        ("HexahedraQuality", lambda: plain(pv.examples.cells.Triangle()), "tetrahedra, only: 1 triangle"),
        ("RemeshSurface", lambda: plain(pv.Line()), "there are no triangles or quadrilaterals"),
        ("RemeshSurface", lambda: plain(pv.Sphere(theta_resolution=8).strip()), "strips of triangles"),
    ],
)
def test_meshes_that_cannot_be_worked_on_are_told(plugin, errors, name, source, says):
    out = run(getattr(plugin, name)(), source())
    assert out.GetNumberOfCells() == 0
    assert len(errors) == 1
    assert says in errors[0]


@pytest.mark.parametrize(
    ("problem", "says"),
    [
        (hc.OptionError("hausdorff is odd"), "Hexahedra Quality: hausdorff is odd\n"),
        (MemoryError(), "Hexahedra Quality: not enough memory for this mesh\n"),
        (KeyError("x"), "Hexahedra Quality: unexpected KeyError: 'x'\n"),
        (ModuleNotFoundError("No module named 'numba'"), "(No module named 'numba'); start ParaView with PYTHONPATH"),
    ],
)
def test_all_that_goes_wrong_is_told_in_one_error(plugin, errors, monkeypatch, problem, says):
    def broken(mesh):
        raise problem

    monkeypatch.setattr(hc, "quality", broken)
    out = run(plugin.HexahedraQuality(), grid(generate.box((1, 1, 1))))
    assert out.GetNumberOfCells() == 0
    assert len(errors) == 1
    assert says in errors[0]


def test_without_the_library_the_plugin_loads_and_says_what_is_missing(plugin, errors, monkeypatch):
    monkeypatch.setitem(sys.modules, "hexconformal", None)
    run(loaded().HexahedraQuality(), grid(generate.box((1, 1, 1))))
    assert "the library cannot be loaded into this Python" in errors[0]


@pytest.mark.parametrize("name", ["RegularizeHexahedra", "HexahedraQuality", "RemeshSurface"])
def test_no_cells_are_no_error(plugin, errors, name):
    source = vtkPolyData() if name == "RemeshSurface" else vtkUnstructuredGrid()
    assert run(getattr(plugin, name)(), source).GetNumberOfCells() == 0
    assert errors == []


def test_progress_is_shown_and_an_abort_leaves_what_was_reached(plugin, errors):
    algorithm, heard = plugin.RegularizeHexahedra(), []

    def hear(caller, event):
        heard.append((algorithm.GetProgress(), algorithm.GetProgressText()))
        if algorithm.GetProgress() >= 3 / 200:
            algorithm.SetAbortExecute(1)

    algorithm.AddObserver("ProgressEvent", hear)
    out = run(algorithm, grid(generate.sheared_cube(5)))
    assert errors == []
    shown = [text for _, text in heard if text]
    assert shown[0].startswith("iteration 0, smallest scaled Jacobian 0.")
    assert shown[-1].startswith("iteration 3, ")
    assert "3 iterations" in report(out)
    assert array(out.GetPointData(), "moved_by").any()


CODE = """
import importlib.util, sys
sys.modules.update(pyvista=None, meshio=None)  # neither can be imported
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkFiltersCore import vtkAppendFilter
specification = importlib.util.spec_from_file_location("hexconformal_plugin", sys.argv[1])
plugin = importlib.util.module_from_spec(specification)
specification.loader.exec_module(plugin)
assert "hexconformal" not in sys.modules  # what takes time waits until it is needed
image, append, quality = vtkImageData(), vtkAppendFilter(), plugin.HexahedraQuality()
image.SetDimensions(3, 3, 3)
append.SetInputData(image)
quality.SetInputConnection(append.GetOutputPort())
quality.Update()
assert quality.GetOutputDataObject(0).GetCellData().GetArray("shape").GetRange() == (1.0, 1.0)
"""


def test_neither_pyvista_nor_meshio_is_needed():
    words = [sys.executable, "-c", CODE, str(PLUGIN)]
    ran = subprocess.run(words, capture_output=True, text=True, timeout=300, check=False)
    assert ran.returncode == 0, ran.stderr
    assert ran.stderr == ""
