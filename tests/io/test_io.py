"""Files: what each format keeps, and what happens when something is wrong with them."""

import errno
import os
import sys

import meshio
import numpy as np
import pytest
import pyvista as pv
from hex_meshes import block, mixed_grid, mixed_meshio

from hexconformal import HexMesh, as_hex_mesh
from hexconformal.common import files
from hexconformal.common.errors import MeshError, OptionError, ReadError, WriteError
from hexconformal.geometry.closest_point import SurfaceLocator
from hexconformal.io import read_write as io
from hexconformal.io.formats import READ_EXTENSIONS, SURFACE_EXTENSIONS, WRITE_EXTENSIONS
from hexconformal.runs.series import Series

# What each format keeps of arrays: all of them, one with integers, or none.
KEEPS = {
    ".vtu": ("all", "all"),
    ".vtk": ("all", "all"),
    ".msh": ("all", "all"),
    ".inp": ("none", "none"),
    ".mesh": ("one", "one"),
    ".meshb": ("one", "one"),
    ".e": ("all", "none"),
    ".exo": ("all", "none"),
    ".ex2": ("all", "none"),
    ".med": ("all", "all"),
    ".xdmf": ("all", "all"),
    ".xmf": ("all", "all"),
    ".bdf": ("none", "none"),
    ".nas": ("none", "none"),
    ".fem": ("none", "none"),
}


def awkward_mesh():
    """A distorted block with an unreferenced point, quads, and arrays of every kind."""
    points, cells = block(2)
    rng = np.random.default_rng(0)
    points = np.vstack([points + 0.1 * rng.random(points.shape), [[np.pi, 1e-7, -1e3]]])
    source = meshio.Mesh(points, [("hexahedron", cells), ("quad", cells[:4, :4]), ("line", cells[:2, :2])])
    mesh = as_hex_mesh(source)
    return mesh.replaced(
        point_data={"f": rng.random(28), "v": rng.random((28, 3)), "i": rng.integers(-9, 9, 28)},
        cell_data={"f": rng.random(8), "v": rng.random((8, 3)), "i": rng.integers(1, 9, 8)},
    )


def test_every_format_is_tested():
    assert set(KEEPS) == set(WRITE_EXTENSIONS)


@pytest.mark.parametrize("extension", KEEPS)
def test_round_trip(extension, tmp_path):
    mesh = awkward_mesh()
    path = tmp_path / f"mesh{extension}"
    lost = io.write(path, mesh)
    again = io.read(path)
    if extension in (".bdf", ".nas", ".fem"):
        np.testing.assert_allclose(again.points, mesh.points, rtol=1e-9)
        assert any("digits" in text for text in lost)
    else:
        np.testing.assert_array_equal(again.points, mesh.points)
    np.testing.assert_array_equal(again.cells, mesh.cells)
    grid = pv.wrap(io_grid(again))
    assert (grid.celltypes == 9).sum() == 4
    assert (grid.celltypes == 3).sum() == 2
    for keeps, kind, ours, theirs in zip(
        KEEPS[extension],
        ("point", "cell"),
        (mesh.point_data, mesh.cell_data),
        (again.point_data, again.cell_data),
        strict=True,
    ):
        for name, array in ours.items():
            if keeps == "all":
                np.testing.assert_array_equal(theirs[name], array)
                assert f"{kind} array {name!r}" not in lost
            elif keeps == "one" and name == "i":
                np.testing.assert_array_equal(theirs["medit:ref"], array)
            else:
                assert f"{kind} array {name!r}" in lost
    if extension == ".msh":
        assert any("integer type of" in text for text in lost)
    assert not [name for name in os.listdir(tmp_path) if name.startswith(".")]


def io_grid(mesh):
    from hexconformal.io.convert import to_pyvista

    return to_pyvista(mesh)[0].cast_to_unstructured_grid()


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


@pytest.mark.parametrize("binary", [True, False])
def test_gmsh_22_keeps_its_tags_names_and_kind(binary, tmp_path):
    path = tmp_path / "mesh.msh"
    source = mixed_meshio()
    source.cell_data["gmsh:geometrical"] = [np.full(len(c.data), 7) for c in source.cells]
    source.point_data.clear()
    del source.cell_data["p"]
    meshio.write(path, source, file_format="gmsh22", binary=binary)
    mesh = io.read(path)
    np.testing.assert_array_equal(mesh.cell_data["gmsh:physical"], [11] * 5 + [13] * 3)
    lost = io.write(path, mesh.replaced(cell_data={"q": np.arange(8) / 3}, point_data={"T": np.linspace(0, 1, 28)}))
    assert lost == []
    assert path.read_bytes().startswith(b"$MeshFormat\n2.2 %d 8" % binary)
    again = io.read(path)
    np.testing.assert_array_equal(again.points, source.points)
    np.testing.assert_array_equal(again.cell_data["q"], np.arange(8) / 3)
    np.testing.assert_array_equal(again.point_data["T"], np.linspace(0, 1, 28))
    np.testing.assert_array_equal(again.cell_data["gmsh:physical"], mesh.cell_data["gmsh:physical"])
    assert again.cell_data["gmsh:physical"].dtype.kind == "i"
    back = again.origin.source
    np.testing.assert_array_equal(back.field_data["fluid"], [11, 3])
    assert [c.type for c in back.cells] == ["quad", "hexahedron", "line", "hexahedron", "vertex"]


