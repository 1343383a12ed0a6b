"""Exodus files with blocks, sets, maps and times: written as they came, and made of what other formats tag."""

import meshio
import numpy as np
import pytest
from meshes.hexahedra import block

import hexconformal as hc
from hexconformal import HexMesh, as_hex_mesh
from hexconformal.io import read_write as io
from hexconformal.mesh import find_embedded

netcdf = pytest.importorskip("netCDF4")

# What the Exodus manual calls side 5 of a hexahedron is its bottom, side 6 its top.
BOTTOM, TOP = 5, 6
FORMATS = ["NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA", "NETCDF4", "NETCDF4_CLASSIC"]


def characters(names, length=33):
    return np.array([list(name.ljust(length, "\0").encode()) for name in names], np.uint8).view("S1")


def write_model(path, kind="NETCDF4", real="f8", integer="i4"):
    """Two materials of four cubes each, side sets on top and bottom, maps, two times, and what only Exodus has."""
    points, cells = block(2)
    lower = np.flatnonzero(points[cells].mean(axis=1)[:, 2] < 1)
    cells = np.concatenate([cells[lower], np.delete(cells, lower, axis=0)])
    with netcdf.Dataset(path, "w", format=kind) as data:
        data.setncatts({"title": "bracket", "api_version": np.float32(8.03), "floating_point_word_size": np.int32(8)})
        lengths = {"len_name": 33, "len_string": 33, "four": 4, "num_dim": 3, "num_nodes": 27, "num_elem": 8}
        lengths |= {"num_el_blk": 2, "num_side_sets": 2, "num_node_sets": 1, "num_elem_sets": 1, "num_qa_rec": 1}
        lengths |= {"num_el_in_blk1": 4, "num_nod_per_el1": 8, "num_el_in_blk2": 4, "num_nod_per_el2": 8}
        lengths |= {"num_side_ss1": 4, "num_side_ss2": 4, "num_nod_ns1": 3, "num_ele_els1": 2, "num_att_in_blk1": 1}
        lengths |= {"num_nod_var": 4, "num_elem_var": 1, "num_glo_var": 1, "time_step": None}
        for name, length in lengths.items():
            data.createDimension(name, length)

        def put(name, dtype, dimensions, values):
            options = {"zlib": True} if kind.startswith("NETCDF4") and dtype != "S1" else {}
            variable = data.createVariable(name, dtype, dimensions, **options)
            variable.set_auto_chartostring(False)
            variable[:] = values
            return variable

        for axis, column in zip("xyz", points.T, strict=True):
            put(f"coord{axis}", real, ("num_nodes",), column)
        for key, count, ids, names in (
            ("eb", "num_el_blk", [10, 20], ["steel", "foam"]),
            ("ss", "num_side_sets", [100, 200], ["bottom", "top"]),
            ("ns", "num_node_sets", [7], ["clamped"]),
            ("els", "num_elem_sets", [3], ["probes"]),
        ):
            put(f"{key}_prop1", integer, (count,), ids).setncattr("name", "ID")
            put(f"{key}_names", "S1", (count, "len_name"), characters(names))
        for k, part in enumerate((cells[:4], cells[4:]), 1):
            put(f"connect{k}", integer, (f"num_el_in_blk{k}", f"num_nod_per_el{k}"), part + 1).elem_type = "HEX8"
        for k, (elements, side) in enumerate((([1, 2, 3, 4], BOTTOM), ([5, 6, 7, 8], TOP)), 1):
            put(f"elem_ss{k}", integer, (f"num_side_ss{k}",), elements)
            put(f"side_ss{k}", integer, (f"num_side_ss{k}",), side)
        put("dist_fact_ns1", "f8", ("num_nod_ns1",), [0.5, 1.5, 2.5])
        put("node_ns1", integer, ("num_nod_ns1",), [1, 2, 5])
        put("elem_els1", integer, ("num_ele_els1",), [4, 5])
        put("attrib1", "f8", ("num_el_in_blk1", "num_att_in_blk1"), 3.25)
        put("node_num_map", integer, ("num_nodes",), 1000 + 10 * np.arange(27))
        put("elem_num_map", integer, ("num_elem",), 501 + np.arange(8))
        put(
            "qa_records", "S1", ("num_qa_rec", "four", "len_string"), characters(["code", "1.0", "today", "noon"])[None]
        )
        put("time_whole", "f8", ("time_step",), [0.0, 2.5])
        names = ["disp_x", "disp_y", "disp_z", "temp"]
        put("name_nod_var", "S1", ("num_nod_var", "len_name"), characters(names))
        put("name_elem_var", "S1", ("num_elem_var", "len_name"), characters(["stress"]))
        put("name_glo_var", "S1", ("num_glo_var", "len_name"), characters(["energy"]))
        put("vals_glo_var", "f8", ("time_step", "num_glo_var"), [[1.0], [2.0]])
        for k in range(1, 5):
            put(f"vals_nod_var{k}", "f8", ("time_step", "num_nodes"), [k + np.arange(27.0), k - np.arange(27.0)])
        # Foam has no stress.
        put("elem_var_tab", integer, ("num_el_blk", "num_elem_var"), [[1], [0]])
        put("vals_elem_var1eb1", "f8", ("time_step", "num_el_in_blk1"), [np.arange(4.0), np.arange(4.0, 8.0)])
    return path


