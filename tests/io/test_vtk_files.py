"""VTK's files: everything is kept, and legacy text that ends too early is noticed."""

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.files import mixed_grid, mixed_meshio
from meshes.hexahedra import block

from hexconformal import HexMesh, as_hex_mesh
from hexconformal.common.errors import ReadError
from hexconformal.io import read_write as io
from hexconformal.io import to_pyvista


@pytest.mark.parametrize("extension", [".vtu", ".vtk"])
def test_vtk_keeps_everything(extension, tmp_path):
    path = tmp_path / f"a b{extension}"
    assert io.write(path, as_hex_mesh(mixed_grid())) == []
    again = pv.read(path)
    grid = mixed_grid()
    np.testing.assert_array_equal(again.cells, grid.cells)
    np.testing.assert_array_equal(again.cell_data["id"], np.arange(16))
    assert list(again.field_data["units"]) == ["mm"]
    # A mesh read from a file is handed back as it is, and writes all it came with.
    mesh = io.read(path)
    assert mesh.to_source_type() is mesh
    io.write(path, mesh.replaced(points=mesh.points + 1))
    np.testing.assert_array_equal(pv.read(path).points, grid.points + 1)
    assert list(pv.read(path).field_data["units"]) == ["mm"]


@pytest.mark.parametrize("extension", [".vtu", ".vtk"])
def test_named_sets_become_arrays_in_vtk(extension, tmp_path):
    path = tmp_path / f"mesh{extension}"
    assert io.write(path, as_hex_mesh(mixed_meshio())) == []
    grid = pv.read(path)
    assert np.flatnonzero(grid.point_data["inlet"]).tolist() == [0, 5]
    assert np.flatnonzero(grid.cell_data["some"]).tolist() == [1, 3, 7, 12]
    np.testing.assert_array_equal(grid.field_data["fluid"], [11, 3])


@pytest.mark.parametrize("last", ["scalar", "vector", "field"])
def test_the_last_numbers_of_a_legacy_text_file(last, tmp_path):
    path = tmp_path / "mesh.vtk"
    points, cells = block(1)
    head = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n"
    mesh = "\n".join(" ".join(map(str, row)) for row in points) + "\nCELLS 1 9\n8 " + " ".join(map(str, cells[0]))
    array = {
        "scalar": "SCALARS a double 3\nLOOKUP_TABLE default\n" + "1 2 3 " * 8,
        "vector": "VECTORS a double\n" + "1 2 3\n" * 8,
        "field": "FIELD FieldData 2\na 1 8 double\n" + "1 " * 8 + "\nb 2 8 double\n" + "1 2\n" * 8,
    }[last]
    text = head + mesh + "\nCELL_TYPES 1\n12\nPOINT_DATA 8\n" + array
    path.write_text(text)
    assert "a" in io.read(path).point_data
    # VTK itself notices only some of these.
    for missing in range(4, 30):
        path.write_text(text.rstrip()[:-missing])
        with pytest.raises(ReadError, match="truncated"):
            io.read(path)


def test_ranges_in_a_legacy_text_file_are_no_arrays(tmp_path):
    # VTK notes the range of an array once it knows it; whole numbers must not pass for the header of an array.
    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: block(2)[1]}, block(2)[0])
    grid.point_data["v"] = np.tile([1.0, 0.0, 0.0], (grid.n_points, 1))
    grid.point_data.GetArray("v").GetRange(-1)
    grid.save(tmp_path / "a.vtk", binary=False)
    assert "DATA 2 1 1" in (tmp_path / "a.vtk").read_text()
    assert len(io.read(tmp_path / "a.vtk").cells) == 8


