"""Files named .mesh: what Medit's and MFEM's say stays, or holds nodes, or is refused by name."""

import meshio
import numpy as np
import pytest
from meshes.hexahedra import block

import hexconformal as hc
from hexconformal import HexMesh
from hexconformal.common.errors import ReadError
from hexconformal.io import read_write as io

MEDIT = """MeshVersionFormatted {version}
# made by hand
Dimension
3
Vertices {count}
{vertices}
Corners 1
2
Edges
1
4 5 9
RequiredEdges 1
1
Ridges 1
1
RequiredQuadrilaterals
1
1
Quadrilaterals 1
1 2 4 3 7
Hexahedra {cells_count}
{cells}
RequiredVertices
1
27
Normals 1
0 0 1.5e0
End
"""


def medit_text(version=2):
    points, cells = block(2)
    return MEDIT.format(
        version=version,
        count=len(points),
        vertices="\n".join(" ".join(map(str, [*row, 3])) for row in points.tolist()),
        cells_count=len(cells),
        cells="\n".join(" ".join(str(node + 1) for node in [*row, 1]) for row in cells.tolist()),
    )


def test_medit_keywords_hold_nodes_and_stay(tmp_path):
    path = tmp_path / "a.mesh"
    path.write_text(medit_text())
    mesh = io.read(path)
    points, cells = block(2)
    np.testing.assert_array_equal(mesh.points, points)
    np.testing.assert_array_equal(mesh.cells, cells)
    assert np.flatnonzero(mesh.held).tolist() == [0, 1, 2, 3, 4, 26]
    assert mesh.notes[0] == "1 Corners: their nodes are held"
    assert len(mesh.notes) == 5
    assert io.write(path, mesh) == []
    assert path.read_text() == medit_text()
    assert io.write(path, mesh.replaced(points=points / 3, cell_data={"q": np.ones(8)})) == ["cell array 'q'"]
    old, new = medit_text().splitlines(), path.read_text().splitlines()
    first = old.index("Vertices 27") + 1
    assert [line for line in new if line not in ("Vertices", "27")][first - 1 + 27 :] == [
        line for line in old[first + 27 :] if line != "27"
    ]
    np.testing.assert_array_equal(io.read(path).points, points / 3)
    np.testing.assert_array_equal(io.read(path).point_data["medit:ref"], [3] * 27)


def test_single_precision_of_medit_is_not_kept_for_new_coordinates(tmp_path):
    path = tmp_path / "a.mesh"
    path.write_text(medit_text(version=1))
    mesh = io.read(path)
    io.write(path, mesh.replaced(points=mesh.points / 3))
    np.testing.assert_array_equal(io.read(path).points, mesh.points / 3)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Vertices 27", "Vertices 28", "Vertices is truncated"),
        ("RequiredVertices\n1\n27", "RequiredVertices\n1\n28", "RequiredVertices must be numbers of Vertices"),
        ("Dimension\n3", "", "MeshVersionFormatted and Dimension"),
        ("Vertices 27", "Points 27", "no Vertices"),
    ],
)
def test_damage_of_medit_is_told(old, new, message, tmp_path):
    assert old in medit_text()
    (tmp_path / "a.mesh").write_text(medit_text().replace(old, new))
    with pytest.raises(ReadError, match=message):
        io.read(tmp_path / "a.mesh")


@pytest.mark.parametrize("version", [1, 2, 3, 4])
@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_medit_keeps_what_meshio_passes_over(version, order, tmp_path):
    path = tmp_path / "a.meshb"
    integer, real, position = {1: "i4 f4 i4", 2: "i4 f8 i4", 3: "i4 f8 i8", 4: "i8 f8 i8"}[version].split()
    points, cells = block(1)
    keyword = [np.array([3]), np.array([3])]  # the dimension
    data = np.array([1, version], order + "i4").tobytes()

    def section(code, body):
        nonlocal data
        size = 4 + np.dtype(position).itemsize + len(body)
        data += np.array([code], order + "i4").tobytes() + np.array([len(data) + size], order + position).tobytes()
        data += body

    section(3, keyword[1].astype(order + "i4").tobytes())
    record = np.zeros(8, np.dtype([("point", order + real, 3), ("ref", order + integer)]))
    record["point"], record["ref"] = points, 5
    section(4, np.array([8], order + integer).tobytes() + record.tobytes())
    section(10, np.array([1, *(cells[0] + 1), 2], order + integer).tobytes())
    section(13, np.array([1, 4], order + integer).tobytes())  # a corner
    data += np.array([54], order + "i4").tobytes() + np.zeros(1, order + position).tobytes()
    path.write_bytes(data)
    mesh = io.read(path)
    np.testing.assert_array_equal(mesh.points, points)
    lost = io.write(path, mesh.replaced(points=points + 0.5))
    assert lost == (["digits beyond single precision"] if version == 1 else [])
    np.testing.assert_array_equal(meshio.read(path).points, points + 0.5)
    new = path.read_bytes()
    assert len(new) == len(data)
    assert data[-60:] == new[-60:]


