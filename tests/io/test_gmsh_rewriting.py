"""Files of Gmsh are written as they came, with other coordinates: Gmsh itself finds all of them again."""

import re

import numpy as np
import pytest
from meshes.hexahedra import block

from hexconformal.common.errors import ReadError
from hexconformal.io import read_write as io

VARIANTS = [(2.2, 0), (2.2, 1), (4.1, 0), (4.1, 1)]


def gmsh_file(path, version=4.1, binary=0, partitions=0, save_all=False, order=1, periodic=False, sparse=False):
    """A box of 3 x 3 x 3 hexahedra with groups that overlap."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        for _, tag in gmsh.model.getEntities(1):
            gmsh.model.mesh.setTransfiniteCurve(tag, 4)
        for _, tag in gmsh.model.getEntities(2):
            gmsh.model.mesh.setTransfiniteSurface(tag)
            gmsh.model.mesh.setRecombine(2, tag)
        gmsh.model.mesh.setTransfiniteVolume(1)
        gmsh.model.addPhysicalGroup(3, [1], 7, "left half")
        gmsh.model.addPhysicalGroup(3, [1], 9, "everything")
        gmsh.model.addPhysicalGroup(2, [1], 3, "inlet")
        if periodic:
            gmsh.model.mesh.setPeriodic(2, [2], [1], [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        if sparse:
            old = gmsh.model.mesh.getNodes()[0]
            gmsh.model.mesh.renumberNodes(old, 100 + 7 * np.arange(len(old))[::-1])
        if partitions:
            gmsh.model.mesh.partition(partitions)
        for name, value in (("MshFileVersion", version), ("Binary", binary), ("SaveAll", save_all)):
            gmsh.option.setNumber(f"Mesh.{name}", value)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


def contents(path):
    """Nodes by tag, and all else that Gmsh says of a file."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        tags, points, _ = gmsh.model.mesh.getNodes()
        groups = [
            (group, gmsh.model.getPhysicalName(*group), gmsh.model.getEntitiesForPhysicalGroup(*group).tolist())
            for group in gmsh.model.getPhysicalGroups()
        ]
        types, ids, nodes = gmsh.model.mesh.getElements()
        elements = [types.tolist(), [x.tolist() for x in ids], [x.tolist() for x in nodes]]
        entities = gmsh.model.getEntities()
        owners = [gmsh.model.getPartitions(*entity).tolist() for entity in entities]
        pairs = [sorted(gmsh.model.mesh.getPeriodicNodes(2, tag)[1].tolist()) for dim, tag in entities if dim == 2]
        order = np.argsort(tags)
        return tags[order].tolist(), points.reshape(-1, 3)[order], (groups, elements, entities, owners), pairs
    finally:
        gmsh.finalize()


@pytest.mark.parametrize(("version", "binary"), VARIANTS)
@pytest.mark.parametrize("kind", ["plain", "partitions", "save_all", "quadratic", "sparse"])
def test_all_of_a_file_but_coordinates_stays(version, binary, kind, tmp_path):
    path, written = tmp_path / "a.msh", tmp_path / "b.msh"
    options = {"partitions": {"partitions": 2}, "save_all": {"save_all": True}, "quadratic": {"order": 2}}
    options["sparse"] = {"sparse": True}
    gmsh_file(path, version, binary, **options.get(kind, {}))
    mesh = io.read(path, linearise=kind == "quadratic")
    assert len(mesh.cells) == 27
    lost = io.write(written, mesh.replaced(points=mesh.points * [2, 1, 1] + 1 / 3))
    assert lost == []
    old_tags, old_points, old_rest, _ = contents(path)
    tags, points, rest, _ = contents(written)
    assert (tags, rest) == (old_tags, old_rest)
    np.testing.assert_allclose(points, old_points * [2, 1, 1] + 1 / 3, rtol=1e-15, atol=1e-16)
    again = io.read(written, linearise=kind == "quadratic")
    np.testing.assert_array_equal(again.points[again.cells], mesh.points[mesh.cells] * [2, 1, 1] + 1 / 3)
    np.testing.assert_array_equal(mesh.node_labels[np.argsort(mesh.node_labels)], old_tags)
    if version == 2.2 and kind == "save_all":
        return  # Gmsh itself leaves the groups out
    sets = mesh.origin.source.cell_sets
    assert {name: sum(map(len, sets[name])) for name in ("left half", "everything", "inlet")} == {
        "left half": 27, "everything": 27, "inlet": 9,
    }  # fmt: skip
    assert ("gmsh:partition" in mesh.cell_data) is (kind == "partitions")