@pytest.mark.long
@pytest.mark.parametrize("as_text", [True, False])
@pytest.mark.parametrize("came", ["2.0", "3.0", "4.2", "5.1"])
def test_legacy_files_are_in_the_version_that_came(came, as_text, tmp_path):
    path = tmp_path / "a.vtk"
    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: block(2)[1]}, block(2)[0])
    grid.point_data["half"] = np.full(27, 0.5)
    path.write_bytes(legacy_bytes(grid, 51 if came == "5.1" else 42, as_text).replace(b" 4.2", f" {came}".encode(), 1))
    assert path.read_bytes().startswith(f"# vtk DataFile Version {came}".encode())
    mesh = io.read(path)
    lost = io.write(path, mesh.replaced(points=mesh.points / 3, point_data={"third": np.full(27, 1 / 3)}))
    assert lost == ["digits of the point array 'third' beyond the 11 of VTK's text"] * as_text
    assert path.read_bytes().startswith(f"# vtk DataFile Version {came}\n".encode())
    assert path.read_bytes().splitlines()[2] == (b"ASCII" if as_text else b"BINARY")
    np.testing.assert_array_equal(io.read(path).points, block(2)[0] / 3)
    np.testing.assert_array_equal(io.read(path).point_data["half"], grid.point_data["half"])
    theirs = meshio.read(path)
    np.testing.assert_array_equal(theirs.points, block(2)[0] / 3)
    np.testing.assert_array_equal(theirs.cells_dict["hexahedron"], block(2)[1])
    if as_text and came != "5.1":  # Gmsh does not read the binary files of this format that it writes itself
        gmsh = pytest.importorskip("gmsh")
        gmsh.initialize()
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.open(str(path))
            assert sum(map(len, gmsh.model.mesh.getElements(3)[1])) == 8
            np.testing.assert_array_equal(gmsh.model.mesh.getNodes()[1].reshape(-1, 3), block(2)[0] / 3)
        finally:
            gmsh.finalize()


def test_legacy_files_of_other_meshes_are_in_the_old_layout(tmp_path):
    mesh = HexMesh(*block(2))
    io.write(tmp_path / "a.vtu", mesh)
    for source in (mesh, tmp_path / "a.vtu"):
        assert io.write(tmp_path / "a.vtk", source) == []
        assert (tmp_path / "a.vtk").read_bytes().startswith(b"# vtk DataFile Version 4.2\nvtk output\nBINARY")


def legacy_bytes(grid, version, as_text):
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridWriter

    writer = vtkUnstructuredGridWriter()
    writer.SetFileVersion(version)
    writer.SetInputData(grid)
    writer.WriteToOutputStringOn()
    (writer.SetFileTypeToASCII if as_text else writer.SetFileTypeToBinary)()
    writer.Write()
    data = writer.GetOutputStdString()
    return data if isinstance(data, bytes) else data.encode()


def odd_grids():
    """Hexahedra with arrays of VTK's numbers, and of what only strings, names, or notes of pyvista can tell."""
    points, cells = block(1)
    grids = [pv.UnstructuredGrid({12: cells}, points) for _ in range(4)]
    grids[0].point_data["T"] = np.arange(8.0)
    grids[0].cell_data["stress"] = np.arange(6, dtype=np.float32)[None]
    grids[1].cell_data["inside"] = np.array([True])
    grids[1].point_data["phase"] = np.arange(8) + 1j
    grids[2].cell_data["name"] = np.array(["steel"])
    grids[3].field_data["unit"] = np.array(["mm"])
    return grids


@pytest.mark.parametrize("extension", [".vtu", ".vtk"])
@pytest.mark.parametrize("number", range(4))
def test_arrays_come_as_pyvista_reads_them(tmp_path, extension, number):
    path = tmp_path / f"odd{extension}"
    odd_grids()[number].save(path)
    expected, mesh = pv.read(path), io.read(path)
    assert to_pyvista(mesh)[0] == expected
    for arrays, own in ((expected.point_data, mesh.point_data), (expected.cell_data, mesh.cell_data)):
        assert set(own) == set(arrays.keys())
        for name, values in own.items():
            assert values.dtype == arrays[name].dtype
            np.testing.assert_array_equal(values, arrays[name])
