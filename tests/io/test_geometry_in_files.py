"""Geometry that files carry beside hexahedra, format by format: eight cubes, and what each has of its own."""

import meshio
import numpy as np
import pytest
from meshes.hexahedra import block

import hexconformal as hc
from hexconformal.mesh import boundary_quads, find_embedded

POINTS, CELLS = block(2)
X, Y, Z = POINTS.T
COLUMN = np.flatnonzero((X == 1) & (Y == 1))  # from the floor through the centre to the top
CENTRE = COLUMN[1]


def faces_where(mask):
    """The faces of cells whose nodes are all in a set, each once: the slow way."""
    sides = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    found = {tuple(sorted(cell[list(side)])): cell[list(side)] for cell in CELLS for side in sides}
    return np.array([nodes for nodes in found.values() if mask[nodes].all()])


WALL, FLOOR = faces_where(X == 1), faces_where(Z == 0)


def embedded(path):
    mesh = hc.read(path)
    skin = boundary_quads(mesh.cells)[0]
    found = find_embedded(mesh, skin)
    floor = (mesh.points[skin][:, :, 2] == 0).all(axis=1)
    return found, found.skin_kinds, floor


def assert_tells_apart(kinds, mask):
    """Kinds are two: those in the mask and the others."""
    assert len(np.unique(kinds)) == 2
    assert len(np.unique(kinds[mask])) == len(np.unique(kinds[~mask])) == 1


def same_sets(rows, others):
    return sorted(map(sorted, np.asarray(rows).tolist())) == sorted(map(sorted, np.asarray(others).tolist()))


