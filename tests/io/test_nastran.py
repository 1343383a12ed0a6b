"""Nastran's bulk data: numbers in 16 characters, files without a beginning."""

import numpy as np
import pytest
from meshes.hexahedra import block

from hexconformal import HexMesh
from hexconformal.io import read_write as io


@pytest.mark.parametrize("extension", [".bdf", ".nas", ".fem"])
def test_nastran_holds_negative_and_tiny_coordinates(extension, tmp_path):
    points, cells = block(2)
    points = (points - points.mean(axis=0)) / 3 + 1e-17 / 3
    points[0] = -1e-200 / 3, -1e150 / 3e110, 9.999999999999e9
    path = tmp_path / f"a{extension}"
    io.write(path, HexMesh(points, cells))
    np.testing.assert_allclose(io.read(path).points, points, rtol=1e-8)


@pytest.mark.parametrize("begin", ["", "SOL 101\nCEND\nbegin bulk\n", "BEGIN BULK\n"])
def test_nastran_may_begin_at_once(begin, tmp_path):
    """As Gmsh writes it: bulk data alone, in fields of eight characters."""
    points, cells = block(1)
    lines = ["$ Created by Gmsh"]
    lines += [f"GRID    {k:<8d}0       " + "".join(f"{x:<8.5f}" for x in point) for k, point in enumerate(points, 1)]
    nodes = "".join(f"{k:<8d}" for k in cells[0] + 1)
    lines += [f"CHEXA   1       1       {nodes[:48]}+E1", f"+E1     {nodes[48:]}", "ENDDATA"]
    (tmp_path / "a.bdf").write_text(begin + "\n".join(lines) + "\n")
    mesh = io.read(tmp_path / "a.bdf")
    np.testing.assert_array_equal(mesh.cells, cells)
    np.testing.assert_allclose(mesh.points, points, atol=1e-5)
