"""Nodes and cells of surfaces are called as the file calls them: in errors, notes and lists of the worst cells."""

import json

import pytest
from program import error_line, run

import surface
from hexconformal.common import MeshError
from surface.quality import require_sound

NODES = {101: "0 0 0", 205: "1 0 0", 300: "1 1 0", 404: "0 1 0", 500: "2 0 0", 7: "5 5 5"}


def gmsh(folder, *triangles, **nodes):
    """A file of some triangles, with numbers from 1001 on."""
    places = NODES | {int(name[1:]): place for name, place in nodes.items()}
    rows = [f"{number} {place}" for number, place in places.items()]
    cells = [f"{1001 + k} 2 2 1 1 {nodes}" for k, nodes in enumerate(triangles)]
    head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n"
    text = "\n".join([str(len(rows)), *rows, "$EndNodes", "$Elements", str(len(cells)), *cells, "$EndElements", ""])
    (folder / "a.msh").write_text(head + text)
    return surface.read(folder / "a.msh")


@pytest.mark.parametrize(
    ("triangles", "nodes", "said"),
    [
        (("101 205 300", "101 300 404", "101 205 500"), {}, r"which side is out: 1 \(ids 1003\)"),
        (("101 205 300", "101 300 101"), {}, r"a repeated node: 1 \(ids 1002\)"),
        (("101 205 300", "300 101 205"), {}, r"the same nodes as an earlier one: 1 \(ids 1002\)"),
        (("101 205 300", "101 205 500"), {}, r"which side is out: 1 \(ids 1002\)"),
        (
            ("101 205 300", "205 101 404", "101 205 500"),
            {},
            r"\(nodes \(101, 205\)\), at cells",
        ),
        (("101 205 300", "205 101 500"), {}, r"cells without area: 1 \(ids 1002\)"),
        (("101 205 300",), {"n300": "nan 0 0"}, r"1 \(ids 300\)"),
    ],
)
def test_errors_have_the_labels_of_the_file(triangles, nodes, said, tmp_path):
    with pytest.raises(MeshError, match=said):
        require_sound(gmsh(tmp_path, *triangles, **nodes))


def test_notes_and_the_worst_cells_have_them_too(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    mesh = gmsh(tmp_path, "101 205 300", "101 300 404", "205 500 300", n300="1.9 0.1 0")
    assert mesh.node_labels.tolist() == list(NODES)
    assert mesh.cell_labels.tolist() == [1001, 1002, 1003]
    assert "points in no cell (kept): 1 (ids 7)" in require_sound(mesh)
    worst = surface.quality(mesh).summary(1).worst[0].id
    assert run("quality a.msh --worst 1 --json worst.json") == 0
    assert json.loads((tmp_path / "worst.json").read_text())["worst"][0]["id"] == worst == 1001
    capsys.readouterr()
    gmsh(tmp_path, "101 205 300", n300="nan 0 0")
    assert run("quality a.msh") == 1
    assert "ids 300" in error_line(capsys)
