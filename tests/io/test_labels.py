"""Nodes and cells are called in messages, reports and tables what the file calls them; its sets are known by name."""

import json

import numpy as np
import pytest
import pyvista as pv
from io_decks import read
from meshes.hexahedra import block

import hexconformal as hc
from hexconformal.app.cli import main


def deck(folder, k=3, points=None):
    """A block whose nodes are numbered from 101, and cells from 1001, with sets of its lowest and highest nodes."""
    own, cells = block(k)
    points = own if points is None else points
    text = "*NODE\n" + "".join(f"{n + 101}, {x!r}, {y!r}, {z!r}\n" for n, (x, y, z) in enumerate(points.tolist()))
    text += "*ELEMENT, TYPE=C3D8\n"
    text += "".join(
        f"{n + 1001}, {', '.join(str(node + 101) for node in row)}\n" for n, row in enumerate(cells.tolist())
    )
    for name, rows in (("Floor", np.flatnonzero(own[:, 2] == 0)), ("Lid", np.flatnonzero(own[:, 2] == k))):
        text += f"*NSET, NSET={name}\n" + "".join(f"{row + 101},\n" for row in rows)
    corner = np.flatnonzero((cells == 0).any(axis=1))
    return read(folder, f"{text}*ELSET, ELSET=Corner\n{corner[0] + 1001}\n")


def test_messages_and_reports_have_labels(tmp_path):
    points, _ = block(3)
    points[21] = points[42]
    mesh = deck(tmp_path, points=points)
    findings = {finding.kind: finding for finding in hc.check(mesh)}
    assert findings["coincident points"].ids.tolist() == [21, 42]
    assert "ids 122, 143" in findings["coincident points"].message
    worst = hc.quality(mesh).summary(1).worst[0].id
    assert worst == 1001 + int(hc.quality(mesh).worst(1)[0])
    points[7] = np.nan
    with pytest.raises(hc.MeshError, match="ids 108"):
        hc.regularize(deck(tmp_path, points=points))
    points = block(3)[0]
    points[0] = 2.5
    with pytest.raises(hc.MeshError, match=r"valid at the start: 1 .ids 1001"):
        hc.MeshMotion(deck(tmp_path, points=points), moving="Lid")


