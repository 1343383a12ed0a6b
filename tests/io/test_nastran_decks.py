"""Nastran decks: fields, continuations and coordinate systems; written with all but coordinates as they came."""

import re

import meshio
import numpy as np
import pytest
from meshes.hexahedra import block

import hexconformal as hc
from hexconformal import HexMesh, as_hex_mesh
from hexconformal.io import read_write as io
from hexconformal.io.formats.nastran.reals import format_real, parse_real

HEAD = "$ a bracket\nSOL 101\nCEND\nTITLE = test, with commas\nSPC = 5\nBEGIN BULK\nPARAM,POST,-1\n"
TAIL = """PSOLID  3       1
MAT1    1       2.1+5           .3
SPC1    5       123     110     120     130
FORCE   6       110     0       1.      0.      0.      -1.
$ a last comment
ENDDATA
text that Nastran does not read
"""


def grids(kind, points, system=""):
    """GRID cards in one kind of fields; labels are 110, 120, ..."""
    lines = []
    for k, point in enumerate(points, 1):
        texts = [f"{x:.5f}"[:8] for x in point]
        if kind == "free":
            lines.append(f"GRID,{100 + 10 * k},{system},{','.join(texts)},,,")
        elif kind == "small":
            lines.append(f"GRID    {100 + 10 * k:<8}{system:8}{''.join(f'{text:>8}' for text in texts)}        $ here")
        else:
            lines.append(f"GRID*   {100 + 10 * k:<16}{system:16}{texts[0]:<16}{texts[1]:<16}*G{k}")
            lines.append(f"*G{k:<6}{texts[2]:<16}")
    return "\n".join(lines) + "\n"


def elements(kind, cells):
    """CHEXA cards; labels are 501, 502, ..."""
    lines = []
    for k, cell in enumerate(110 + 10 * cells, 501):
        if kind == "free":
            lines.append(f"CHEXA,{k},3,{','.join(map(str, cell[:6]))}\n,{cell[6]},{cell[7]}")
        elif kind == "small":
            first, last = "".join(f"{node:<8}" for node in cell[:6]), "".join(f"{node:<8}" for node in cell[6:])
            lines.append(f"CHEXA   {k:<8}3       {first}+E{k}\n+E{k:<6}{last}")
        else:
            fields = [k, 3, *cell]
            rows = ["".join(f"{field:<16}" for field in fields[j : j + 4]) for j in range(0, 10, 4)]
            lines.append("\n".join(("CHEXA*  " if j == 0 else "*       ") + row for j, row in enumerate(rows)))
    return "\n".join(lines) + "\n"


def coordinates(text):
    """The text of a deck without its coordinates."""
    return re.sub(r"(?m)^(GRID[ ,*].*|\*G.*)$", "", text)