def contents(path):
    """All that a netCDF file holds, in its order."""
    with netcdf.Dataset(path) as data:
        data.set_auto_maskandscale(False)
        variables = {
            name: (one.dtype.str, one.dimensions, {a: str(one.getncattr(a)) for a in one.ncattrs()}, one[...].tolist())
            for name, one in data.variables.items()
        }
        dimensions = {name: (len(one), one.isunlimited()) for name, one in data.dimensions.items()}
        return data.data_model, dimensions, {a: str(data.getncattr(a)) for a in data.ncattrs()}, variables


@pytest.mark.parametrize("kind", FORMATS)
def test_all_but_the_coordinates_is_as_it_came(kind, tmp_path):
    integer = "i8" if kind in ("NETCDF4", "NETCDF3_64BIT_DATA") else "i4"
    mesh = io.read(write_model(tmp_path / "a.e", kind, integer=integer))
    moved = mesh.replaced(points=mesh.points + 1 / 3)
    (tmp_path / "a.e").rename(tmp_path / "before.e")
    assert io.write(tmp_path / "a.e", moved) == []
    before, after = contents(tmp_path / "before.e"), contents(tmp_path / "a.e")
    assert before[:3] == after[:3]
    assert list(before[3]) == list(after[3])
    for name, column in zip(("coordx", "coordy", "coordz"), moved.points.T, strict=True):
        assert after[3].pop(name)[3] == column.tolist()
        before[3].pop(name)
    assert before[3] == after[3]


def test_what_a_file_says_is_taken_in(tmp_path):
    mesh = io.read(write_model(tmp_path / "a.e"))
    assert mesh.node_labels.tolist() == list(range(1000, 1270, 10))
    assert mesh.cell_labels.tolist() == list(range(501, 509))
    source = mesh.origin.source
    assert {name: value.tolist() for name, value in source.field_data.items()} == {
        "steel": [10, 3],
        "foam": [20, 3],
        "bottom": [100, 2],
        "top": [200, 2],
    }
    assert source.point_sets["clamped"].tolist() == [0, 1, 4]
    assert [part.tolist() for part in source.cell_sets["probes"]] == [[3], [0], [], []]
    np.testing.assert_array_equal(mesh.point_data["disp"], np.arange(27.0)[:, None] + [1, 2, 3])
    np.testing.assert_array_equal(mesh.cell_data["stress"], [0, 1, 2, 3, *[np.nan] * 4])
    # Side sets are tagged quadrilaterals: on the bottom z = 0, on the top z = 2.
    assert [(b.type, len(b.data)) for b in source.cells[2:]] == [("quad", 4), ("quad", 4)]
    bottom, top = (b.data for b in source.cells[2:])
    assert (mesh.points[bottom, 2] == 0).all()
    assert (mesh.points[top, 2] == 2).all()
    kinds = find_embedded(mesh, np.concatenate([bottom, top])).skin_kinds
    assert kinds.tolist() == [kinds[0]] * 4 + [kinds[4]] * 4
    assert kinds[0] != kinds[4]
    assert [part.tolist() for part in source.cell_sets["top"]] == [[], [], [], [0, 1, 2, 3]]
    assert any("first of 2 times" in note for note in mesh.notes)