@pytest.mark.parametrize("known", [True, False])
def test_gmsh_41_is_kept_where_meshio_can(known, tmp_path):
    points, cells = block(1)
    quad = cells[:, :4]
    source = meshio.Mesh(points, [("hexahedron", cells), ("quad", quad)])
    source.cell_data = {
        "gmsh:physical": [np.array([5]), np.array([6])],
        "gmsh:geometrical": [np.array([1]), np.array([2])],
    }
    source.field_data = {"solid": np.array([5, 3])}
    tags = np.array([[3, 1]] * 8)
    tags[:4] = [2, 2]
    source.point_data["gmsh:dim_tags"] = tags
    path = tmp_path / "mesh.msh"
    meshio.write(path, source, file_format="gmsh", binary=True)
    mesh = io.read(path)
    if not known:
        mesh = mesh.replaced(point_data={"gmsh:dim_tags": np.array([[3, 1]] * 8)})
    lost = io.write(path, mesh)
    assert path.read_bytes().startswith(b"$MeshFormat\n4.1" if known else b"$MeshFormat\n2.2")
    assert any("entities" in text for text in lost) is not known
    back = io.read(path).origin.source
    assert [part.tolist() for part in back.cell_data["gmsh:physical"]] == [[5], [6]]
    np.testing.assert_array_equal(back.field_data["solid"], [5, 3])


GMSH_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$Entities
0 0 0 1
1 0 0 0 1 1 1 0 0
$EndEntities
$Nodes
1 8 1 8
3 1 0 8
1\n2\n3\n4\n5\n6\n7\n8
0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1
$EndNodes
$Elements
1 1 1 1
3 1 5 1
1 1 2 3 4 5 6 7 8
$EndElements
"""


def test_gmsh_41_without_physical_groups_is_written_back(tmp_path):
    path = tmp_path / "mesh.msh"
    path.write_text(GMSH_41)
    mesh = io.read(path)
    io.write(path, mesh)
    assert path.read_bytes().startswith(b"$MeshFormat\n4.1")
    back = io.read(path)
    np.testing.assert_array_equal(back.points, mesh.points)
    np.testing.assert_array_equal(back.cells, mesh.cells)


def test_abaqus_keeps_sets_and_writes_plain_bricks(tmp_path):
    path = tmp_path / "mesh.inp"
    points, cells = block(2)
    source = meshio.Mesh(points, [("hexahedron", cells), ("quad", cells[:2, :4])])
    source.point_sets = {"clamped": np.array([0, 3])}
    source.cell_sets = {"core": [np.array([1, 2]), np.array([], int)]}
    assert io.write(path, as_hex_mesh(source)) == []
    text = path.read_text()
    assert "TYPE=C3D8\n" in text
    assert "TYPE=S4\n" in text
    back = io.read(path).origin.source
    np.testing.assert_array_equal(back.point_sets["clamped"], [0, 3])
    np.testing.assert_array_equal(back.cell_sets["core"][0], [1, 2])


DECK = """*Heading
 a deck, as a preprocessor writes it
** comment
*Node,
 nset=everything
 10, 0., 0., 0.
 20, 1., 0., 0.
 30, 1., 1., 0.
 40, 0., 1., 0.
*Node
 50, 0., 0., 1.
 60, 1., 0., 1.
 70, 1., 1., 1.
 80, 0., 1., 1.
 81, 0., 0., 2.
 82, 1., 0., 2.
 83, 1., 1., 2.
 84, 0., 1., 2., 0., 0., 1.
*Element, type=S4R
 7, 10, 20, 30, 40
*ELEMENT,
 TYPE=c3d8r, ELSET=lower
 1, 10, 20, 30, 40,
 50, 60, 70, 80
*Element, type=C3D8, elset=upper
 2, 50, 60, 70, 80, 81, 82, 83, 84
*Element, type=SPRINGA
 9, 10, 84
*Nset, nset=odd, generate
 10, 30, 20
*Nset, nset=ODD
 84,
*Elset, elset=both
 lower, upper
*Elset, elset=skin
 7, 2
*Material, name=Steel
*Elastic
 210000., 0.3
*Step
*Static
*Node Output
 U
