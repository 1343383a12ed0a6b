"""Meshes of meshio and pyvista come back whole, and foreign cells are refused or held."""

import subprocess
import sys

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.files import mixed_grid, mixed_meshio
from meshes.hexahedra import block

from hexconformal import as_hex_mesh
from hexconformal.common.errors import MeshError


def snapshot(mesh):
    return repr(
        [mesh.points.tolist(), [(c.type, c.data.tolist()) for c in mesh.cells], mesh.point_data, mesh.cell_data]
    )


def test_meshio_comes_back_whole_with_new_points_and_arrays():
    source = mixed_meshio()
    before = snapshot(source)
    mesh = as_hex_mesh(source)
    np.testing.assert_array_equal(mesh.cells, block(2)[1])
    np.testing.assert_array_equal(mesh.cell_data["gmsh:physical"], [11] * 5 + [13] * 3)
    result = mesh.replaced(
        points=mesh.points + 1,
        point_data={"new": np.arange(28)},
        cell_data={"q": np.arange(8.0), "n": np.arange(8), "p": -np.arange(8.0)},
    ).to_source_type()
    assert snapshot(source) == before
    assert isinstance(result, meshio.Mesh)
    np.testing.assert_array_equal(result.points, source.points + 1)
    assert [c.type for c in result.cells] == ["quad", "hexahedron", "line", "hexahedron", "vertex"]
    for ours, theirs in zip(result.cells, source.cells, strict=True):
        np.testing.assert_array_equal(ours.data, theirs.data)
        assert not np.shares_memory(ours.data, theirs.data)
    np.testing.assert_array_equal(result.point_data["v"], source.point_data["v"])
    np.testing.assert_array_equal(result.point_data["new"], np.arange(28))
    assert [part.tolist() for part in result.cell_data["n"]] == [[0] * 3, [0, 1, 2, 3, 4], [0] * 2, [5, 6, 7], [0]]
    assert np.isnan(result.cell_data["q"][0]).all()
    np.testing.assert_array_equal(result.cell_data["q"][3], [5, 6, 7])
    np.testing.assert_array_equal(result.cell_data["p"][0], source.cell_data["p"][0])
    np.testing.assert_array_equal(result.cell_data["p"][3], [-5, -6, -7])
    np.testing.assert_array_equal(result.cell_data["gmsh:physical"][4], [14])
    np.testing.assert_array_equal(result.field_data["fluid"], [11, 3])
    np.testing.assert_array_equal(result.point_sets["inlet"], [0, 5])
    assert [part.tolist() for part in result.cell_sets["some"]] == [[1], [0, 4], [], [2], []]


def test_pyvista_comes_back_whole():
    grid = mixed_grid()
    before = grid.copy()
    mesh = as_hex_mesh(grid)
    np.testing.assert_array_equal(mesh.cells, block(2)[1])
    np.testing.assert_array_equal(mesh.cell_data["id"], np.arange(0, 16, 2))
    moved = mesh.points + 1e-9
    result = mesh.replaced(points=moved, cell_data={"q": np.arange(8.0)}).to_source_type()
    assert grid == before
    assert type(result) is pv.UnstructuredGrid
    assert result.points.dtype == np.float64, "rounding to float32 could invert a thin cell"
    np.testing.assert_array_equal(result.points, moved)
    np.testing.assert_array_equal(result.celltypes, grid.celltypes)
    np.testing.assert_array_equal(result.cells, grid.cells)
    np.testing.assert_array_equal(result.cell_data["id"], np.arange(16))
    np.testing.assert_array_equal(result.cell_data["q"][::2], np.arange(8))
    assert np.isnan(result.cell_data["q"][1::2]).all()
    assert list(result.field_data["units"]) == ["mm"]