def test_new_and_changed_arrays_become_variables(tmp_path):
    mesh = io.read(write_model(tmp_path / "a.e"))
    shift, size = np.random.default_rng(0).random((27, 3)), np.arange(8) + 0.5
    changed = mesh.replaced(point_data={"moved_by": shift, "temp": np.full(27, 9.0)}, cell_data={"size": size})
    assert io.write(tmp_path / "b.e", changed) == []
    back = io.read(tmp_path / "b.e")
    assert list(back.point_data) == ["disp", "temp", "moved_by"]
    for name, array in {**changed.point_data, **changed.cell_data}.items():
        np.testing.assert_array_equal({**back.point_data, **back.cell_data}[name], array)
    before, after = contents(tmp_path / "a.e")[3], contents(tmp_path / "b.e")[3]
    assert after["vals_nod_var4"][3] == [[9.0] * 27, before["vals_nod_var4"][3][1]]
    assert after["elem_var_tab"][3] == [[1, 1], [0, 1]]
    assert after["vals_elem_var2eb2"][3] == [size[4:].tolist()] * 2
    assert {name: value for name, value in after.items() if "num_map" in name or "_ss" in name} == {
        name: value for name, value in before.items() if "num_map" in name or "_ss" in name
    }


def test_coordinates_of_32_bits_stay_so_and_that_is_told(tmp_path):
    mesh = io.read(write_model(tmp_path / "a.e", real="f4"))
    lost = io.write(tmp_path / "b.e", mesh.replaced(points=mesh.points / 3))
    assert [text for text in lost if "32 bits" in text] == lost != []
    assert contents(tmp_path / "b.e")[3]["coordx"][0] == "<f4"


def test_other_formats_are_told_to_lose_what_only_exodus_has(tmp_path):
    lost = io.write(tmp_path / "a.vtu", io.read(write_model(tmp_path / "a.e")))
    for what in ("1 later times", "1 global variables", "1 QA records", "1 tables of attributes"):
        assert f"{what} of the exodus file" in lost


def tagged_meshio():
    """Eight cubes of two materials that alternate, tagged faces below and above, two untagged ones, lines."""
    points, cells = block(2)
    faces = np.concatenate([cells[:, [0, 1, 2, 3]], cells[:, [4, 5, 6, 7]]])
    height = points[faces][:, :, 2]
    quads = [faces[(height == z).all(axis=1)] for z in (0, 2)]
    inner = faces[(height == 1).all(axis=1)][:2]
    return meshio.Mesh(
        points,
        [("hexahedron", cells), ("quad", quads[0]), ("quad", quads[1]), ("quad", inner), ("line", cells[:2, :2])],
        cell_data={
            "gmsh:physical": [np.arange(8) % 2 + 4, np.full(4, 8), np.full(4, 9), np.zeros(2, int), np.zeros(2, int)],
            "f": [np.arange(8.0), np.zeros(4), np.zeros(4), np.array([5.0, 6.0]), np.zeros(2)],
        },
        field_data={"iron": np.array([4, 3]), "wood": np.array([5, 3]), "floor": np.array([8, 2])},
        point_sets={"corners": np.array([0, 26])},
        cell_sets={"three": [np.array([0, 3, 5]), *[np.array([], int)] * 4]},
    )


