"""Decks that are written anew: numbers, lines and names as Abaqus and CalculiX read them."""

import shutil
import subprocess

import meshio
import numpy as np
import pytest
from io_decks import BRICK, CUBE, UNIT, read
from meshes.hexahedra import block

import hexconformal as hc
from hexconformal.io.formats.abaqus.statements.reals import LARGEST_LENGTH, format_real


def test_reals_have_20_characters_and_all_digits_that_these_can_hold():
    rng = np.random.default_rng(0)
    values = [
        *(rng.uniform(-1, 1, 4000) * 10.0 ** rng.integers(-40, 40, 4000)).tolist(),
        0.0,
        -0.0,
        1e300,
        5e-324,
        1e22,
    ]
    for value in values:
        text = format_real(value)
        assert len(text) <= LARGEST_LENGTH
        assert abs(float(text) - value) <= 1e-13 * abs(value)
        if len(repr(value)) <= LARGEST_LENGTH:
            assert text == repr(value)
    assert float(format_real(-0.123456789012345678)) == -0.123456789012345678
    assert float(format_real(9.716542197571454e-11)) == 9.716542197571454e-11


def quadratic_cube():
    points = [*UNIT]
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    points += [(UNIT[a] + UNIT[b]) / 2 for a, b in edges]
    return meshio.Mesh(np.array(points), [("hexahedron20", [range(20)])], point_sets={"many": np.arange(20)})


def test_lines_have_at_most_16_entries(tmp_path):
    assert hc.write(tmp_path / "a.inp", quadratic_cube()) == []
    text = (tmp_path / "a.inp").read_text()
    assert max(line.rstrip(",").count(",") for line in text.splitlines()) == 15
    assert "14, 15,\n16, 17, 18, 19, 20\n" in text
    back = hc.read(tmp_path / "a.inp", linearize=True).origin.source
    assert back.cells_dict["hexahedron20"].tolist() == [list(range(20))]
    assert back.point_sets["many"].tolist() == list(range(20))


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_calculix_reads_what_is_written(tmp_path):
    mesh = hc.as_hex_mesh(quadratic_cube(), linearize=True)
    points = mesh.points * [1, 2, 3] + [0, 9.716542197571454e-11, -1 / 3]
    hc.write(tmp_path / "a.inp", mesh.replaced(points=points))
    text = (tmp_path / "a.inp").read_text().replace("TYPE=C3D20", "TYPE=C3D20, ELSET=ALL")
    model = "*MATERIAL, NAME=S\n*ELASTIC\n210000., .3\n*SOLID SECTION, ELSET=ALL, MATERIAL=S\n*STEP\n*STATIC\n"
    model += "*BOUNDARY\nmany, 1, 3\n*EL PRINT, ELSET=ALL, TOTALS=ONLY\nEVOL\n*END STEP\n"
    (tmp_path / "a.inp").write_text(text + model)
    deck = hc.read(tmp_path / "a.inp", linearize=True)
    hc.write(tmp_path / "b.inp", deck.replaced(points=deck.points / 7))
    for name, volume in (("a", 6.0), ("b", 6.0 / 343)):
        done = subprocess.run(["ccx", name], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60)
        assert "*ERROR" not in done.stdout
        found = float((tmp_path / f"{name}.dat").read_text().split()[-1])
        assert found == pytest.approx(volume, rel=1e-5)


def test_nodes_of_c3d27_are_in_abaqus_order(tmp_path):
    corners = UNIT[:, :]
    faces = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
    middles = [UNIT.mean(axis=0), *(UNIT[list(face)].mean(axis=0) for face in faces)]
    points = np.concatenate([corners, quadratic_cube().points[8:], middles])
    rows = "".join(f"{label}, {x}, {y}, {z}\n" for label, (x, y, z) in enumerate(points.tolist(), 1))
    nodes = ", ".join(map(str, range(1, 15))) + ",\n" + ", ".join(map(str, range(15, 28)))
    mesh = read(tmp_path, f"*NODE\n{rows}*ELEMENT, TYPE=C3D27\n1, {nodes}\n", linearize=True)
    hc.write(tmp_path / "b.inp", mesh)
    np.testing.assert_array_equal(hc.read(tmp_path / "b.inp", linearize=True).points, points)


def test_names_of_sets_that_decks_cannot_have(tmp_path):
    points, cells = block(1)
    sets = {"a,\n*INCLUDE": np.array([0]), "12": np.array([1]), "side": np.array([2]), "SIDE": np.array([3])}
    mesh = meshio.Mesh(points, [("hexahedron", cells)], point_sets=sets)
    lost = hc.write(tmp_path / "a.inp", mesh)
    back = hc.read(tmp_path / "a.inp").origin.source.point_sets
    assert {name: rows.tolist() for name, rows in back.items()} == {
        "a___INCLUDE": [0],
        "SET_12": [1],
        "side": [2],
        "SIDE_2": [3],
    }
    assert len(lost) == 3


def test_labels_are_kept_when_a_deck_is_written_anew(tmp_path):
    mesh = read(
        tmp_path,
        f"*NODE\n{CUBE}{BRICK}".replace("\n8, ", "\n80, ").replace(", 8", ", 80").replace("\n1, 1,", "\n5, 1,"),
    )
    moved = hc.orient(hc.HexMesh(mesh.points, mesh.cells[:, [4, 5, 6, 7, 0, 1, 2, 3]], origin=mesh.origin))[0]
    hc.write(tmp_path / "b.inp", hc.HexMesh(moved.points, moved.cells[:, [1, 2, 3, 0, 5, 6, 7, 4]], origin=mesh.origin))
    back = hc.read(tmp_path / "b.inp")
    assert back.node_labels.tolist() == [1, 2, 3, 4, 5, 6, 7, 80]
    assert back.cell_labels.tolist() == [5]