MFEM = """MFEM mesh v1.0

# MFEM Geometry Types (see mesh/geom.hpp): ...
dimension
3

elements
1
4 5 0 1 3 2 4 5 7 6

boundary
1
2 3 0 1 3 2

vertices
8
"""
CORNERS = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
NODES = "\nnodes\nFiniteElementSpace\nFiniteElementCollection: {}\nVDim: 3\nOrdering: {}\n\n"


@pytest.mark.parametrize("ordering", [None, 0, 1])
def test_mfem_is_read_and_rewritten(ordering, tmp_path):
    path = tmp_path / "a.mesh"
    rows = "\n".join(" ".join(map(str, row)) for row in CORNERS) + "\n"
    if ordering is None:
        text = MFEM + "3\n" + rows
    elif ordering == 1:
        text = MFEM + NODES.format("H1_3D_P1", 1) + rows
    else:
        text = MFEM + NODES.format("H1_3D_P1", 0) + "\n".join(str(x) for x in np.array(CORNERS).T.ravel()) + "\n"
    path.write_text(text)
    mesh = io.read(path)
    assert mesh.cell_data["attribute"].tolist() == [4]
    np.testing.assert_array_equal(mesh.points, CORNERS)
    np.testing.assert_array_equal(mesh.cells, [[0, 1, 3, 2, 4, 5, 7, 6]])
    assert io.write(path, mesh.replaced(points=mesh.points * 2 + 1 / 3)) == []
    new = io.read(path)
    np.testing.assert_array_equal(new.points, mesh.points * 2 + 1 / 3)
    start = text.index("vertices") if ordering is None else text.index("Ordering")
    assert path.read_text()[:start] == text[:start]
    assert new.origin.source.cell_data["attribute"][1].tolist() == [2]


def test_mfem_is_written(tmp_path):
    points, cells = block(2)
    source = meshio.Mesh(
        points,
        [("hexahedron", cells), ("quad", cells[:2, :4])],
        cell_data={"region": [np.arange(8) + 1, np.array([6, 7])]},
    )
    lost = io.write(tmp_path / "a.mfem", source)
    assert lost == ["the name of the cell array 'region' (kept as attribute)"]
    lines = (tmp_path / "a.mfem").read_text().splitlines()
    assert lines[:4] == ["MFEM mesh v1.0", "", "dimension", "3"]
    assert lines[lines.index("elements") + 3] == "2 5 " + " ".join(map(str, cells[1]))
    assert lines[lines.index("boundary") + 2] == "6 3 " + " ".join(map(str, cells[0, :4]))
    back = io.read(tmp_path / "a.mfem")
    np.testing.assert_array_equal(back.points, points)
    np.testing.assert_array_equal(back.cells, cells)
    io.write(tmp_path / "b.mfem", HexMesh(points, cells))
    assert set(io.read(tmp_path / "b.mfem").cell_data["attribute"]) == {1}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (MFEM + NODES.format("H1_3D_P2", 1) + "0 " * 81, r"H1_3D_P2 .* not supported: .*SetCurvature\(1\)"),
        (MFEM + NODES.format("L2_T1_3D_P1", 1) + "0 " * 24, "L2_T1_3D_P1 .* not supported"),
        (MFEM.replace("MFEM mesh", "MFEM NURBS mesh"), "'MFEM NURBS mesh v1.0' is not supported"),
        (MFEM + "2\n" + "0 0\n" * 8, "three coordinates"),
        (MFEM + "3\n" + "0 0 0\n" * 7, "24 coordinates are announced, 21 are there"),
        (MFEM.replace("4 5 0", "4 9 0"), "geometry 9 are not supported"),
        (MFEM[:60], "no section 'elements'|truncated"),
    ],
)
def test_other_kinds_of_mfem_are_refused_by_name(text, message, tmp_path):
    (tmp_path / "a.mesh").write_text(text)
    with pytest.raises(ReadError, match=message):
        io.read(tmp_path / "a.mesh")


@pytest.mark.parametrize("extension", [".mesh", ".meshb"])
def test_blocks_of_one_type_are_one_section(tmp_path, extension):
    points, cells = hc.generate.box((2, 2, 1))
    blocks = [("hexahedron", cells[:1]), ("hexahedron", cells[1:])]
    mesh = meshio.Mesh(points, blocks, cell_data={"medit:ref": [np.array([5]), np.array([5, 9, 9])]})
    path = tmp_path / f"a{extension}"
    hc.write(path, mesh)
    assert [(block.type, len(block.data)) for block in meshio.read(path).cells] == [("hexahedron", 4)]
    back = hc.read(path)
    np.testing.assert_array_equal(back.cells, cells)
    np.testing.assert_array_equal(back.cell_data["medit:ref"], [5, 5, 9, 9])


def test_sections_of_one_keyword_go_on_with_each_other(tmp_path):
    points, cells = hc.generate.box((2, 1, 1))
    path = tmp_path / "a.mesh"
    hc.write(path, hc.HexMesh(points, cells))
    second = " ".join(map(str, [*(cells[1] + 1), 0]))
    text = path.read_text().replace("Hexahedra\n2\n", "Hexahedra\n1\n").rstrip()
    lines = [line for line in text.splitlines() if line.split() != second.split()]
    path.write_text("\n".join([*lines[:-1], "Hexahedra", "1", second, "End", ""]))
    np.testing.assert_array_equal(hc.read(path).cells, cells)
