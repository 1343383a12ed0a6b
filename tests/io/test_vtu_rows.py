"""Rows of .vtu files in all binary forms that VTK writes are those that VTK reads; damage is told."""

import numpy as np
import pytest
import pyvista as pv
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

from hexconformal import ReadError, generate
from hexconformal.io import VtuRows

FORMS = [
    (mode, zlib, encoded, header)
    for mode in ("Binary", "Appended")
    for zlib in (True, False)
    for encoded in ((True, False) if mode == "Appended" else (True,))
    for header in (32, 64)
]


@pytest.fixture(scope="module")
def grid():
    points, cells = generate.jittered(*generate.box((12, 11, 9)), 0.2, seed=1)
    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: cells}, points)
    grid.point_data["place"] = points
    grid.cell_data["number"] = np.arange(len(cells), dtype=np.int16)
    return grid


def written(grid, path, mode, zlib, encoded, header):
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetFileName(str(path))
    getattr(writer, f"SetDataModeTo{mode}")()
    if not zlib:
        writer.SetCompressorTypeToNone()
    if mode == "Appended":
        writer.SetEncodeAppendedData(encoded)
    getattr(writer, f"SetHeaderTypeToUInt{header}")()
    writer.SetBlockSize(8184)
    assert writer.Write()
    return path


@pytest.mark.parametrize("form", FORMS, ids=str)
def test_rows_are_those_that_were_written(grid, tmp_path, form):
    rows = VtuRows(written(grid, tmp_path / "grid.vtu", *form))
    assert (rows.points, rows.cells) == (grid.n_points, grid.n_cells)
    assert rows.names("PointData") == ["place"]
    for first, last in ((0, grid.n_points), (0, 0), (17, 18), (500, 1311), (1300, grid.n_points)):
        assert np.array_equal(rows.rows("Points", "", first, last), grid.points[first:last])
        assert np.array_equal(rows.rows("PointData", "place", first, last), grid.points[first:last])
    for first, last in ((0, grid.n_cells), (3, 4), (1000, 1188)):
        assert np.array_equal(rows.rows("CellData", "number", first, last), np.arange(first, last))
        assert (rows.rows("Cells", "types", first, last) == 12).all()
        nodes = rows.rows("Cells", "connectivity", 8 * first, 8 * last)
        assert np.array_equal(nodes, grid.cell_connectivity[8 * first : 8 * last])
    assert rows.rows("CellData", "number", 0, 1).dtype == np.int16


def test_a_file_with_one_cell_whose_types_are_one_byte(tmp_path):
    one = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: np.arange(8)[None]}, generate.box((1, 1, 1))[0])
    for form in FORMS:
        assert VtuRows(written(one, tmp_path / "one.vtu", *form)).rows("Cells", "types", 0, 1).tolist() == [12]


@pytest.mark.parametrize("form", FORMS, ids=str)
def test_a_file_that_ends_early_or_is_damaged_is_told(grid, tmp_path, form):
    path = written(grid, tmp_path / "grid.vtu", *form)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(ReadError, match="malformed or truncated"):
        read_all(path)


def read_all(path):
    rows = VtuRows(path)
    for section, name, count in (("Points", "", rows.points), ("Cells", "connectivity", 8 * rows.cells)):
        rows.rows(section, name, 0, count)
    rows.rows("CellData", "number", 0, rows.cells)


def test_text_is_left_to_others(grid, tmp_path):
    path = written(grid, tmp_path / "grid.vtu", "Ascii", True, True, 32)
    with pytest.raises(ReadError, match="not in binary form"):
        VtuRows(path)