@pytest.mark.parametrize(("version", "binary"), VARIANTS)
def test_arrays_are_added_and_replaced(version, binary, tmp_path):
    path = tmp_path / "a.msh"
    gmsh_file(path, version, binary, sparse=True)
    mesh = io.read(path)
    count = len(mesh.points)
    for k in (1, 2):
        mesh = mesh.replaced(cell_data={"q": k * np.arange(27) / 7}, point_data={"v": k * np.ones((count, 3))})
        assert io.write(path, mesh) == []
        mesh = io.read(path)
        np.testing.assert_array_equal(mesh.cell_data["q"], k * np.arange(27) / 7)
        np.testing.assert_array_equal(mesh.point_data["v"], k * np.ones((count, 3)))
    assert path.read_bytes().count(b"$ElementData") == path.read_bytes().count(b"$NodeData") == 1
    assert contents(path)[2][0][0][1] == "inlet"


def _periodic(path):
    return re.search(rb"\$Periodic.*\$EndPeriodic", path.read_bytes(), re.DOTALL)[0]


@pytest.mark.parametrize(("version", "binary"), VARIANTS)
def test_periodic_pairs_are_kept_as_long_as_they_face_each_other(version, binary, tmp_path):
    path, written = tmp_path / "a.msh", tmp_path / "b.msh"
    gmsh_file(path, version, binary, periodic=True, save_all=True)
    mesh = io.read(path)
    pairs = np.concatenate([link[3] for link in mesh.origin.source.gmsh_periodic])
    np.testing.assert_allclose(mesh.points[pairs[:, 0]] - mesh.points[pairs[:, 1]], [[1, 0, 0]] * len(pairs), atol=1e-9)
    assert io.write(written, mesh.replaced(points=mesh.points + [0, 1, 1])) == []
    assert _periodic(written) == _periodic(path)
    if version == 4.1:  # of version 2.2 Gmsh itself reads no pairs
        assert contents(written)[3] == contents(path)[3] != [[]] * 6
    points = mesh.points.copy()
    points[pairs[0, 0]] += 0.01
    (told,) = io.write(written, mesh.replaced(points=points))
    assert told == "the periodic section: 1 pairs of nodes no longer face each other"
    assert b"$Periodic" not in written.read_bytes()


TEXT_22 = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
8
{nodes}
$EndNodes
$Elements
2
4 5 {first}
9 5 {second}
$EndElements
$Mine
as it came
$EndMine
"""


def text_22(first="2 7 1 1 2 3 4 5 6 7 8", second="2 9 1 1 2 3 4 5 6 7 8"):
    nodes = "\n".join(f"{k + 1} {x} {y} {z}" for k, (x, y, z) in enumerate(block(1)[0][block(1)[1][0]].tolist()))
    return TEXT_22.format(nodes=nodes, first=first, second=second)


def test_an_element_of_two_groups_is_one_cell(tmp_path):
    path = tmp_path / "a.msh"
    path.write_text(text_22())
    mesh = io.read(path)
    assert len(mesh.cells) == 1
    assert mesh.notes == ("1 elements are in the file again, for a second physical group: taken once",)
    assert mesh.cell_labels.tolist() == [4]
    io.write(path, mesh.replaced(points=mesh.points + 0.25))
    lines = path.read_text().splitlines()
    assert lines[5].split() == ["1", *(f"{x:g}" for x in mesh.points[0] + 0.25)]
    old = text_22().splitlines()
    assert lines[13:] == old[13:]
    assert lines[:5] == old[:5]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("\n4 5 2", "\n4 34 2"), "Gmsh's type 34 are not supported"),
        (lambda text: text.replace("1 2 3 4 5 6 7 8", "1 2 3 4 5 6 7 88", 1), r"not there: 1 \(ids 88\)"),
        (lambda text: text.replace("\n2\n4 5", "\n3\n4 5"), "announces more elements"),
        (lambda text: text[: text.index("$EndElements")], "not closed"),
        (lambda text: text.replace("\n2 ", "\n1 ", 1), "numbered twice"),
        (lambda text: re.sub(r"\n8 .*\n", "\n", text, count=1), r"truncated"),
    ],
)
def test_damage_is_told(change, message, tmp_path):
    path = tmp_path / "a.msh"
    changed = change(text_22())
    assert changed != text_22()
    path.write_text(changed)
    with pytest.raises(ReadError, match=message):
        io.read(path)


def test_places_on_curves_and_surfaces_go_once_nodes_move(tmp_path):
    path = tmp_path / "a.msh"
    points, cells = block(1)
    rows = "\n".join(" ".join(map(str, row)) for row in np.column_stack([points, points[:, :2]]).tolist())
    text = f"""$MeshFormat
4.1 0 8
$EndMeshFormat
$Nodes
1 8 1 8
2 5 1 8
{chr(10).join(map(str, range(1, 9)))}
{rows}
$EndNodes
$Elements
1 1 1 1
3 1 5 1
1 {" ".join(str(node + 1) for node in cells[0])}
$EndElements
"""
    path.write_text(text)
    mesh = io.read(path)
    assert io.write(path, mesh) == []
    np.testing.assert_array_equal(io.read(path).points, points)
    assert path.read_text().splitlines()[5] == "2 5 1 8"
    assert io.write(path, mesh.replaced(points=points + 1)) == ["the places of 8 nodes on entity 5 of dimension 2"]
    assert path.read_text().splitlines()[5] == "2 5 0 8"