*End Step
"""


def test_abaqus_deck_is_read_as_abaqus_means_it(tmp_path):
    (tmp_path / "a.inp").write_text(DECK)
    mesh = io.read(tmp_path / "a.inp")
    np.testing.assert_array_equal(mesh.points[mesh.cells[0]], block(1)[0][block(1)[1][0]])
    source = mesh.origin.source
    assert [(c.type, len(c.data)) for c in source.cells] == [("quad", 1), ("hexahedron", 1), ("hexahedron", 1)]
    assert {name: ids.tolist() for name, ids in source.point_sets.items()} == {
        "everything": [0, 1, 2, 3],
        "odd": [0, 2, 11],
    }
    assert {name: [part.tolist() for part in parts] for name, parts in source.cell_sets.items()} == {
        "lower": [[], [0], []],
        "upper": [[], [], [0]],
        "both": [[], [0], [0]],
        "skin": [[0], [], [0]],
    }
    assert "SPRINGA" in mesh.notes[0]


def test_abaqus_deck_keeps_all_but_coordinates(tmp_path):
    (tmp_path / "a.inp").write_text(DECK)
    mesh = io.read(tmp_path / "a.inp")
    assert io.write(tmp_path / "same.inp", mesh) == []
    moved = mesh.replaced(points=mesh.points / 3)
    assert io.write(tmp_path / "b.inp", moved) == []
    np.testing.assert_array_equal(io.read(tmp_path / "b.inp").points, moved.points)
    old, new = DECK.splitlines(), (tmp_path / "b.inp").read_text().splitlines()
    assert [line for line in old if "." not in line] == [line for line in new if "." not in line]
    assert len(old) == len(new)
    assert " 210000., 0.3" in new
    assert next(line for line in new if line.startswith(" 84,")).endswith(", 0., 0., 1.")
    # With cells in another order, or from another format, a plain deck is written.
    from hexconformal.quality.node_order import orient

    mirrored = DECK.replace("50, 60, 70, 80, 81, 82, 83, 84", "81, 82, 83, 84, 50, 60, 70, 80")
    (tmp_path / "c.inp").write_text(mirrored)
    lost = io.write(tmp_path / "c.inp", orient(io.read(tmp_path / "c.inp"))[0])
    assert "all of the file but nodes" in lost[0]
    assert io.read(tmp_path / "c.inp").origin.source.cell_sets.keys() == mesh.origin.source.cell_sets.keys()
    io.write(tmp_path / "d.vtu", mesh)
    assert pv.read(tmp_path / "d.vtu").cell_data["both"].tolist() == [0, 1, 1]


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (" 84, 0., 1., 2., 0., 0., 1.", "", "not there: 1 .ids 84"),
        (" 84, 0., 1., 2.", " 83, 0., 1., 2.", "numbered twice"),
        ("*Material, name=Steel", "*Include, input=b.inp", "includes"),
        (" lower, upper", " lower, uper", "'uper'"),
        (" 82, 1., 0., 2.", " 82, 1., 0., x", "could not convert"),
        ("81, 82, 83, 84", "81, 82, 83", "8 nodes each: one has too few"),
    ],
)
def test_broken_decks_are_refused(old, new, text, tmp_path):
    (tmp_path / "a.inp").write_text(DECK.replace(old, new, 1))
    with pytest.raises(ReadError, match=text):
        io.read(tmp_path / "a.inp")


def test_whatever_holds_a_mesh_can_be_written(tmp_path):
    points, cells = block(1)
    with_tetra = meshio.Mesh(points, [("hexahedron", cells), ("tetra", cells[:, :4])])
    for number, mesh in enumerate([(points, cells), mixed_grid(), with_tetra]):
        io.write(tmp_path / f"{number}.vtu", mesh)
        back = io.read(tmp_path / f"{number}.vtu", other_cells="keep")
        np.testing.assert_array_equal(back.points, as_hex_mesh(mesh, other_cells="keep").points)
    with pytest.raises(OptionError, match="cannot make a mesh of int"):
        io.write(tmp_path / "a.vtu", 3)


def test_who_has_a_surface_or_tetrahedra_is_told(tmp_path):
    points, cells = block(1)
    pv.Sphere().save(tmp_path / "a.stl")
    with pytest.raises(ReadError, match=r"surface\.remesh, and the command remesh"):
        io.read(tmp_path / "a.stl")
    with pytest.raises(WriteError, match=r"surface\.remesh, and the command remesh"):
        io.write(tmp_path / "a.ply", (points, cells))
    with pytest.raises(MeshError, match=r"no hexahedra, only: 1 quad; .* surface\.remesh"):
        as_hex_mesh(meshio.Mesh(points, [("quad", cells[:, :4])]))
    with pytest.raises(MeshError, match=r"no hexahedra, only: 1 tetra$"):
        as_hex_mesh(meshio.Mesh(points, [("tetra", cells[:, :4])]))
    (tmp_path / "a.msh").write_text("hello")
    with pytest.raises(ReadError, match="not a sound gmsh or ansys file"):
        io.read(tmp_path / "a.msh")


LOOSE_DECK = """ *NODE
 1
 2, 1.
 3, 1., 1.,
 4, , 1.
 5, 0., 0., 1.
 6, 1., 0., 1.
 7, 1., 1., 1.
 8, , 1., 1.
 9, 2., 0., 0.
 10, 2., 0., 1.
 *ELEMENT, TYPE=F3D8
 1, 1, 2, 3, 4, 5, 6, 7, 8
