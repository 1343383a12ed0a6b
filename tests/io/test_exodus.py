"""Exodus II: orders of nodes and names of elements."""

import meshio
import numpy as np
import pytest
from meshes.files import PARENTS
from meshes.hexahedra import block

from hexconformal import as_hex_mesh, as_volume_mesh
from hexconformal.common.errors import ReadError
from hexconformal.io import read_write as io
from hexconformal.mesh import collapsed_mesh, find_regions


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
    mesh = as_hex_mesh(curved_meshio(name), linearize=True)
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
    back = io.read(path, linearize=True)
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


def hexahedra_and_wedges():
    """Two hexahedra on each other, and beside each two wedges."""
    points, cells = block(2)
    low = cells[[0, 4]]
    halves = [cells[k][[0, 1, 3, 4, 5, 7] if half else [1, 2, 3, 5, 6, 7]] for k in (1, 5) for half in (0, 1)]
    return points, [("hexahedron", low), ("wedge", np.array(halves))]


@pytest.mark.parametrize("named", [None, False, True])
def test_a_region_of_several_types_comes_back_as_one(named, tmp_path):
    netcdf = pytest.importorskip("netCDF4")
    points, cells = hexahedra_and_wedges()
    tags = None if named is None else {"gmsh:physical": [np.array([5, 9]), np.array([5, 5, 9, 9])]}
    names = {"steel": np.array([5, 3]), "stone": np.array([9, 3])} if named else {}
    path, again = tmp_path / "a.exo", tmp_path / "b.exo"
    made = meshio.Mesh(points, cells, cell_data=tags or {}, field_data=names)
    mesh = as_volume_mesh(made)
    io.write(path, mesh)
    for read in (path, again):
        back = as_volume_mesh(read)
        assert len(back.table) == 6
        regions = find_regions(collapsed_mesh(back))
        if named is None:
            assert regions is None
        else:
            assert regions.labels.tolist() == find_regions(collapsed_mesh(mesh)).labels.tolist()
            assert np.unique(back.cell_data["gmsh:physical"]).tolist() == [5, 9]
            assert regions.names == (("steel", "stone") if named else ("block_5", "block_9"))
        io.write(again, back)
    with netcdf.Dataset(path) as data:
        assert len(set(data["eb_prop1"][:].tolist())) == len(data["eb_prop1"]) == (2 if named is None else 4)
        if named:
            data["eb_names"].set_auto_chartostring(False)
            told = {bytes(row).split(b"\0")[0].decode() for row in np.ma.getdata(data["eb_names"][:])}
            assert told == {"steel", "stone", "steel_WEDGE6", "stone_WEDGE6"}


def test_blocks_of_which_nothing_is_told_are_regions_of_their_own(tmp_path):
    netcdf = pytest.importorskip("netCDF4")
    path = tmp_path / "a.exo"
    io.write(path, as_volume_mesh(meshio.Mesh(*hexahedra_and_wedges())))
    with netcdf.Dataset(path, "a") as data:
        data["eb_prop2"].setncattr("name", "OTHER")
    assert len(find_regions(collapsed_mesh(as_volume_mesh(path))).names) == 2
