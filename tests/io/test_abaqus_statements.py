"""Statements of decks that make or change the mesh: honoured, or refused by name; the text around them stays."""

import re

import numpy as np
import pytest
from io_decks import BRICK, CUBE, UNIT, read
from meshes.hexahedra import block

import hexconformal as hc


def rewritten(folder, mesh, points):
    lost = hc.write(folder / "b.inp", mesh.replaced(points=points))
    return (folder / "b.inp").read_bytes().decode("latin-1"), lost


def test_the_text_stays_but_for_coordinates_that_changed(tmp_path):
    deck = f"*heading\nmodel: trägér\n** c\n*node, nset=nAll\n{CUBE}{BRICK}*surface, name=s\nAll, S1\n*step\n"
    deck = deck.replace("7, 1.0, 1.0, 1.0", "7, 1.0,1.00  , +1e0").replace("\n", "\r\n").encode("latin-1")
    mesh = read(tmp_path, deck)
    assert hc.write(tmp_path / "same.inp", mesh) == []
    assert (tmp_path / "same.inp").read_bytes() == deck
    points = mesh.points.copy()
    points[6] += [0.25, 0, 0]
    text, lost = rewritten(tmp_path, mesh, points)
    assert lost == []
    assert text == deck.decode("latin-1").replace("7, 1.0,1.00", "7, 1.25,1.00")
    assert hc.write(tmp_path / "c.vtu", mesh) == ["1 *SURFACE of the abaqus file", "1 *STEP of the abaqus file"]


CAE = f"""*Part, name=B
*Node
{CUBE}*Element, type=C3D8R
1, 1, 2, 3, 4, 5, 6, 7, 8
*Nset, nset=Low, generate
1, 4
*End Part
*Assembly, name=A
*Instance, name=B-1, part=B
*End Instance
*Node
      1,   0.5, 0.5, 2.
*Nset, nset=RP
 1,
*Nset, nset=side, instance=B-1
 Low, 5
*Nset, nset=point
 B-1.7, RP
*Element, type=CONN3D2
 1, 1, B-1.8
*End Assembly
"""


def test_nodes_of_the_assembly_beside_those_of_an_instance(tmp_path):
    mesh = read(tmp_path, CAE)
    np.testing.assert_array_equal(mesh.points, [*UNIT, [0.5, 0.5, 2]])
    assert mesh.node_labels.tolist() == [*(f"B-1.{n}" for n in range(1, 9)), "1"]
    assert mesh.cell_labels.tolist() == [1]
    sets = {name: rows.tolist() for name, rows in mesh.origin.source.point_sets.items()}
    assert sets == {"Low": [0, 1, 2, 3], "RP": [8], "side": [0, 1, 2, 3, 4], "point": [6, 8]}
    assert np.flatnonzero(mesh.held).tolist() == [7, 8]
    assert "1 elements of type CONN3D2 are set aside" in mesh.notes[0]
    text, lost = rewritten(tmp_path, mesh, mesh.points * 2)
    assert lost == []
    np.testing.assert_array_equal(hc.read(tmp_path / "b.inp").points, mesh.points * 2)
    assert [line for line in text.splitlines() if "." not in line] == [x for x in CAE.splitlines() if "." not in x]


def placed(first, second):
    return f"""*PART, NAME=P
*NODE
{CUBE}{BRICK}*END PART
*ASSEMBLY, NAME=A
*INSTANCE, NAME=P-1, PART=P
{first}*END INSTANCE
*INSTANCE, NAME=P-2, PART=P
{second}*END INSTANCE
*ELSET, ELSET=both
P-1.ALL, P-2.1
*END ASSEMBLY
*STEP
"""