*ELEMENT, TYPE=C3D15, ELSET=prisms
 2, 2, 9, 3, 6, 10, 7, 2, 9, 3,
 6, 10, 7, 2, 9, 3
*ELEMENT, TYPE=SPRING1, ELSET=springs
 3, 9
*ELSET, ELSET=all
 prisms, springs
 *BOUNDARY
 1, 1, 3, 0.5
"""


def test_decks_are_read_as_loosely_as_calculix_reads_them(tmp_path):
    (tmp_path / "a.inp").write_text(LOOSE_DECK)
    mesh = io.read(tmp_path / "a.inp", other_cells="keep")
    np.testing.assert_array_equal(mesh.points[mesh.cells[0]], block(1)[0][block(1)[1][0]])
    source = mesh.origin.source
    assert source.cells[1].type == "wedge"
    assert source.cells[1].data.tolist() == [[1, 8, 2, 5, 9, 6]]
    assert [part.tolist() for part in source.cell_sets["all"]] == [[], [0]]
    assert any("C3D15 are taken by their corners" in note for note in mesh.notes)
    moved = mesh.replaced(points=mesh.points / 3)
    assert io.write(tmp_path / "b.inp", moved) == []
    np.testing.assert_array_equal(io.read(tmp_path / "b.inp", other_cells="keep").points, moved.points)
    assert (tmp_path / "b.inp").read_text().endswith(LOOSE_DECK[LOOSE_DECK.index(" *ELEMENT") :])


def curved_meshio(name):
    """Two cells of 20 or 27 nodes, each with nodes of its own, in two blocks."""
    corners = np.concatenate([block(1)[0][block(1)[1][0]], block(1)[0][block(1)[1][0]] + [3, 0, 0]])
    count = {"hexahedron20": 20, "hexahedron27": 27}[name]
    parents = PARENTS[: count - 8]
    points = [np.concatenate([x, [x[list(p)].mean(axis=0) for p in parents]]) for x in (corners[:8], corners[8:])]
    return meshio.Mesh(np.concatenate(points), [(name, [range(count)]), (name, [range(count, 2 * count)])])


EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
FACES = [(0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 1, 2, 3), (4, 5, 6, 7)]
PARENTS = [*EDGES, *FACES, tuple(range(8))]


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


SOLIDS = {
    "hexahedron": (block(1)[0][block(1)[1][0]], ()),
    "hexahedron20": (block(1)[0][block(1)[1][0]], EDGES),
    "tetra": (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), ()),
    "tetra10": (
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
        [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    ),
    "wedge": (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]]), ()),
    "pyramid": (np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]]), ()),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_med_has_solid_cells_the_other_way_round(name, tmp_path):
    """As in Salome's documentation, and in what Gmsh writes: seen from inside, bases go round counter-clockwise."""
    pytest.importorskip("h5py")
    corners, edges = SOLIDS[name]
    points = np.concatenate([corners, *(corners[[edge]].mean(axis=1) for edge in edges)]).astype(float)
    x, cells = block(1)
    mixed = meshio.Mesh(
        np.concatenate([points, x + 5]), [(name, [range(len(points))]), ("hexahedron", cells + len(points))]
    )
    mesh = as_hex_mesh(mixed, other_cells="keep", linearise=True)
    path = tmp_path / "a.med"
    io.write(path, mesh)
    raw = meshio.read(path)
    there = next(block_.data[0] for block_ in raw.cells if block_.type == name)
    y = raw.points[there]
    top = {"hexahedron": 4, "tetra": 3, "wedge": 3, "pyramid": 4}[name.rstrip("0123456789")]
    base = np.cross(y[1] - y[0], y[2] - y[1])
    assert base @ (y[top] - y[0]) < 0
    for middle, edge in zip(y[len(corners) :], edges, strict=True):
        np.testing.assert_array_equal(middle, y[list(edge)].mean(axis=0))
    back = io.read(path, other_cells="keep", linearise=True)
    np.testing.assert_array_equal(back.cells, mesh.cells)
    np.testing.assert_array_equal(
        next(block_.data[0] for block_ in back.origin.source.cells if block_.type == name), np.arange(len(points))
    )


