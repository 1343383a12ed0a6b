"""The library as methods of pyvista datasets."""

import importlib.metadata
import re
import subprocess
import sys

import numpy as np
import pytest
import pyvista as pv
from meshes.files import cube_beside_pyramid
from paths import ROOT

import hexconformal as hc
import hexconformal.app.accessor
import surface
from hexconformal import generate
from hexconformal.io.convert import to_pyvista
from hexconformal.quality.assessment import MEASURES


def grid(mesh):
    return to_pyvista(hc.HexMesh(*mesh))[0]


def test_regularize_returns_a_better_grid():
    source = grid(generate.sheared_cube(4))
    source.cell_data["number"] = np.arange(source.n_cells)
    seen = []
    better = source.hexconformal.regularize(boundary="fixed", max_iterations=3, callback=seen.append)
    expected = hc.regularize(source, boundary="fixed", max_iterations=3)
    assert type(better) is pv.UnstructuredGrid
    np.testing.assert_array_equal(better.points, expected.points)
    assert set(better.cell_data) == {"number", "scaled_jacobian", "scaled_jacobian_change"}
    assert set(better.point_data) == {"moved_by"}
    assert len(seen) == len(expected.history)
    assert set(source.cell_data) == {"number"}


@pytest.mark.parametrize("kind", ["ImageData", "RectilinearGrid"])
def test_grids_whose_points_cannot_move_become_structured(kind):
    source = pv.ImageData(dimensions=(3, 3, 3))
    source = source if kind == "ImageData" else source.cast_to_rectilinear_grid()
    measured = source.hexconformal.quality()
    assert type(measured) is pv.StructuredGrid
    assert set(measured.cell_data) == {*MEASURES, "valid"}
    assert measured["valid"].tolist() == [1] * 8


def test_other_cells_are_measured_too_and_worked_around_on_request():
    mixed = cube_beside_pyramid()
    np.testing.assert_array_equal(mixed.hexconformal.quality()["shape"], hc.quality(mixed).shape)
    with_curved = mixed + pv.examples.cells.QuadraticTetrahedron().translate((9, 0, 0))
    assert not np.isnan(with_curved.hexconformal.quality()["shape"]).any()
    with_polyhedron = mixed + pv.examples.cells.Polyhedron().translate((9, 0, 0))
    measured = with_polyhedron.hexconformal.quality()["shape"]
    np.testing.assert_array_equal(np.isnan(measured), with_polyhedron.celltypes == 42)
    with pytest.raises(hc.MeshError, match="other three-dimensional cells: 1 polyhedron"):
        with_polyhedron.hexconformal.quality(other_cells="refuse")
    assert mixed.hexconformal.regularize(boundary="free").celltypes.tolist() == [12, 14]
    assert with_curved.hexconformal.regularize(boundary="fixed")["scaled_jacobian"].shape == (3,)
    kept = mixed.hexconformal.regularize(other_cells="keep")
    assert kept.celltypes.tolist() == [12, 14]


def test_cells_of_higher_order_are_worked_on_as_they_are_or_by_their_corners():
    curved = pv.examples.cells.QuadraticHexahedron()
    assert curved.hexconformal.regularize()["scaled_jacobian"].shape == (1,)
    assert curved.hexconformal.quality()["valid"].tolist() == [1]
    for method in (curved.hexconformal.regularize, curved.hexconformal.quality):
        assert method(linearize=True)["scaled_jacobian"].shape == (1,)


def test_remesh_returns_a_better_surface():
    sphere = pv.Sphere(theta_resolution=12, phi_resolution=12)
    seen = []
    better = sphere.hexconformal.remesh(target="flat", max_iterations=3, callback=seen.append)
    expected = surface.remesh(sphere, target="flat", max_iterations=3)
    assert type(better) is pv.PolyData
    np.testing.assert_array_equal(better.points, expected.points)
    assert set(better.cell_data) == {"min_angle", "min_angle_change"}
    assert len(seen) == len(expected.history)


def test_surfaces_are_measured():
    sphere = pv.Sphere(theta_resolution=12, phi_resolution=12)
    measured = sphere.hexconformal.quality()
    for name, values in surface.quality(sphere).arrays().items():
        np.testing.assert_array_equal(measured[name], values)


def test_options_and_meshes_that_make_no_sense():
    with pytest.raises(hc.OptionError, match="unknown option 'bounday'"):
        grid(generate.box((1, 1, 1))).hexconformal.regularize(bounday="fixed")
    with pytest.raises(hc.OptionError, match="unknown option 'steps'"):
        pv.Sphere().hexconformal.remesh(steps=3)
    with pytest.raises(hc.MeshError, match="no hexahedra"):
        pv.examples.cells.Triangle().hexconformal.quality()


OLD = """
import pyvista as pv
vars(pv).pop("register_dataset_accessor", None)  # as before 0.48
import hexconformal.app.accessor
assert float(pv.ImageData(dimensions=(2, 2, 2)).hexconformal.quality()["shape"][0]) == 1.0
assert "min_angle" in pv.Sphere().hexconformal.quality().cell_data
"""


def test_with_an_old_pyvista_the_module_is_imported():
    ran = subprocess.run([sys.executable, "-c", OLD], capture_output=True, text=True, timeout=300, check=False)
    assert ran.returncode == 0, ran.stderr


def test_pyvista_is_told_where_the_accessor_is():
    assert re.search(
        r'^\[project.entry-points."pyvista.accessors"\]\nhexconformal = "hexconformal.app.accessor"$',
        (ROOT / "pyproject.toml").read_text(encoding="utf-8"),
        re.MULTILINE,
    )


NEW = """
import sys
import pyvista as pv
assert "hexconformal" not in sys.modules
assert "valid" in pv.ImageData(dimensions=(2, 2, 2)).hexconformal.quality().cell_data
"""


def test_where_the_library_is_installed_nothing_is_imported():
    if not hasattr(pv, "register_dataset_accessor"):
        pytest.skip("this pyvista looks for no accessors")
    if "hexconformal" not in {entry.name for entry in importlib.metadata.entry_points(group="pyvista.accessors")}:
        pytest.skip("the library is not installed, it only lies on the path")
    ran = subprocess.run([sys.executable, "-c", NEW], capture_output=True, text=True, timeout=300, check=False)
    assert ran.returncode == 0, ran.stderr