def test_two_instances_of_one_part(tmp_path):
    mesh = read(tmp_path, placed("10., 0., 0.\n10., 0., 0., 10., 0., 1., 90.\n", ""))
    np.testing.assert_array_equal(mesh.points[8:], UNIT)
    np.testing.assert_array_equal(mesh.points[:8], np.stack([10 - UNIT[:, 1], UNIT[:, 0], UNIT[:, 2]], axis=1))
    assert mesh.cell_labels.tolist() == ["P-1.1", "P-2.1"]
    assert mesh.origin.source.cell_sets["both"][0].tolist() == [0, 1]
    assert set(mesh.named_nodes()) == {"P-1.ALL", "P-2.ALL", "both"}
    rng = np.random.default_rng(1)
    points = mesh.points + np.round(rng.uniform(-0.1, 0.1, mesh.points.shape), 3)
    text, lost = rewritten(tmp_path, mesh, points)
    assert "the part 'P' as one" in lost[0]
    assert text.endswith(placed("", "").partition("*END INSTANCE\n*ELSET")[2])
    back = hc.read(tmp_path / "b.inp")
    np.testing.assert_allclose(back.points, points, rtol=0, atol=1e-14)
    assert back.cell_labels.tolist() == mesh.cell_labels.tolist()


def test_an_instance_may_have_its_own_mesh(tmp_path):
    deck = f"*PART, NAME=P\n*END PART\n*ASSEMBLY\n*INSTANCE, NAME=I, PART=P\n0., 0., 5.\n*NODE\n{CUBE}{BRICK}"
    mesh = read(tmp_path, f"{deck}*END INSTANCE\n*END ASSEMBLY\n")
    np.testing.assert_array_equal(mesh.points, UNIT + [0, 0, 5])
    assert mesh.node_labels.tolist() == [1, 2, 3, 4, 5, 6, 7, 8]
    rewritten(tmp_path, mesh, mesh.points * 2)
    np.testing.assert_array_equal(hc.read(tmp_path / "b.inp").points, mesh.points * 2)


def test_instances_that_change_alike_keep_their_part(tmp_path):
    mesh = read(tmp_path, placed("", "0., 0., 4.\n"))
    text, lost = rewritten(tmp_path, mesh, mesh.points * [2, 1, 1])
    assert lost == []
    assert text == re.sub(r"(?m)^(\d), 1.0,", r"\1, 2.0,", placed("", "0., 0., 4.\n"))


@pytest.mark.parametrize(
    ("head", "to_points"),
    [
        ("*NODE, SYSTEM=C\n", lambda r, a, z: (r * np.cos(a), r * np.sin(a), z)),
        ("*NODE, SYSTEM=S\n", lambda r, a, b: (r * np.cos(b) * np.cos(a), r * np.cos(b) * np.sin(a), r * np.sin(b))),
    ],
)
def test_nodes_in_cylindrical_and_spherical_coordinates(head, to_points, tmp_path):
    given = UNIT * [1, 40, 30] + [1, 100, 10]
    rows = "".join(f"{label}, {x!r}, {y!r}, {z!r}\n" for label, (x, y, z) in enumerate(given.tolist(), 1))
    mesh = read(tmp_path, head + rows + BRICK)
    r, y, z = given.T
    angle, third = np.radians(y), np.radians(z) if "=S" in head else z
    np.testing.assert_allclose(mesh.points, np.stack(to_points(r, angle, third), axis=1), rtol=0, atol=1e-14)
    points = mesh.points * 1.25
    text, lost = rewritten(tmp_path, mesh, points)
    assert head in text
    np.testing.assert_allclose(hc.read(tmp_path / "b.inp").points, points, rtol=0, atol=1e-14)
    assert all("last digits" in line for line in lost)


def test_nodes_in_systems(tmp_path):
    deck = f"*SYSTEM\n1., 2., 3., 1., 3., 9.\n*NODE\n{CUBE}*SYSTEM\n*NODE\n9, 5., 5., 5.\n{BRICK}"
    mesh = read(tmp_path, deck)
    # Without a third point the z axis stays: x points where y did.
    expected = np.stack([1 - UNIT[:, 1], 2 + UNIT[:, 0], 3 + UNIT[:, 2]], axis=1)
    np.testing.assert_array_equal(mesh.points, [*expected, [5, 5, 5]])
    tilted = read(tmp_path, deck.replace("9.\n", "3.\n1., 2., 4.\n", 1))
    np.testing.assert_allclose(tilted.points[:8], [1, 2, 3] + UNIT[:, [2, 0, 1]], rtol=0, atol=1e-15)
    rewritten(tmp_path, tilted, tilted.points / 2)
    np.testing.assert_allclose(hc.read(tmp_path / "b.inp").points, tilted.points / 2, rtol=0, atol=1e-15)