def test_med_families_may_be_in_no_group(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.med"
    points, cells = block(2)
    mesh = meshio.Mesh(points, [("hexahedron", cells)], cell_data={"cell_tags": [np.repeat([-6, -7], 4)]})
    mesh.cell_tags = {-6: ["left", "größe"], -7: ["right"]}
    io.write(path, mesh)
    with h5py.File(path, "a") as file:
        families = next(iter(file["FAS"].values()))["ELEME"]
        del families["FAM_-7_right"]["GRO"]
    for _ in range(2):
        mesh = io.read(path)
        tags = mesh.origin.source.cell_tags
        assert {int(key): names for key, names in tags.items()} == {-7: [], -6: ["left", "größe"]}
        np.testing.assert_array_equal(mesh.cell_data["cell_tags"], np.repeat([-6, -7], 4))
        io.write(path, mesh)


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
    with pytest.raises(ReadError, match="type 'NFACED' are not known"):
        io.read(path)


@pytest.mark.parametrize(
    ("name", "text", "advice"),
    [
        ("a.mesh", "MFEM mesh v1.0\n\ndimension\n3\n", "MFEM's own format"),
        ("a.inp", "# a comment\n8 1 0 0 0\n1 0. 0. 0.\n", r"UCD .* \.avs"),
        ("a.msh", "$NOD\n8\n1 0 0 0\n", "Gmsh 1 .* 4.1"),
    ],
)
def test_formats_of_the_same_extension_are_told_apart(name, text, advice, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(ReadError, match=advice):
        io.read(tmp_path / name)


def test_blocks_of_one_type_are_joined_for_med(tmp_path):
    path = tmp_path / "mesh.med"
    lost = io.write(path, as_hex_mesh(mixed_meshio()))
    assert "point set 'inlet'" in lost
    assert "cell set 'some'" in lost
    again = io.read(path)
    np.testing.assert_array_equal(again.cell_data["gmsh:physical"], [11] * 5 + [13] * 3)
    # A second round, with an array more than the file had names for.
    io.write(path, again.replaced(point_data={"more": np.arange(28.0)}, cell_data={"w": np.arange(8.0)}))
    np.testing.assert_array_equal(io.read(path).cell_data["p"], again.cell_data["p"])
    np.testing.assert_array_equal(io.read(path).point_data["more"], np.arange(28.0))


def test_wedges_keep_their_shape_between_libraries(tmp_path):
    points, cells = block(1)
    points = np.vstack([points, [[2, 0, 0], [2, 0, 1]]])
    wedge = [[4, 8, 6, 5, 9, 7]]
    source = as_hex_mesh(meshio.Mesh(points, [("hexahedron", cells), ("wedge", wedge)]), other_cells="keep")
    io.write(tmp_path / "a.vtu", source)
    volumes = pv.read(tmp_path / "a.vtu").compute_cell_sizes()["Volume"]
    io.write(tmp_path / "b.msh", io.read(tmp_path / "a.vtu", other_cells="keep"))
    back = io.read(tmp_path / "b.msh", other_cells="keep").origin.source
    np.testing.assert_array_equal(back.cells_dict["wedge"], wedge)
    np.testing.assert_allclose(volumes, [1, 0.5])


def test_arrays_of_odd_types_are_kept_or_named(tmp_path):
    mesh = HexMesh(*block(1))
    mesh = mesh.replaced(
        point_data={"tensor": np.arange(72.0).reshape(8, 3, 3), "flag": np.arange(8) > 3},
        cell_data={"name": np.array(["abc"]), "pair": np.ones((1, 2))},
    )
    assert io.write(tmp_path / "a.vtu", mesh) == []
    np.testing.assert_array_equal(io.read(tmp_path / "a.vtu").point_data["tensor"], np.arange(72.0).reshape(8, 9))
    assert io.read(tmp_path / "a.vtu").cell_data["name"].tolist() == ["abc"]
    lost = io.write(tmp_path / "a.msh", mesh)
    assert {"cell array 'name'", "cell array 'pair'"} <= set(lost)
    np.testing.assert_array_equal(io.read(tmp_path / "a.msh").point_data["flag"], np.arange(8) > 3)


def test_writing_changes_nothing_in_memory(tmp_path):
    source = mixed_meshio()
    before = repr((source.points, source.cells, source.point_data, source.cell_data, source.field_data))
    mesh = as_hex_mesh(source)
    for extension in KEEPS:
        lost = io.write(tmp_path / f"mesh_{extension[1:]}{extension}", mesh)
        # The vertex has no counterpart in some formats.
        assert ("1 vertex cells" in lost) == (extension in (".inp", ".mesh", ".meshb"))
    assert repr((source.points, source.cells, source.point_data, source.cell_data, source.field_data)) == before


# Formats that state their counts or their end; the others cannot show that whole lines are missing.
@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".msh", ".mesh", ".meshb", ".e", ".med", ".xdmf"])
def test_truncated_files_are_refused(extension, tmp_path, capfd):
    path = tmp_path / f"mesh{extension}"
    io.write(path, awkward_mesh())
    check_truncations(path, capfd)