@pytest.mark.parametrize("kind", ["free", "small", "large"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_deck_is_written_as_it_came(kind, end, tmp_path):
    points, cells = block(2)
    text = (HEAD + grids(kind, points) + elements(kind, cells) + TAIL).replace("\n", end)
    (tmp_path / "a.bdf").write_bytes(text.encode() + b"$ \xff\n")
    mesh = io.read(tmp_path / "a.bdf")
    np.testing.assert_array_equal(mesh.points, points)
    np.testing.assert_array_equal(mesh.cells, cells)
    assert mesh.node_labels.tolist() == list(range(110, 380, 10))
    assert mesh.cell_labels.tolist() == list(range(501, 509))
    assert mesh.cell_data["nastran:ref"].tolist() == [3] * 8
    inside = np.flatnonzero((points == 1).all(axis=1))
    moved = points.copy()
    moved[inside] += [1 / 3, -1e-4 / 3, 0]
    lost = io.write(tmp_path / "b.bdf", mesh.replaced(points=moved))
    before, after = ((tmp_path / name).read_bytes().decode("utf-8", "replace") for name in ("a.bdf", "b.bdf"))
    changed = [(a, b) for a, b in zip(before.split("\n"), after.split("\n"), strict=True) if a != b]
    # One node, on one line (in large fields the third coordinate is on a second one, which stays).
    assert len(changed) == 1
    assert changed[0][1].startswith("GRID")
    assert ("here" in changed[0][1]) == (kind == "small")
    back = io.read(tmp_path / "b.bdf")
    error = np.abs(back.points - moved).max()
    assert error < {"free": 1e-13, "small": 1e-6, "large": 1e-13}[kind]
    assert [text for text in lost if "digits" in text] == lost
    assert bool(lost) == (error > 2e-14)


def test_lines_and_numbers_of_every_kind_are_read(tmp_path):
    points, cells = block(1)
    fields = [["0", "0.0", ".0"], ["0.", "0.", "10.-1"], ["0", "1.", ""], ["", "1.D0", "1.0E+0"]]
    fields += [["1.+0", "0", "-0."], ["1.0d0", "0.+5", ".00001+5"], ["+1.", "1.", "0."], ["1.", "1.", ".1E1"]]
    labels = [7, 70, 700, 7000, 70000, 700000, 7000000, 71]
    deck = "".join(f"grid,{label},,{','.join(texts)}\n" for label, texts in zip(labels, fields, strict=True))
    a, b, c, d, e, f, g, h = (labels[k] for k in cells[0])
    deck += f"CHEXA\t1\t1\t{a}\t{b}\t{c}\t{d}\t{e}\t{f}\n\t{g}\t{h}\n"  # tabs, and no name of the continuation
    (tmp_path / "a.nas").write_text(deck)
    mesh = io.read(tmp_path / "a.nas")
    np.testing.assert_array_equal(mesh.points, points)
    np.testing.assert_array_equal(mesh.cells, cells)


def test_continuations_are_found_by_their_names(tmp_path):
    points, cells = block(2)
    lines = (grids("small", points) + elements("small", cells)).splitlines()
    continuations = [line for line in lines if line.startswith("+E")]
    others = [line for line in lines if not line.startswith("+E")]
    (tmp_path / "a.bdf").write_text("\n".join([*others, *continuations[::-1], "ENDDATA"]))
    np.testing.assert_array_equal(io.read(tmp_path / "a.bdf").cells, cells)


SYSTEMS = """CORD2R  5       0       1.      2.      3.      1.      2.      4.      +R
+R      1.      3.      3.
CORD2C* 6               5               0.              0.              *C1
*C1     0.              0.              0.              1.              *C2
*C2     1.              0.              0.
CORD2S,7,6,1.,90.,0.,1.,90.,1.
,2.,90.,0.
"""


@pytest.mark.parametrize("system", [5, 6, 7])
def test_coordinate_systems_are_honoured(system, tmp_path):
    """Each is defined in the one before; positions are worked out here by hand."""
    cells = block(1)[1]
    base = np.array([[1, 60, 30], [2, 60, 30], [2, 60, 80], [1, 60, 80]])
    corners = np.concatenate([base, base + [0, 30, 0]])
    order = np.argsort(cells[0])
    local = (corners[:, [0, 2, 1]] / [1, 1, 30.0] if system == 6 else corners + 0.0)[order]
    if system == 5:
        local = block(1)[0]
    r, s, t = local.T
    if system == 6:
        x, y, z = r * np.cos(np.radians(s)), r * np.sin(np.radians(s)), t
    elif system == 7:
        x = r * np.sin(np.radians(s)) * np.cos(np.radians(t))
        y, z = r * np.sin(np.radians(s)) * np.sin(np.radians(t)), r * np.cos(np.radians(s))
        # Origin at (0, 1) of the cylinder, x axis away from its axis, which is +y of system 5.
        x, y = -y, x + 1
    else:
        x, y, z = r, s, t
    # System 5 has its x axis along +y, its y axis along -x.
    expected = np.stack([1 - y, 2 + x, 3 + z], axis=1)
    text = SYSTEMS + grids("large", local, str(system)) + elements("free", cells) + "ENDDATA\n"
    (tmp_path / "a.bdf").write_text(text)
    mesh = io.read(tmp_path / "a.bdf")
    np.testing.assert_allclose(mesh.points, expected, atol=1e-5)
    moved = mesh.replaced(points=mesh.points + [0.01, 0.02, 0.03])
    io.write(tmp_path / "b.bdf", moved)
    np.testing.assert_allclose(io.read(tmp_path / "b.bdf").points, moved.points, atol=1e-11)
    assert coordinates((tmp_path / "b.bdf").read_text()) == coordinates(text)


def test_the_system_of_grdset_is_that_of_nodes_without_one(tmp_path):
    points, cells = block(1)
    text = SYSTEMS + "GRDSET,,5\n" + grids("free", points[:4]) + grids("free", points, "0").split("\n", 4)[4]
    (tmp_path / "a.bdf").write_text(text + elements("free", cells))
    expected = points.copy()
    expected[:4] = np.stack([1 - points[:4, 1], 2 + points[:4, 0], 3 + points[:4, 2]], axis=1)
    np.testing.assert_allclose(io.read(tmp_path / "a.bdf").points, expected)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("CORD1R,5,110,120,130", r"coordinate system 5 are not supported: it is given by CORD1R"),
        ("CORD2R,5,4,0.,0.,0.,0.,0.,1.\n,1.,0.,0.", r"coordinate system 4 is used, but is not there"),
        ("CORD2R,5,5,0.,0.,0.,0.,0.,1.\n,1.,0.,0.", r"coordinate system 5 is defined by itself"),
        ("CORD2R,5,0,0.,0.,0.,0.,0.,1.\n,0.,0.,2.", r"points of the coordinate system 5 are on a line"),
    ],
)
def test_systems_that_cannot_be_honoured_are_refused_by_name(line, message, tmp_path):
    points, cells = block(1)
    (tmp_path / "a.bdf").write_text(f"{line}\n{grids('free', points, '5')}{elements('free', cells)}")
    with pytest.raises(hc.ReadError, match=message):
        io.read(tmp_path / "a.bdf")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("INCLUDE 'other.bdf'", "includes other files"),
        ("BEGIN SUPER=1", "several parts"),
        ("=,*(1),=,*(0.5),==", "repeat others"),
        ("CIHEX1,900,3,110,120,130,140,150,160\n,170,180", "solid elements that are not supported: 1 CIHEX1"),
        ("GRID,110,,0.,0.,0.", r"nodes numbered twice: 1 \(ids 110\)"),
        ("GRID,7x,,0.,0.,0.", "field 2 of GRID must be an integer, not '7x'"),
        ("GRID,9000,,0.,one,0.", "'one' is not a number"),
        ("CHEXA,900,3,110,120,130,140,150,160\n,170,999", r"not there: 1 \(ids 999\)"),
        ("CHEXA,900,3,110,120,130,140,150,160\n,170,180,190", "CHEXA 900 has 9 nodes"),
        ("CTETRA,900,3,110,120,130", "CTETRA 900 has too few nodes"),
    ],
)
def test_what_is_not_supported_is_refused_by_name(line, message, tmp_path):
    points, cells = block(2)
    (tmp_path / "a.bdf").write_text(f"BEGIN BULK\n{grids('free', points)}{elements('free', cells)}{line}\nENDDATA\n")
    with pytest.raises(hc.ReadError, match=message):
        io.read(tmp_path / "a.bdf")