GENERATED = """*NODE
1, 0., 0., 0.
4, 3., 0., 0.
11, 0., 1., 0.
14, 3., 1., 0.
101, 0., 0., 1.
104, 3., 0., 1.
111, 0., 1., 1.
114, 3., 1., 1.
*NGEN, NSET=low
1, 4, 1
11, 14
*NGEN
101, 104, 1
111, 114, 1
*ELEMENT, TYPE=C3D8
1, 1, 2, 12, 11, 101, 102, 112, 111
*ELGEN, ELSET=E
1, 3, 1, 5
"""


def test_generated_nodes_and_elements(tmp_path):
    mesh = read(tmp_path, GENERATED)
    assert mesh.cell_labels.tolist() == [1, 6, 11]
    assert mesh.node_labels[mesh.cells[2]].tolist() == [3, 4, 14, 13, 103, 104, 114, 113]
    np.testing.assert_allclose(hc.quality(mesh).volume, 1)
    assert mesh.node_labels[mesh.origin.source.point_sets["low"]].tolist() == [1, 4, 11, 14, 2, 3, 12, 13]
    assert mesh.origin.source.cell_sets["E"][0].tolist() == [0, 1, 2]
    points = mesh.points + np.sin(mesh.points[:, ::-1]) / 8 * [1, 1, 0]
    points[[8, 13]] = mesh.points[[8, 13]]
    _, lost = rewritten(tmp_path, mesh, points)
    assert sum("NGEN" in line for line in lost) == 1
    assert any("8 nodes that it makes" in line for line in lost)
    back = hc.read(tmp_path / "b.inp")
    order = [back.node_labels.tolist().index(label) for label in mesh.node_labels]
    np.testing.assert_allclose(back.points[order], points, rtol=0, atol=1e-16)
    assert sorted(back.node_labels[back.origin.source.point_sets["low"]]) == [1, 2, 3, 4, 11, 12, 13, 14]


def test_elements_are_generated_in_rows_and_layers(tmp_path):
    points, _ = block(2)
    rows = "".join(f"{label}, {x}, {y}, {z}\n" for label, (x, y, z) in enumerate(points.tolist(), 1))
    first = block(2)[1][0]
    steps = [int(first[1] - first[0]), int(first[3] - first[0]), int(first[4] - first[0])]
    data = f"1, 2, {steps[0]}, 1, 2, {steps[1]}, 2,\n 2, {steps[2]}, 4\n"
    nodes = ", ".join(str(node + 1) for node in first.tolist())
    mesh = read(tmp_path, f"*NODE\n{rows}*ELEMENT, TYPE=C3D8\n1, {nodes}\n*ELGEN\n{data}")
    assert mesh.cell_labels.tolist() == [1, 2, 3, 4, 5, 6, 7, 8]
    assert {tuple(cell) for cell in mesh.cells.tolist()} == {tuple(cell) for cell in block(2)[1].tolist()}


def test_included_files_are_read_and_their_text_is_kept(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "nodes.txt").write_text(CUBE)
    (tmp_path / "elements.inp").write_text(BRICK)
    deck = (
        "*NODE, INPUT=parts/nodes.txt, NSET=N\n*INCLUDE, INPUT=elements.inp\n*AMPLITUDE, INPUT=a.txt, NAME=A\n*STEP\n"
    )
    mesh = read(tmp_path, deck)
    np.testing.assert_array_equal(mesh.points, UNIT)
    assert "parts/nodes.txt, elements.inp" in mesh.notes[0]
    assert "stay where they are: a.txt" in mesh.notes[1]
    text, _ = rewritten(tmp_path, mesh, UNIT * 2)
    assert text == f"*NODE, NSET=N\n{CUBE.replace('1.0', '2.0')}{BRICK}*AMPLITUDE, INPUT=a.txt, NAME=A\n*STEP\n"