@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".msh", ".inp"])
def test_truncated_text_files_are_refused(extension, tmp_path, capfd):
    path = tmp_path / f"mesh{extension}"
    if extension == ".msh":
        meshio.write(path, mixed_meshio_bare(), file_format="gmsh22", binary=False)
    elif extension == ".inp":
        io.write(path, awkward_mesh())
        path.write_bytes(path.read_bytes()[: path.read_bytes().index(b"*ELEMENT") + 80])
    else:
        io_grid(awkward_mesh()).save(path, binary=False)
    check_truncations(path, capfd)


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


SURFACES = (".obj", ".off", ".ply", ".stl", ".vtp", ".vtk", ".vtu", ".msh")


def sphere_file(folder, extension):
    path, sphere = folder / f"sphere{extension}", pv.Sphere(theta_resolution=12, phi_resolution=9)
    if extension == ".vtu":
        sphere.cast_to_unstructured_grid().save(path)
    elif extension in (".off", ".msh"):
        mesh = meshio.Mesh(sphere.points, [("triangle", sphere.regular_faces), ("line", sphere.regular_faces[:2, :2])])
        mesh.cells = mesh.cells[:1] if extension == ".off" else mesh.cells
        meshio.write(path, mesh, file_format={".msh": "gmsh22"}.get(extension))
    else:
        sphere.save(path)
    return path, sphere


@pytest.mark.parametrize("extension", SURFACES)
def test_surfaces_are_read(extension, tmp_path, capfd):
    path, sphere = sphere_file(tmp_path, extension)
    capfd.readouterr()
    surface = io.read_surface(path)
    assert (surface.n_points, surface.n_cells) == (sphere.n_points, sphere.n_cells)
    assert surface.area == pytest.approx(sphere.area, rel=1e-5)
    assert surface.volume == pytest.approx(sphere.volume, rel=1e-5)
    ours = SurfaceLocator.from_pyvista(surface)
    assert ours.faces.shape == (sphere.n_cells, 3)
    assert ours.closest([[0.0, 0.0, 2.0]]).distances[0] == pytest.approx(1.5, rel=1e-6)
    data = path.read_bytes()
    for fraction in (0, 0.02, 0.3, 0.6, 0.97):
        path.write_bytes(data[: int(fraction * len(data))])
        with pytest.raises(ReadError, match="cannot read"):
            io.read_surface(path)
    assert capfd.readouterr() == ("", "")


def test_the_surface_of_solid_cells_is_their_skin(tmp_path):
    points, cells = block(3)
    io.write(tmp_path / "a.vtu", HexMesh(points, cells))
    assert io.read_surface(tmp_path / "a.vtu").n_cells == 2 * 54
    # Faces inside, such as those between two materials, do not belong to it.
    meshio.write(tmp_path / "b.vtu", meshio.Mesh(points, [("hexahedron", cells), ("quad", cells[13:14, :4])]))
    assert io.read_surface(tmp_path / "b.vtu").n_cells == 2 * 54


def test_separate_triangles_are_joined(tmp_path):
    sphere = pv.Sphere(theta_resolution=12, phi_resolution=9)
    corners = sphere.points[sphere.regular_faces].reshape(-1, 3)
    pv.PolyData.from_regular_faces(corners, np.arange(len(corners)).reshape(-1, 3)).save(tmp_path / "soup.vtp")
    surface = io.read_surface(tmp_path / "soup.vtp")
    assert (surface.n_points, surface.n_cells) == (sphere.n_points, sphere.n_cells)


def test_what_is_no_surface_is_refused(tmp_path):
    pv.Line().save(tmp_path / "line.vtp")
    with pytest.raises(MeshError, match="no faces"):
        io.read_surface(tmp_path / "line.vtp")
    sphere = pv.Sphere()
    sphere.points[7] = np.nan
    sphere.save(tmp_path / "nan.vtp")
    with pytest.raises(MeshError, match="NaN"):
        io.read_surface(tmp_path / "nan.vtp")
    (tmp_path / "a.step").write_text("x")
    with pytest.raises(ReadError, match=r"unknown extension \.step"):
        io.read_surface(tmp_path / "a.step")
    for extension in SURFACE_EXTENSIONS:
        (tmp_path / f"bad{extension}").write_bytes(b"\x00\xff\xfe garbage \x80" * 50)
        with pytest.raises(ReadError, match="bad"):
            io.read_surface(tmp_path / f"bad{extension}")


