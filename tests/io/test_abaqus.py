"""Abaqus and CalculiX decks: read as these programs read them, and written with all but the coordinates as it came."""

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.hexahedra import block

from hexconformal import as_hex_mesh
from hexconformal.common.errors import ReadError
from hexconformal.io import read_write as io


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
    assert [(c.type, len(c.data)) for c in source.cells] == [("quad", 1), ("hexahedron", 2)]
    assert {name: ids.tolist() for name, ids in source.point_sets.items()} == {
        "everything": [0, 1, 2, 3],
        "odd": [0, 2, 11],
    }
    assert {name: [part.tolist() for part in parts] for name, parts in source.cell_sets.items()} == {
        "lower": [[], [0]],
        "upper": [[], [1]],
        "both": [[], [0, 1]],
        "skin": [[0], [1]],
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
        ("*Material, name=Steel", "*Include, input=b.inp", "does not exist"),
        (" lower, upper", " lower, uper", "'uper'"),
        (" 82, 1., 0., 2.", " 82, 1., 0., x", "could not convert"),
        ("81, 82, 83, 84", "81, 82, 83", "8 nodes each: one has too few"),
    ],
)
def test_broken_decks_are_refused(old, new, text, tmp_path):
    (tmp_path / "a.inp").write_text(DECK.replace(old, new, 1))
    with pytest.raises(ReadError, match=text):
        io.read(tmp_path / "a.inp")


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
    assert source.cells[1].type == "wedge15"
    assert source.cells[1].data.tolist() == [[1, 8, 2, 5, 9, 6] * 2 + [1, 8, 2]]
    assert [part.tolist() for part in source.cell_sets["all"]] == [[], [0]]
    assert any("nodes held: 1 wedge15" in note for note in mesh.notes)
    moved = mesh.replaced(points=mesh.points / 3)
    assert io.write(tmp_path / "b.inp", moved) == []
    np.testing.assert_array_equal(io.read(tmp_path / "b.inp", other_cells="keep").points, moved.points)
    assert (tmp_path / "b.inp").read_text().endswith(LOOSE_DECK[LOOSE_DECK.index(" *ELEMENT") :])