def test_tags_become_blocks_and_side_sets(tmp_path):
    mesh = as_hex_mesh(tagged_meshio())
    assert io.write(tmp_path / "a.e", mesh) == []
    model, dimensions, _, variables = contents(tmp_path / "a.e")
    assert model == "NETCDF3_64BIT_OFFSET"
    # Cells without a tag have blocks of their own.
    assert variables["eb_prop1"][3] == [4, 5, 6, 7]
    assert variables["ss_prop1"][3] == [8, 9]
    assert [b"".join(row).rstrip(b"\0") for row in variables["eb_names"][3]] == [b"iron", b"wood", b"", b""]
    assert [b"".join(row).rstrip(b"\0") for row in variables["ss_names"][3]] == [b"floor", b""]
    assert variables["side_ss1"][3] == [BOTTOM] * 4
    assert variables["side_ss2"][3] == [TOP] * 4
    assert variables["elem_num_map"][3][:8] == [1, 3, 5, 7, 2, 4, 6, 8]
    assert dimensions["num_elem"][0] == 12
    # The cells that the side sets name have their faces there.
    points, cells = mesh.points, np.concatenate([variables["connect1"][3], variables["connect2"][3]]) - 1
    assert (points[cells[np.array(variables["elem_ss1"][3]) - 1][:, :4], 2] == 0).all()
    assert (points[cells[np.array(variables["elem_ss2"][3]) - 1][:, 4:], 2] == 2).all()
    assert list(meshio.read(tmp_path / "a.e").cell_data) == ["f"]
    back = io.read(tmp_path / "a.e").origin.source
    assert back.point_sets["corners"].tolist() == [0, 26]
    rows = [part[chosen] for part, chosen in zip(back.cell_data["f"], back.cell_sets["three"], strict=True)]
    assert sorted(np.concatenate(rows)) == [0, 3, 5]
    assert [block_.type for block_ in back.cells] == ["hexahedron"] * 2 + ["quad", "line"] + ["quad"] * 2


def test_sides_of_curved_cells_are_curved(tmp_path):
    points, cells = block(1)
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    middles = np.array([points[cells[0][list(edge)]].mean(axis=0) for edge in edges])
    nodes = np.r_[cells[0], 8:20][None]
    top = nodes[:, [4, 5, 6, 7, *range(12, 16)]]
    source = meshio.Mesh(np.vstack([points, middles]), [("hexahedron20", nodes), ("quad8", top)])
    source.cell_data = {"gmsh:physical": [np.array([1]), np.array([2])]}
    io.write(tmp_path / "a.e", as_hex_mesh(source, linearize=True))
    assert contents(tmp_path / "a.e")[3]["side_ss1"][3] == [TOP]
    back = io.read(tmp_path / "a.e", linearize=True).origin.source
    np.testing.assert_array_equal(back.cells_dict["quad8"], top)


def test_a_turned_cell_is_written_anew_with_its_sets(tmp_path):
    mesh = io.read(write_model(tmp_path / "a.e"))
    turned = HexMesh(mesh.points, mesh.cells[:, [1, 2, 3, 0, 5, 6, 7, 4]], mesh.point_data, mesh.cell_data, mesh.origin)
    lost = io.write(tmp_path / "b.e", turned)
    assert "node order" in lost[0]
    back = io.read(tmp_path / "b.e")
    np.testing.assert_array_equal(back.cells, turned.cells)
    assert back.cell_labels.tolist() == mesh.cell_labels.tolist()
    assert back.node_labels.tolist() == mesh.node_labels.tolist()
    assert list(back.origin.source.field_data) == ["steel", "foam", "bottom", "top"]


@pytest.mark.parametrize(
    ("variable", "index", "value", "message"),
    [
        ("node_ns1", 1, 28, r"'clamped' has nodes that are not there: 1 \(ids 28\)"),
        ("elem_ss2", 0, 99, r"'top' has elements that are not there: 1 \(ids 99\)"),
        ("elem_els1", 0, 0, r"'probes' has elements that are not there: 1 \(ids 0\)"),
    ],
)
def test_sets_of_what_is_not_there_are_named(variable, index, value, message, tmp_path):
    path = write_model(tmp_path / "a.e")
    with netcdf.Dataset(path, "a") as data:
        data[variable][index] = value
    with pytest.raises(hc.ReadError, match=message):
        io.read(path)