@pytest.mark.parametrize("extension", sorted(set(KEEPS) - {".vtu", ".vtk"}))
@pytest.mark.parametrize(("code", "name"), [(16, "hexagonal_prism"), (26, "quadratic_wedge"), (42, "polyhedron")])
def test_solid_cells_that_meshio_does_not_know_are_named(extension, code, name, tmp_path):
    points, cells = block(3)
    other = [4, *(3, 1, 2, 3), *(3, 1, 2, 5), *(3, 2, 3, 5), *(3, 1, 3, 5)] if code == 42 else {16: 12, 26: 15}[code]
    nodes = other if code == 42 else list(range(other))
    grid = pv.UnstructuredGrid(np.array([8, *cells[0], len(nodes), *nodes]), np.array([12, code], np.uint8), points)
    mesh = as_hex_mesh(grid, other_cells="keep")
    with pytest.raises(WriteError, match=rf"\.vtu, \.vtk\) hold: 1 of type {name}"):
        io.write(tmp_path / f"a{extension}", mesh)


def mixed_meshio_bare():
    mesh = mixed_meshio()
    return meshio.Mesh(mesh.points, mesh.cells)


def check_truncations(path, capfd):
    data = path.read_bytes()
    capfd.readouterr()
    for fraction in (0, 0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97):
        path.write_bytes(data[: int(fraction * len(data))])
        with pytest.raises(ReadError, match="mesh") as caught:
            io.read(path)
        assert str(path) in str(caught.value)
    printed = capfd.readouterr()
    assert (printed.out, printed.err) == ("", "")


@pytest.mark.parametrize("extension", READ_EXTENSIONS)
@pytest.mark.parametrize("content", [b"", b"\x00\xff\xfe garbage \x80" * 50, b"hello\nworld\n1 2 3\n", b"# nothing\n"])
def test_garbage_is_a_read_error(extension, content, tmp_path, capfd):
    path = tmp_path / f"bad{extension}"
    path.write_bytes(content)
    with pytest.raises(ReadError, match="bad"):
        io.read(path)
    assert capfd.readouterr() == ("", "")


def test_a_file_of_another_format_is_a_read_error(tmp_path):
    io.write(tmp_path / "a.vtu", HexMesh(*block(1)))
    for extension in (".vtk", ".msh", ".inp", ".mesh", ".xdmf", ".e", ".med"):
        os.replace(io_copy(tmp_path / "a.vtu"), tmp_path / f"b{extension}")
        with pytest.raises(ReadError):
            io.read(tmp_path / f"b{extension}")


def io_copy(path):
    copy = path.with_name("copy")
    copy.write_bytes(path.read_bytes())
    return copy


def test_what_is_not_there_or_not_known(tmp_path):
    with pytest.raises(ReadError, match="does not exist"):
        io.read(tmp_path / "none.vtu")
    with pytest.raises(ReadError, match="folder"):
        io.read(tmp_path)
    (tmp_path / "a.xyz").write_text("1")
    with pytest.raises(ReadError, match=r"unknown extension \.xyz; known are .*\.vtu"):
        io.read(tmp_path / "a.xyz")
    with pytest.raises(ReadError):
        as_hex_mesh(tmp_path / "none.vtu")
    with pytest.raises(ReadError):
        as_hex_mesh(str(tmp_path / "none.vtu"))
    pv.Sphere().save(tmp_path / "surface.vtk")
    with pytest.raises(MeshError, match=r"surface\.vtk.*no hexahedra"):
        io.read(tmp_path / "surface.vtk")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="everything is readable for root")
def test_unreadable_files(tmp_path):
    (tmp_path / "a.vtu").write_text("x")
    (tmp_path / "a.vtu").chmod(0)
    with pytest.raises(ReadError, match="denied"):
        io.read(tmp_path / "a.vtu")
    tmp_path.chmod(0o500)
    with pytest.raises(WriteError, match="denied"):
        files.check_writable(tmp_path / "b.vtu")


@pytest.mark.parametrize(("extension", "module"), [(".med", "h5py"), (".e", "netCDF4"), (".xdmf", "h5py")])
def test_missing_packages_are_named(extension, module, tmp_path, monkeypatch):
    path = tmp_path / f"a{extension}"
    io.write(path, HexMesh(*block(1)))
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ReadError, match=r"hexconformal\[formats\]"):
        io.read(path)
    with pytest.raises(WriteError, match=r"hexconformal\[formats\]"):
        io.write(path, HexMesh(*block(1)))


def test_places_that_cannot_be_written_to(tmp_path):
    mesh = HexMesh(*block(1))
    with pytest.raises(WriteError, match="does not exist"):
        io.write(tmp_path / "no" / "a.vtu", mesh)
    with pytest.raises(WriteError, match=r"unknown extension \.xyz; known are .*\.msh"):
        io.write(tmp_path / "a.xyz", mesh)
    with pytest.raises(WriteError, match=r"\(none\)"):
        files.check_writable(tmp_path / "a", WRITE_EXTENSIONS)
    (tmp_path / "b.vtu").mkdir()
    with pytest.raises(WriteError, match="folder"):
        io.write(tmp_path / "b.vtu", mesh)