def deck(more):
    lines = ["*NODE, NSET=NALL", *(f"{k}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(POINTS.tolist(), 1))]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=ALL", *(f"{k}, {text(cell)}" for k, cell in enumerate(CELLS, 1))]
    return "\n".join([*lines, *more]) + "\n"


def text(nodes):
    return ", ".join(str(node + 1) for node in nodes)


def rows_of(kind, cells, name, first):
    return [f"*ELEMENT, TYPE={kind}, ELSET={name}", *(f"{k}, {text(cell)}" for k, cell in enumerate(cells, first))]


def test_shells_and_beams_of_a_deck(tmp_path):
    lines = np.stack([COLUMN[:-1], COLUMN[1:]], axis=1)
    more = (
        rows_of("S4R", WALL[:2], "PLATE", 50) + rows_of("M3D4", WALL[2:], "SKIN", 60) + rows_of("B31", lines, "BAR", 70)
    )
    (tmp_path / "a.inp").write_text(deck(more))
    found, kinds, _ = embedded(tmp_path / "a.inp")
    assert same_sets(found.quads, WALL)
    assert sorted(np.bincount(found.kinds)) == [0, 2, 2]
    assert same_sets(found.edges, lines)
    assert not kinds.any()
    assert found.notes == (
        "kept as patches: quadrilaterals (4 quads), set 'PLATE' (2 quads), set 'SKIN' (2 quads)",
        "kept as curves: lines (2 edges)",
    )


def test_sets_of_nodes_of_a_deck(tmp_path):
    more = [f"*NSET, NSET=FIX\n{text(np.flatnonzero(Z == 0))}", f"*NSET, NSET=TIP\n{CENTRE + 1}"]
    (tmp_path / "a.inp").write_text(deck(more))
    found, kinds, floor = embedded(tmp_path / "a.inp")
    assert_tells_apart(kinds, floor)
    assert found.held.tolist() == [CENTRE]
    assert found.notes == (
        "outlines on the boundary are kept of: node set 'FIX' (4 quads)",
        "held: node set 'TIP' (1 nodes)",
    )


# Corners by the number of a side, as the manuals of Abaqus and CalculiX have them.
SIDES = {1: "1234", 2: "5876", 3: "1562", 4: "2673", 5: "3784", 6: "4851"}


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("by", ["label", "set", "set of a set"])
def test_surfaces_of_a_deck(side, by, tmp_path):
    name = {"label": "3", "set": "ONE", "set of a set": "BOTH"}[by]
    more = [
        "*ELSET, ELSET=ONE",
        "3",
        "*ELSET, ELSET=BOTH",
        "ONE",
        "*SURFACE, NAME=Load, TYPE=ELEMENT",
        f"{name}, S{side}",
    ]
    (tmp_path / "a.inp").write_text(deck(more))
    nodes = CELLS[2][[int(corner) - 1 for corner in SIDES[side]]]
    sets = hc.read(tmp_path / "a.inp").face_sets()
    assert list(sets) == ["Load"]
    assert same_sets(sets["Load"], [nodes])
    found, kinds, _ = embedded(tmp_path / "a.inp")
    skin = boundary_quads(CELLS)[0]
    on_skin = np.array([sorted(quad) == sorted(nodes) for quad in skin.tolist()])
    assert same_sets(found.quads, [nodes] if not on_skin.any() else np.empty((0, 4)))
    assert np.array_equal(kinds > 0, on_skin)
    assert "side set 'Load' (1 quads)" in found.notes[0]


def test_surfaces_of_a_deck_without_sides_are_on_the_boundary(tmp_path):
    low = np.flatnonzero(POINTS[CELLS].mean(axis=1)[:, 2] < 1)
    more = ["*ELSET, ELSET=LOW", ", ".join(map(str, low + 1)), "*SURFACE, NAME=FREE", "LOW,"]
    (tmp_path / "a.inp").write_text(deck(more))
    found, kinds, _ = embedded(tmp_path / "a.inp")
    assert (kinds > 0).sum() == 4 + 8
    assert len(found.quads) == 0


def test_surfaces_of_shells_and_such_that_say_nothing(tmp_path):
    more = rows_of("S4", WALL, "PLATE", 50)
    more += ["*SURFACE, NAME=UP", "PLATE, SPOS", "*SURFACE, NAME=DOWN", "50, SNEG"]
    more += ["*SURFACE, NAME=BAD", "MISSING, S1", "99, S1", "1, S9", "*SURFACE, TYPE=NODE, NAME=N", "1, 1.0"]
    (tmp_path / "a.inp").write_text(deck(more))
    sets = hc.read(tmp_path / "a.inp").face_sets()
    assert {name: len(faces) for name, faces in sets.items()} == {"UP": 4, "DOWN": 1, "BAD": 0}
    found, _, _ = embedded(tmp_path / "a.inp")
    assert sorted(np.bincount(found.kinds)) == [0, 1, 3]


def test_surfaces_of_instances(tmp_path):
    part = deck(["*END PART"]).replace("*NODE", "*PART, NAME=P\n*NODE", 1)
    more = ["*ASSEMBLY, NAME=A", "*INSTANCE, NAME=I, PART=P", "*END INSTANCE", "*INSTANCE, NAME=J, PART=P", "9, 0, 0"]
    more += [
        "*END INSTANCE",
        "*ELSET, ELSET=_S1, INTERNAL, INSTANCE=J",
        "1, 2",
        "*SURFACE, NAME=S",
        "_S1, S1",
        "I.3, S1",
    ]
    (tmp_path / "a.inp").write_text(part + "\n".join([*more, "*END ASSEMBLY"]) + "\n")
    faces = hc.read(tmp_path / "a.inp").face_sets()["S"]
    assert same_sets(faces, [*(CELLS[:2, :4] + len(POINTS)), CELLS[2, :4]])


def test_bars_and_shells_of_nastran(tmp_path):
    lines = [f"GRID,{k},,{x},{y},{z}" for k, (x, y, z) in enumerate(POINTS.tolist(), 1)]
    lines += [f"CHEXA,{k},1,{text(cell[:6])},+\n+,{text(cell[6:])}" for k, cell in enumerate(CELLS, 1)]
    lines += [f"CQUAD4,{k},{2 + k % 2},{text(quad)}" for k, quad in enumerate(WALL, 50)]
    lines += [
        f"CBAR,{k},5,{text(pair)},0.,0.,1." for k, pair in enumerate(zip(COLUMN[:-1], COLUMN[1:], strict=True), 60)
    ]
    lines += [f"CROD,70,6,{1},{CENTRE + 1}"]
    (tmp_path / "a.bdf").write_text("BEGIN BULK\n" + "\n".join(lines).replace(", ", ",") + "\nENDDATA\n")
    found, _, _ = embedded(tmp_path / "a.bdf")
    assert same_sets(found.quads, WALL)
    assert sorted(np.bincount(found.kinds)) == [0, 2, 2]
    assert same_sets(found.edges, np.stack([COLUMN[:-1], COLUMN[1:]], axis=1))
    assert found.held.tolist() == [0, CENTRE]


def gmsh_file(groups, elements):
    """A file of version 2.2: groups are (dimension, number, name), elements (type, physical, geometrical, nodes)."""
    elements = [*elements, *((5, 1, 1, cell) for cell in CELLS)]
    rows = [
        f"{k} {kind} 2 {physical} {geometrical} {' '.join(str(node + 1) for node in nodes)}"
        for k, (kind, physical, geometrical, nodes) in enumerate(elements, 1)
    ]
    names = [f'{dimension} {number} "{name}"' for dimension, number, name in groups]
    nodes = [f"{k} {x} {y} {z}" for k, (x, y, z) in enumerate(POINTS.tolist(), 1)]
    sections = {"PhysicalNames": [len(names), *names], "Nodes": [len(nodes), *nodes], "Elements": [len(rows), *rows]}
    parts = ["$MeshFormat\n2.2 0 8\n$EndMeshFormat"]
    parts += ["\n".join([f"${key}", *map(str, lines), f"$End{key}"]) for key, lines in sections.items()]
    return "\n".join(parts) + "\n"


def test_physical_surfaces_curves_and_points_of_gmsh(tmp_path):
    line, quad, point = 1, 3, 15
    elements = [(quad, 2, 20 + k, nodes) for k, nodes in enumerate(FLOOR)] + [(quad, 3, 30, nodes) for nodes in WALL]
    elements += [(line, 4, 40, nodes) for nodes in zip(COLUMN[:-1], COLUMN[1:], strict=True)]
    elements += [(point, 5, 50, [0])]
    # Version 2 repeats an element for each of its groups.
    elements += [(quad, 6, 30, WALL[0])]
    groups = [(2, 2, "floor"), (2, 3, "baffle"), (1, 4, "wire"), (0, 5, "corner"), (2, 6, "window")]
    (tmp_path / "a.msh").write_text(gmsh_file(groups, elements))
    found, kinds, floor = embedded(tmp_path / "a.msh")
    assert (kinds[~floor] == 0).all()
    assert len(np.unique(kinds[floor])) == 4  # entities of the geometry count, not groups alone
    assert same_sets(found.quads, WALL)
    assert sorted(np.bincount(found.kinds)) == [0, 1, 3]
    assert same_sets(found.edges, np.stack([COLUMN[:-1], COLUMN[1:]], axis=1))
    assert found.held.tolist() == [0]
    whole = "\n".join(found.notes)
    for name in ("set 'floor' (4 quads)", "set 'baffle' (4 quads)", "set 'window' (1 quads)", "vertices (1 nodes)"):
        assert name in whole


def test_groups_of_med(tmp_path):
    pytest.importorskip("h5py")
    quads = np.concatenate([FLOOR, WALL])
    lines = np.stack([COLUMN[:-1], COLUMN[1:]], axis=1)
    tags = [np.array([-1, -1, -2, -2, -3, -3, -3, -3]), np.array([-4, -4]), np.zeros(len(CELLS), int)]
    mesh = meshio.Mesh(
        POINTS,
        [("quad", quads), ("line", lines), ("hexahedron", CELLS)],
        point_data={"point_tags": np.where(np.arange(len(POINTS)) == 26, 9, 0)},
        cell_data={"cell_tags": tags},
    )
    mesh.cell_tags = {-1: ["sol"], -2: ["sol", "appui"], -3: ["voile"], -4: ["fil"]}
    mesh.point_tags = {9: ["capteur"]}
    hc.write(tmp_path / "a.med", mesh)
    found, kinds, floor = embedded(tmp_path / "a.med")
    assert sorted(np.bincount(kinds)) == [2, 2, 20]
    assert (kinds[~floor] == 0).all()
    assert same_sets(found.quads, WALL)
    assert same_sets(found.edges, lines)
    assert found.held.tolist() == [26]
    whole = "\n".join(found.notes)
    for name in (
        "set 'sol' (4 quads)",
        "set 'appui' (2 quads)",
        "set 'voile' (4 quads)",
        "node set 'capteur' (1 nodes)",
    ):
        assert name in whole


def test_side_sets_and_node_sets_of_exodus(tmp_path):
    netcdf = pytest.importorskip("netCDF4")
    path = tmp_path / "a.e"
    low = np.flatnonzero(POINTS[CELLS].mean(axis=1)[:, 2] < 1)
    left = np.flatnonzero(POINTS[CELLS].mean(axis=1)[:, 0] < 1)
    bottom, right = 5, 2  # sides of hexahedra, counted from 1
    with netcdf.Dataset(path, "w") as data:
        sizes = {
            "num_dim": 3,
            "num_nodes": 27,
            "num_elem": 8,
            "num_el_blk": 1,
            "num_el_in_blk1": 8,
            "num_nod_per_el1": 8,
        }
        sizes |= {"num_side_sets": 3, "num_side_ss1": 4, "num_side_ss2": 4, "num_side_ss3": 2, "num_node_sets": 1}
        sizes |= {"num_nod_ns1": 1, "len_name": 33}
        for name, size in sizes.items():
            data.createDimension(name, size)
        for axis, column in zip("xyz", POINTS.T, strict=True):
            data.createVariable(f"coord{axis}", "f8", ("num_nodes",))[:] = column
        connect = data.createVariable("connect1", "i4", ("num_el_in_blk1", "num_nod_per_el1"))
        connect[:], connect.elem_type = CELLS + 1, "HEX8"
        for k, (elements, side) in enumerate([(low, bottom), (left, right), (low[:2], bottom)], 1):
            data.createVariable(f"elem_ss{k}", "i4", (f"num_side_ss{k}",))[:] = elements + 1
            data.createVariable(f"side_ss{k}", "i4", (f"num_side_ss{k}",))[:] = side
        data.createVariable("node_ns1", "i4", ("num_nod_ns1",))[:] = CENTRE + 1
        for key, count, names in (
            ("ss", "num_side_sets", ["floor", "wall", "half"]),
            ("ns", "num_node_sets", ["load"]),
        ):
            characters = np.array([list(name.ljust(33, "\0").encode()) for name in names], np.uint8).view("S1")
            data.createVariable(f"{key}_names", "S1", (count, "len_name"))[:] = characters
    found, kinds, floor = embedded(path)
    assert sorted(np.bincount(kinds)) == [2, 2, 20]
    assert (kinds[~floor] == 0).all()
    assert same_sets(found.quads, WALL)
    assert found.held.tolist() == [CENTRE]
    whole = "\n".join(found.notes)
    for name in ("set 'floor' (4 quads)", "set 'wall' (4 quads)", "set 'half' (2 quads)", "node set 'load' (1 nodes)"):
        assert name in whole
