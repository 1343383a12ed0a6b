"""Meshes of several types: what is refused, the order of cells, faces between types, pieces."""

import numpy as np
import pytest
from meshes.hexahedra import block
from meshes.linear_cells import renumberings
from meshes.mixed import cut_block, faces_by_nodes, four_types, mixed_block

from hexconformal import MeshError, MixedMesh
from hexconformal.elements import TETRAHEDRON
from hexconformal.mesh import (
    CellBlock,
    HexMesh,
    blocks_of,
    boundary_quads,
    cells_in_rows,
    components,
    face_table,
    flat_nodes,
)
from hexconformal.quality.mixed_checks import split_quads


def test_cells_are_in_the_order_of_their_places():
    mesh = four_types()
    rows = [row for one in mesh.blocks for row in one.cells.tolist()]
    assert flat_nodes(mesh.blocks).tolist() == [node for row in rows for node in row]
    order = np.random.default_rng(0).permutation(len(rows))
    starts = np.cumsum([0] + [len(one.cells) for one in mesh.blocks])
    blocks = tuple(
        CellBlock(one.cell_type, one.cells, order[start : start + len(one.cells)])
        for one, start in zip(mesh.blocks, starts[:-1], strict=True)
    )
    shuffled = MixedMesh(mesh.points, blocks)
    expected = [rows[k] for k in np.argsort(order)]
    assert shuffled.cells.tolist() == [node for row in expected for node in row]
    assert [np.unique(row).tolist() for row in shuffled.table] == [sorted(row) for row in expected]


def test_cells_of_a_row_of_places():
    mesh = four_types()
    assert cells_in_rows(mesh, slice(2, 5), 4).tolist() == mesh.blocks[0].cells[2:5].tolist()
    assert cells_in_rows(mesh, slice(9, 11), 6).tolist() == mesh.blocks[2].cells.tolist()
    hexes = HexMesh(*block(2))
    assert cells_in_rows(hexes, slice(3, 5), 8).tolist() == hexes.cells[3:5].tolist()
    # In rows of eight, as the hexahedra of a file have, other types have nodes several times.
    both = cells_in_rows(mesh, slice(8, 11), 8)
    assert both[0].tolist() == mesh.blocks[1].cells[0].tolist()
    assert both[1].tolist() == mesh.blocks[2].cells[0][[0, 1, 2, 2, 3, 4, 5, 5]].tolist()


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        ({}, "no cells"),
        ({"tetra": np.empty((0, 4), int)}, "no cells"),
        ({"tetra20": [range(20)]}, "types of cells must be some of hexahedron, wedge, pyramid, tetra, .*, not tetra20"),
        ({"wedge": [[0, 1, 2, 3, 4]]}, r"\(m, 6\) array of wedges"),
        ({"tetra": [[0.5, 1, 2, 3]]}, "integer node ids"),
    ],
)
def test_what_makes_no_sense_is_refused(cells, said):
    with pytest.raises(MeshError, match=said):
        MixedMesh.of_types(np.zeros((8, 3)), cells)


@pytest.mark.parametrize(
    ("blocks", "said"),
    [
        ([([[0, 1, 2, 3]], [1])], "all numbers from 0 on"),
        ([([[0, 1, 2, 3]], [0]), ([[0, 1, 2, 3]], [1])], "one for each type"),
        ([([[0, 1, 2, 3]] * 2, [0])], "a place for each"),
    ],
)
def test_blocks_that_do_not_fit_are_refused(blocks, said):
    made = tuple(CellBlock(TETRAHEDRON, np.array(cells), np.array(places)) for cells, places in blocks)
    with pytest.raises(MeshError, match=said):
        MixedMesh(np.zeros((4, 3)), made)


def test_arrays_are_read_only_and_replaced():
    mesh = four_types().replaced(cell_data={"number": np.arange(13)})
    assert not mesh.points.flags.writeable
    assert not mesh.blocks[0].cells.flags.writeable
    moved = mesh.replaced(2 * mesh.points, point_data={"height": mesh.points[:, 2]})
    assert moved.cell_data["number"].tolist() == list(range(13))
    assert moved.points.max() == 2 * mesh.points.max()
    with pytest.raises(MeshError, match="points must be as many"):
        mesh.replaced(mesh.points[:-1])
    with pytest.raises(MeshError, match="first axis 13"):
        mesh.replaced(cell_data={"number": np.arange(12)})


def runs_the_other_way(one, other):
    turned = other[::-1]
    k = turned.index(one[0])
    return turned[k:] + turned[:k] == one


def with_a_mirrored_cell_of_each_type(mesh):
    cells = {one.cell_type.name: one.cells.copy() for one in blocks_of(mesh)}
    for one in blocks_of(mesh):
        cells[one.cell_type.name][0] = one.cells[0][list(one.cell_type.mirrored)]
    return MixedMesh.of_types(mesh.points, cells)


FITTING = [HexMesh(*block(3)), four_types(), cut_block(2), mixed_block(2)]