@pytest.mark.parametrize("extension", [".vtu", ".msh", ".xdmf"])
def test_a_failed_write_leaves_the_old_file(extension, tmp_path, monkeypatch):
    path = tmp_path / f"a{extension}"
    io.write(path, HexMesh(*block(1)))
    before = {name: (tmp_path / name).read_bytes() for name in os.listdir(tmp_path)}

    def full(source, target):
        # Side by side, so that the move is one step and not a copy to another disk.
        assert source.parent.parent == target.parent == tmp_path
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(WriteError, match="No space left"):
        io.write(path, HexMesh(*block(2)))
    assert {name: (tmp_path / name).read_bytes() for name in os.listdir(tmp_path)} == before


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_a_writer_that_fails_halfway(tmp_path, monkeypatch):
    def overflow(*_, **__):
        with open("/dev/full", "w") as device:
            device.write("x" * 10**6)

    monkeypatch.setattr(meshio, "write", overflow)
    with pytest.raises(WriteError, match="No space left"):
        io.write(tmp_path / "a.msh", HexMesh(*block(1)))
    assert os.listdir(tmp_path) == []


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


def test_the_companion_of_xdmf(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    io.write("out/a.xdmf", HexMesh(*block(1)))
    assert sorted(os.listdir("out")) == ["a.h5", "a.xdmf"]
    assert os.listdir(".") == ["out"]
    io.write("out/a.xdmf", HexMesh(*block(2)))
    assert len(io.read("out/a.xdmf").cells) == 8
    # Another file's companion is not overwritten.
    with pytest.raises(WriteError, match="companion"):
        io.write("out/a.xmf", HexMesh(*block(1)))
    with pytest.raises(WriteError, match="companion"):
        files.check_writable("out/a.xmf")  # known before the work
    assert len(io.read("out/a.xdmf").cells) == 8


def test_links_stay_links(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link.vtu").symlink_to(tmp_path / "real" / "a.vtu")
    io.write(tmp_path / "link.vtu", HexMesh(*block(1)))
    assert (tmp_path / "link.vtu").is_symlink()
    assert (tmp_path / "real" / "a.vtu").is_file()


def test_series_is_readable_after_every_frame(tmp_path):
    mesh = as_hex_mesh(mixed_grid())
    with Series(tmp_path / "run.pvd") as series:
        for number, time in enumerate([0, 0.25, 1e-3 + 1]):
            series.add(time, mesh.replaced(points=mesh.points * (1 + number)))
            reader = pv.get_reader(tmp_path / "run.pvd")
            assert reader.time_values[-1] == time
            reader.set_active_time_value(time)
            frame = reader.read()[0]
            np.testing.assert_allclose(frame.points, mesh.points * (1 + number))
            assert list(frame.field_data["units"]) == ["mm"]
        with pytest.raises(OptionError, match="later"):
            series.add(0.5, mesh)
    assert sorted(os.listdir(tmp_path / "run_frames")) == ["run_0000.vtu", "run_0001.vtu", "run_0002.vtu"]
    assert str(tmp_path) not in (tmp_path / "run.pvd").read_text()


def test_a_shorter_series_removes_the_frames_of_a_longer_one(tmp_path):
    mesh = HexMesh(*block(1))
    for count in (4, 2):
        with Series(tmp_path / "run.pvd") as series:
            for time in range(count):
                series.add(time, mesh)
        (tmp_path / "run_frames" / "run_notes.vtu").write_text("not ours")
        (tmp_path / "run_frames" / "run_0007.txt").write_text("not ours")
    frames = ["run_0000.vtu", "run_0001.vtu", "run_0007.txt", "run_notes.vtu"]
    assert sorted(os.listdir(tmp_path / "run_frames")) == frames


def test_series_of_surfaces(tmp_path):
    with Series(tmp_path / "flow.pvd") as series:
        series.add(0.0, pv.Sphere())
    reader = pv.get_reader(tmp_path / "flow.pvd")
    assert reader.read()[0].n_points == pv.Sphere().n_points
    assert os.listdir(tmp_path / "flow_frames") == ["flow_0000.vtp"]
    with pytest.raises(WriteError, match="does not exist"):
        Series(tmp_path / "no" / "flow.pvd")
    with pytest.raises(WriteError, match="extension"):
        Series(tmp_path / "flow.vtu")


def test_shared_meshes_survive(shared, tmp_path):
    path = shared / "meshes" / "hex" / "xu_t3_fandisk_input.vtu"
    mesh = io.read(path)
    assert len(mesh.cells) == 357
    for extension in (".vtu", ".vtk", ".msh", ".mesh"):
        io.write(tmp_path / f"a{extension}", mesh)
        again = io.read(tmp_path / f"a{extension}")
        np.testing.assert_array_equal(again.points, mesh.points)
        np.testing.assert_array_equal(again.cells, mesh.cells)