def test_labels_on_the_command_line(tmp_path, capsys):
    deck(tmp_path, points=block(3)[0] + np.random.default_rng(0).uniform(-0.2, 0.2, (64, 3)))
    mesh = hc.read(tmp_path / "a.inp")
    assert main(["quality", str(tmp_path / "a.inp"), "--worst", "1", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["worst"][0]["id"] == 1001 + int(hc.quality(mesh).worst(1)[0])
    assert main(["quality", str(tmp_path / "a.inp"), "--worst", "1"]) == 0
    assert f"\n{1001 + int(hc.quality(mesh).worst(1)[0]):>10} " in capsys.readouterr().out


def test_motion_tables_have_labels(tmp_path):
    mesh = deck(tmp_path)
    lid = mesh.node_labels[mesh.named_nodes()["Lid"]]
    rows = [f"1,{label},0,0,0.1" for label in lid]
    (tmp_path / "lid.csv").write_text("\n".join(["step,node,dx,dy,dz", *rows]))
    move = ["move", str(tmp_path / "a.inp"), str(tmp_path / "run"), "--quiet", "--boundary", str(tmp_path / "lid.csv")]
    assert main([*move, "--fixed", "floor"]) == 0
    moved = pv.read(tmp_path / "run" / "last.vtu").points
    away = moved - mesh.points
    assert mesh.node_labels[np.flatnonzero(away[:, 2] > 0.099)].tolist() == lid.tolist()
    assert not away[mesh.named_nodes()["Floor"]].any()
    # The same by the name of the set.
    (tmp_path / "all.csv").write_text("step,dx,dy,dz\n1,0,0,0.1\n")
    move[2], move[-1] = str(tmp_path / "again"), str(tmp_path / "all.csv")
    assert main([*move, "--fixed", "floor", "--moving", "lid"]) == 0
    np.testing.assert_array_equal(pv.read(tmp_path / "again" / "last.vtu").points, moved)


@pytest.mark.parametrize(
    ("table", "words", "text"),
    [
        ("step,node,dx,dy,dz\n1,5,0,0,1\n", [], "not in the mesh: 1 (ids 5); its nodes are called 101, 102, 103"),
        ("step,node,dx,dy,dz\n1,P-1.5,0,0,1\n", [], "not in the mesh: 1 (ids P-1.5)"),
        ("step,dx,dy,dz\n1,0,0,1\n", [], "the table has no column node, moving is None"),
        ("step,node,dx,dy,dz\n1,101,0,0,1\n", ["--moving", "Lid"], "the table names its nodes, moving is 'Lid'"),
        ("step,dx,dy,dz\n1,0,0,1\n", ["--moving", "Top"], "moving='Top' names no point array or group"),
    ],
)
def test_nodes_that_are_not_there(table, words, text, tmp_path, capsys):
    deck(tmp_path)
    (tmp_path / "a.csv").write_text(table)
    assert main(["move", str(tmp_path / "a.inp"), str(tmp_path / "run"), "--boundary", str(tmp_path / "a.csv"), *words])
    assert text in capsys.readouterr().err


def test_sets_of_cells_and_nodes_hold(tmp_path):
    mesh = deck(tmp_path, points=block(3)[0] + np.random.default_rng(0).uniform(-0.1, 0.1, (64, 3)))
    for name, count in (("corner", 8), ("Floor", 16)):
        held = mesh.named_nodes()[name]
        assert held.sum() == count
        points = hc.regularize(mesh, boundary="free", fixed=name, max_iterations=2).points
        np.testing.assert_array_equal(points[held], mesh.points[held])
        assert not np.array_equal(points[~held], mesh.points[~held])
    with pytest.raises(hc.OptionError, match="'Corner'"):
        hc.regularize(mesh, fixed="wall")


def test_arrays_of_cells_are_groups_in_grids(tmp_path):
    mesh = deck(tmp_path)
    hc.write(tmp_path / "a.vtu", mesh)
    again = hc.read(tmp_path / "a.vtu")
    np.testing.assert_array_equal(again.named_nodes()["Corner"], mesh.named_nodes()["Corner"])
    motion = hc.MeshMotion(again, moving="Lid", fixed="Corner")
    assert motion.moving.tolist() == np.flatnonzero(mesh.named_nodes()["Lid"]).tolist()


def test_physical_groups_and_families_by_name():
    import meshio

    points, cells = block(2)
    source = meshio.Mesh(
        points,
        [("hexahedron", cells), ("quad", [[0, 1, 4, 3]])],
        cell_data={"gmsh:physical": [np.arange(8) % 2 + 1, np.array([1])]},
        field_data={"odd": np.array([2, 3]), "wall": np.array([1, 2])},
    )
    names = hc.as_hex_mesh(source).named_nodes()
    assert np.flatnonzero(names["wall"]).tolist() == [0, 1, 3, 4]
    assert np.flatnonzero(names["odd"]).tolist() == np.unique(cells[1::2]).tolist()
    families = meshio.Mesh(
        points, [("hexahedron", cells)], {"point_tags": np.arange(27)}, {"cell_tags": [-np.arange(8)]}
    )
    families.point_tags, families.cell_tags = {3: ["a"], 5: ["a", "b"]}, {-2: ["c"], -7: ["b"]}
    names = hc.as_hex_mesh(families).named_nodes()
    assert np.flatnonzero(names["a"]).tolist() == [3, 5]
    assert np.flatnonzero(names["b"]).tolist() == sorted({5, *cells[7].tolist()})
    assert np.flatnonzero(names["c"]).tolist() == sorted(cells[2].tolist())