def test_nodes_of_what_is_set_aside_are_held(tmp_path):
    points, cells = block(2)
    lines = "RBE2,901,110,123,120,130\nCONM2,902,370,,1.0\nCBUSH,903,3,140\n"
    lines += "CORD1R,4,150,160,170\nCBAR,904,3,110,120,1.,0.,0.\n"
    (tmp_path / "a.bdf").write_text(grids("free", points) + elements("free", cells) + lines + TAIL)
    mesh = io.read(tmp_path / "a.bdf")
    assert mesh.node_labels[mesh.held].tolist() == [110, 120, 130, 140, 150, 160, 170, 370]
    assert any("1 RBE2, 1 CONM2, 1 CBUSH" in note for note in mesh.notes)
    assert any("1 CORD1R" in note for note in mesh.notes)
    lost = io.write(tmp_path / "a.vtu", mesh)
    assert {"1 PSOLID of the nastran file", "1 FORCE of the nastran file"} <= set(lost)


def curved():
    """A cube of twenty nodes beside one of eight, and a shell of eight nodes."""
    points, cells = block(1)
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    middles = np.array([points[cells[0][list(edge)]].mean(axis=0) for edge in edges])
    nodes = np.r_[cells[0], 8:20][None]
    return meshio.Mesh(
        np.vstack([points, middles, points + [5, 0, 0]]),
        [("hexahedron20", nodes), ("hexahedron", cells + 20), ("quad8", nodes[:, [4, 5, 6, 7, *range(12, 16)]])],
        cell_data={"gmsh:physical": [np.array([3]), np.array([4]), np.array([4])]},
        field_data={"steel": np.array([3, 3])},
    )


