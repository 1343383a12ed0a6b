"""Exodus II: orders of nodes and names of elements."""

import meshio
import numpy as np
import pytest
from meshes.files import PARENTS
from meshes.hexahedra import block

from hexconformal import as_hex_mesh
from hexconformal.common.errors import ReadError
from hexconformal.io import read_write as io


def curved_meshio(name):
    """Two cells of 20 or 27 nodes, each with nodes of its own, in two blocks."""
    corners = np.concatenate([block(1)[0][block(1)[1][0]], block(1)[0][block(1)[1][0]] + [3, 0, 0]])
    count = {"hexahedron20": 20, "hexahedron27": 27}[name]
    parents = PARENTS[: count - 8]
    points = [np.concatenate([x, [x[list(p)].mean(axis=0) for p in parents]]) for x in (corners[:8], corners[8:])]
    return meshio.Mesh(np.concatenate(points), [(name, [range(count)]), (name, [range(count, 2 * count)])])


@pytest.mark.parametrize("name", ["hexahedron20", "hexahedron27"])
def test_exodus_has_an_order_of_its_own_for_curved_cells(name, tmp_path):
    path = tmp_path / "a.exo"
    mesh = as_hex_mesh(curved_meshio(name), linearise=True)
    assert [note for note in mesh.notes if "straightened" in note] == [mesh.notes[0]]
    assert f"2 {name}" in mesh.notes[0]
    io.write(path, mesh)
    raw = meshio.read(path)
    x = raw.points[raw.cells[0].data[0]]
    # As the Exodus manual draws it: upright edges come before those of the top, and the centre before the faces.
    np.testing.assert_array_equal(x[12:16], [x[[k, k + 4]].mean(axis=0) for k in range(4)])
    np.testing.assert_array_equal(x[16], x[[4, 5]].mean(axis=0))
    if name == "hexahedron27":
        np.testing.assert_array_equal(x[20], x[:8].mean(axis=0))
        np.testing.assert_array_equal(x[21:23], [x[:4].mean(axis=0), x[4:8].mean(axis=0)])
    back = io.read(path, linearise=True)
    np.testing.assert_array_equal(back.cells, mesh.cells)
    for block_ in back.origin.source.cells:
        y = back.points[block_.data[0]]
        np.testing.assert_array_equal(y[8:], [y[list(p)].mean(axis=0) for p in PARENTS[: len(y) - 8]])


def test_exodus_elements_have_many_names(tmp_path):
    netcdf = pytest.importorskip("netCDF4")
    path = tmp_path / "a.exo"
    points, cells = block(1)
    other = [("tetra", cells[:, :4]), ("line", cells[:, :2])]
    io.write(path, as_hex_mesh(meshio.Mesh(points, [("hexahedron", cells), *other]), other_cells="keep"))
    with netcdf.Dataset(path, "a") as data:
        data["connect2"].elem_type, data["connect3"].elem_type = "tet4", "BAR"
    assert [block_.type for block_ in io.read(path, other_cells="keep").origin.source.cells] == [
        "hexahedron",
        "tetra",
        "line",
    ]
    with netcdf.Dataset(path, "a") as data:
        data["connect2"].elem_type = "NFACED"
    with pytest.raises(ReadError, match="type 'NFACED' are not supported"):
        io.read(path)