@pytest.mark.parametrize("mesh", FITTING + [with_a_mirrored_cell_of_each_type(mesh) for mesh in FITTING])
def test_faces_are_those_of_the_cells_one_at_a_time(mesh):
    table, expected = face_table(mesh.cells if isinstance(mesh, HexMesh) else mesh.table), faces_by_nodes(mesh)
    assert len(table.quads) == len(expected)
    for quad, cells, count, sign in zip(
        table.quads.tolist(), table.cells, table.counts, table.orientation, strict=True
    ):
        owners = expected[frozenset(quad)]
        nodes = dict(owners)
        assert count == len(owners)
        assert sorted(cells[cells >= 0]) == [place for place, _ in owners]
        first = quad[:3] if quad[2] == quad[3] else quad
        assert runs_the_other_way(first, nodes[cells[0]][::-1])
        assert sign == (0 if count == 1 else 1 if runs_the_other_way(first, nodes[cells[1]]) else -1)


def test_faces_between_types_are_shared():
    mesh = four_types()
    faces = face_table(mesh.table)
    triangle = faces.quads[:, 2] == faces.quads[:, 3]
    # Three cubes have 16 faces, two of them inside; four of the boundary are cut into triangles of tetrahedra, and two
    # by wedges, which have one quadrilateral between them.
    assert (faces.counts[~triangle] == 1).sum() == 4 + 1 + 3 + 1 - 1
    assert (faces.counts[triangle] == 1).sum() == 4 * 2 + 2 * 2
    assert set(faces.counts.tolist()) == {1, 2}
    assert (faces.orientation[faces.counts == 2] == 1).all()
    assert (faces.orientation[faces.counts == 1] == 0).all()
    # The boundary is closed: every edge is gone along both ways.
    rows = [row[: 3 + (row[2] != row[3])] for row in faces.quads[faces.counts == 1].tolist()]
    edges = [pair for row in rows for pair in zip(row, row[1:] + row[:1], strict=True)]
    assert sorted(edges) == sorted((b, a) for a, b in edges)
    assert not split_quads(faces).any()


def test_a_mirrored_cell_disagrees_with_all_around_it():
    mesh = cut_block(3)
    orders = np.random.default_rng(0).choice(np.array(renumberings(TETRAHEDRON)), 162)
    cells = np.take_along_axis(mesh.blocks[0].cells, orders, axis=1)
    cells[70] = cells[70][list(TETRAHEDRON.mirrored)]
    faces = face_table(MixedMesh.of_types(mesh.points, {"tetra": cells}).table)
    opposed = (faces.orientation != 1) & (faces.counts == 2)
    assert (faces.orientation[opposed] == -1).all()
    assert ((faces.cells[opposed] == 70).any(axis=1)).all()
    assert opposed.sum() == ((faces.cells == 70).any(axis=1) & (faces.counts == 2)).sum() > 0


def test_boundary_of_a_block_in_tetrahedra_is_that_of_its_cubes_halved():
    points, cells = block(3)
    faces = face_table(cut_block(3).table)
    quads, _ = boundary_quads(cells)
    triangles = faces.quads[faces.counts == 1][:, :3]
    assert len(triangles) == 2 * len(quads)
    areas = (
        np.cross(points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]])
        / 2
    )
    middle = points[triangles].mean(axis=1) - 1.5
    np.testing.assert_allclose((areas * middle).sum() / 3, 27)


def test_quadrilaterals_that_meet_two_triangles_are_found():
    points, cells = block(2)
    left, right = cells[points[cells].mean(axis=1)[:, 0] < 1], cells[points[cells].mean(axis=1)[:, 0] > 1]
    tetrahedra = np.concatenate(
        [
            right[:, path]
            for path in ([0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6])
        ]
    )
    mesh = MixedMesh.of_types(points, {"hexahedron": left, "tetra": tetrahedra})
    faces = face_table(mesh.table)
    found = faces.quads[split_quads(faces)]
    assert len(found) == 4
    assert (points[found][:, :, 0] == 1).all()
    # With a hexahedron on the other side, too, it is no matter of the boundary.
    both = face_table(MixedMesh.of_types(points, {"hexahedron": cells, "tetra": tetrahedra}).table)
    assert not (points[both.quads[split_quads(both)]][:, :, 0] == 1).all(axis=1).any()


def test_a_face_of_three_cells_has_the_first_two():
    cells = [[0, 1, 2, 3], [0, 2, 1, 4], [0, 1, 2, 5]]
    faces = face_table(MixedMesh.of_types(np.zeros((6, 3)), {"tetra": cells}).table)
    crowded = faces.counts == 3
    assert faces.cells[crowded].tolist() == [[0, 1]]
    assert faces.orientation[crowded].tolist() == [1]


def test_pieces():
    mesh = four_types()
    points = np.concatenate([mesh.points, mesh.points + 10])
    cells = {one.cell_type.name: np.concatenate([one.cells, one.cells + len(mesh.points)]) for one in mesh.blocks}
    count, labels = components(MixedMesh.of_types(points, cells).table)
    assert count == 2
    sizes = [len(one.cells) for one in mesh.blocks]
    assert labels.tolist() == [piece for size in sizes for piece in [0] * size + [1] * size]