@pytest.mark.parametrize(
    ("deck", "text"),
    [
        ("*NMAP, NSET=N\n", r"\*NMAP is not supported"),
        ("*NFILL\nA, B, 3, 10\n", r"\*NFILL is not supported"),
        ("*NCOPY, OLD SET=A, CHANGE NUMBER=100, SHIFT\n", r"\*NCOPY is not supported"),
        ("*ELCOPY\n", r"\*ELCOPY is not supported"),
        ("*SYMMETRIC MODEL GENERATION, REVOLVE\n", r"\*SYMMETRIC MODEL GENERATION is not supported"),
        ("*NGEN, LINE=C\n1, 2, 1\n", r"\*NGEN with LINE=C is not supported"),
        ("*NGEN\n1, 20, 1\n", "refers to the node 20, which is not there"),
        ("*NGEN\n1, 8, 2\n", "a step that leads from one to the other"),
        ("*NODE, SYSTEM=X\n9, 0, 0, 0\n", "SYSTEM=X is not supported"),
        ("*NODE\n9, <height>, 0, 0\n", "parameters are not supported: '<height>'"),
        ("*SYSTEM\n0,0,0,1,0,0\n2,0,0\n", "must not lie on a line"),
        ("*ELGEN\n9, 2\n", "refers to the element 9, which is not there"),
        ("*ASSEMBLY\n*INSTANCE, LIBRARY=old, INSTANCE=P\n", "of a previous analysis is not supported"),
        ("*ASSEMBLY\n*INSTANCE, NAME=I, PART=P\n", "of the part 'P', which is not there"),
        ("*PART, NAME=P\n*NODE\n1, 0, 0, 0\n", "has no end: the file is truncated"),
        ("*PART, NAME=P\n*END ASSEMBLY\n", "END ASSEMBLY is out of place"),
        ("*END PART\n", "END PART is out of place"),
        ("*END INSTANCE\n", "END INSTANCE is out of place"),
        ("*NSET, NSET=A\nB\n*NSET, NSET=B\nA\n", "'[AB]' refers to itself"),
        ("*NSET, NSET=A, INSTANCE=I\n1\n", "the instance 'I', which is not there"),
        ("*INCLUDE, INPUT=../b.inp\n", "outside its folder"),
        ("*INCLUDE, INPUT=b.inp\n", "'b.inp', which does not exist"),
        ("*INCLUDE, INPUT=a.inp\n", "too deep, or too often"),
    ],
)
def test_what_is_not_supported_is_refused_by_name(deck, text, tmp_path):
    with pytest.raises(hc.ReadError, match=text):
        read(tmp_path, f"*NODE\n{CUBE}{BRICK}{deck}")


def test_elements_that_are_set_aside_hold_their_nodes(tmp_path):
    points, cells = block(3)
    points = points + np.random.default_rng(0).uniform(-0.1, 0.1, points.shape)
    rows = "".join(f"{label}, {x!r}, {y!r}, {z!r}\n" for label, (x, y, z) in enumerate(points.tolist(), 1))
    deck = f"*NODE\n{rows}*ELEMENT, TYPE=C3D8\n"
    lines = [f"{label}, {', '.join(map(str, cell))}\n" for label, cell in enumerate((cells + 1).tolist(), 1)]
    deck += "".join(lines[:-1]) + "*ELEMENT, TYPE=SC8R\n"
    first, second = lines[-1].rsplit(",", 3)[0], lines[-1].rsplit(",", 3)[1:]
    mesh = read(tmp_path, f"{deck}{first},\n{','.join(second)}")
    assert np.flatnonzero(mesh.held).tolist() == sorted(cells[-1].tolist())
    result = hc.regularize(mesh, boundary="free", max_iterations=3)
    assert any("1 elements of type SC8R are set aside" in note for note in result.report.notes)
    np.testing.assert_array_equal(result.points[cells[-1]], points[cells[-1]])
    assert not np.array_equal(result.points, points)