def test_decks_are_written_with_properties_and_known_cards(tmp_path):
    mesh = as_hex_mesh(curved(), linearize=True)
    lost = io.write(tmp_path / "a.bdf", mesh)
    assert "the numbers of 1 groups of cells (numbered anew, to be different)" in lost
    text = (tmp_path / "a.bdf").read_text()
    assert "$ steel\nPSOLID  3       3" in text
    assert "PSOLID  4       4" in text
    assert "PSHELL  5       5" in text
    assert max(map(len, text.splitlines())) <= 80
    back = io.read(tmp_path / "a.bdf", linearize=True)
    assert back.cell_data["nastran:ref"].tolist() == [3, 4]
    for ours, theirs in zip(mesh.origin.source.cells, back.origin.source.cells, strict=True):
        assert ours.type == theirs.type
        np.testing.assert_array_equal(ours.data, theirs.data)
    theirs = meshio.read(tmp_path / "a.bdf")
    np.testing.assert_array_equal(theirs.cells[0].data, mesh.origin.source.cells[0].data)


def test_nastrans_own_order_of_twenty_nodes(tmp_path):
    """Nodes 13 to 16 of the card are on the upright edges, those of the top come last."""
    io.write(tmp_path / "a.bdf", as_hex_mesh(curved(), linearize=True))
    text = (tmp_path / "a.bdf").read_text()
    lines = text[text.index("CHEXA") :].splitlines()[:3]
    nodes = [int(line[k : k + 8]) for line in lines for k in range(8, min(len(line), 72), 8) if line[k : k + 8].strip()]
    x = as_hex_mesh(curved(), linearize=True).points[np.array(nodes[2:]) - 1]
    for place, (a, b) in enumerate([(0, 4), (1, 5), (2, 6), (3, 7), (4, 5), (5, 6), (6, 7), (7, 4)], 12):
        np.testing.assert_array_equal(x[place], (x[a] + x[b]) / 2)


def test_labels_of_another_file_are_those_of_the_deck(tmp_path):
    points, cells = block(1)
    (tmp_path / "a.bdf").write_text(grids("free", points) + elements("free", cells))
    mesh = io.read(tmp_path / "a.bdf")
    turned = HexMesh(mesh.points, mesh.cells[:, [1, 2, 3, 0, 5, 6, 7, 4]], origin=mesh.origin)
    assert "node order" in io.write(tmp_path / "b.bdf", turned)[0]
    back = io.read(tmp_path / "b.bdf")
    np.testing.assert_array_equal(back.cells, turned.cells)
    assert (back.node_labels.tolist(), back.cell_labels.tolist()) == (mesh.node_labels.tolist(), [501])


@pytest.mark.parametrize("width", [8, 16])
def test_numbers_fit_their_field(width):
    rng = np.random.default_rng(0)
    values = rng.choice([-1, 1], 2000) * rng.random(2000) * 10.0 ** rng.integers(-30, 30, 2000)
    for value in [*values.tolist(), 0.0, -0.0, 1e50, -1e-50, 5e-324, 99999999.5, -0.99999999999]:
        text = format_real(value, width)
        assert len(text) <= width
        assert "." in text
        # Sign, point and an exponent of two digits leave five characters fewer for the number.
        assert abs(parse_real(text) - value) <= 0.51 * 10.0 ** (6 - width) * abs(value) + 5e-324
    assert format_real(0.1, 8) == "0.1"


def test_pynastran_reads_what_is_written(tmp_path):
    bdf = pytest.importorskip("pyNastran.bdf.bdf")
    io.write(tmp_path / "a.bdf", as_hex_mesh(curved(), linearize=True))
    points, cells = block(2)
    (tmp_path / "in.bdf").write_text(HEAD + SYSTEMS + grids("small", points, "5") + elements("small", cells) + TAIL)
    mesh = io.read(tmp_path / "in.bdf")
    moved = mesh.replaced(points=mesh.points * 1.1)
    io.write(tmp_path / "b.bdf", moved)
    found = bdf.read_bdf(str(tmp_path / "a.bdf"), debug=None)
    assert [len(found.elements[k].nodes) for k in (1, 2, 3)] == [20, 8, 8]
    assert sorted(found.properties) == [3, 4, 5]
    found = bdf.read_bdf(str(tmp_path / "b.bdf"), debug=None)
    positions = np.array([found.nodes[label].get_position() for label in mesh.node_labels])
    np.testing.assert_allclose(positions, moved.points, atol=1e-5)
    assert (list(found.properties), list(found.loads), list(found.spcs)) == ([3], [6], [5])