@pytest.mark.parametrize("make", ["ImageData", "RectilinearGrid", "StructuredGrid"])
def test_structured_grids_stay_structured(make):
    image = pv.ImageData(dimensions=(3, 4, 5), spacing=(1, 2, 3))
    grid = {
        "ImageData": image,
        "RectilinearGrid": image.cast_to_rectilinear_grid(),
        "StructuredGrid": image.cast_to_structured_grid(),
    }[make]
    grid.cell_data["id"] = np.arange(grid.n_cells)
    mesh = as_hex_mesh(grid)
    assert np.linalg.det(mesh.points[mesh.cells[:, [1, 3, 4]]] - mesh.points[mesh.cells[:, :1]]).min() > 0
    centers = mesh.points[mesh.cells].mean(axis=1)
    np.testing.assert_allclose(centers, grid.cell_centers().points)
    result = mesh.replaced(points=mesh.points * 2).to_source_type()
    assert type(result) is pv.StructuredGrid
    assert result.dimensions == (3, 4, 5)
    np.testing.assert_allclose(result.cell_centers().points, 2 * centers)
    np.testing.assert_array_equal(result.cell_data["id"], np.arange(grid.n_cells))


def test_voxels_become_hexahedra():
    grid = pv.ImageData(dimensions=(3, 3, 3)).cast_to_unstructured_grid()
    assert set(grid.celltypes) == {11}
    grid.cell_data["id"] = np.arange(8)
    grid.field_data["units"] = ["mm"]
    mesh = as_hex_mesh(grid)
    assert "8 voxels" in mesh.notes[0]
    result = mesh.to_source_type()
    assert set(result.celltypes) == {12}
    np.testing.assert_allclose(result.compute_cell_sizes()["Volume"], 1)
    np.testing.assert_array_equal(result.cell_data["id"], np.arange(8))
    assert list(result.field_data["units"]) == ["mm"]


def test_a_collection_of_blocks_is_refused():
    with pytest.raises(MeshError, match="collection of 1 blocks"):
        as_hex_mesh(pv.MultiBlock([mixed_grid()]))
    with pytest.raises(MeshError, match="no hexahedra"):
        as_hex_mesh(pv.Sphere())


def with_tetra():
    points, cells = block(1)
    points = np.vstack([points, [[2, 2, 2]]])
    return meshio.Mesh(points, [("hexahedron", cells), ("tetra", [[5, 6, 7, 8]])])


def test_other_solids_are_refused_or_held():
    with pytest.raises(MeshError, match="1 tetra"):
        as_hex_mesh(with_tetra())
    mesh = as_hex_mesh(with_tetra(), other_cells="keep")
    assert np.flatnonzero(mesh.held).tolist() == [5, 6, 7, 8]
    assert [c.type for c in mesh.to_source_type().cells] == ["hexahedron", "tetra"]
    grid = pv.from_meshio(with_tetra())
    with pytest.raises(MeshError, match="1 tetra"):
        as_hex_mesh(grid)
    assert np.flatnonzero(as_hex_mesh(grid, other_cells="keep").held).tolist() == [5, 6, 7, 8]
    with pytest.raises(MeshError, match="no hexahedra, only: 1 tetra"):
        as_hex_mesh(meshio.Mesh(with_tetra().points, [("tetra", [[5, 6, 7, 8]])]), other_cells="keep")


@pytest.mark.parametrize(("name", "vtk"), [("hexahedron20", 25), ("hexahedron27", 29)])
def test_higher_order_hexahedra_are_linearised_on_request(name, vtk):
    count = int(name[-2:])
    # VTK itself says where the higher nodes of its reference cell are.
    cell = {25: pv._vtk.vtkQuadraticHexahedron, 29: pv._vtk.vtkTriQuadraticHexahedron}[vtk]()
    places = np.array([cell.GetParametricCoords()[i] for i in range(3 * count)]).reshape(count, 3)
    curved = places + 0.05 * np.sin(5 * places)
    for source in (
        meshio.Mesh(curved, [(name, [range(count)])]),
        pv.UnstructuredGrid(np.array([count, *range(count)]), [vtk], curved),
    ):
        with pytest.raises(MeshError, match="linearise=True"):
            as_hex_mesh(source)
        mesh = as_hex_mesh(source, linearise=True)
        np.testing.assert_array_equal(mesh.cells, [range(8)])
        moved = mesh.points.copy()
        moved[:8] = 3 * places[:8] + 1
        np.testing.assert_allclose(mesh.replaced(points=moved).to_source_type().points, 3 * places + 1, atol=1e-14)


def test_arrays_do_not_import_the_mesh_libraries():
    code = (
        "import sys; from hexconformal import as_hex_mesh; "
        "as_hex_mesh(([[0, 0, 0]] * 8, [range(8)])).to_source_type(); "
        "print([name for name in ('meshio', 'pyvista', 'vtkmodules') if name in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"
