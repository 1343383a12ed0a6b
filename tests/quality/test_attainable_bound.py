"""What corners that are held allow: nodes at which some cell stays invalid, by a linear program and by trying."""

import numpy as np
import pytest

import hexconformal as hc
from hexconformal.elements import HEXAHEDRON, HEXAHEDRON20, PYRAMID, TETRAHEDRON, WEDGE
from hexconformal.generate import box
from hexconformal.quality import nodes_without_room
from hexconformal.quality.attainable_bound import _have_room


def bottom_of_four(place):
    """Four cells on the floor, which is held, with the node in its middle somewhere else, and where it was there."""
    points, cells = box((2, 2, 1))
    points[4, :2] = place
    return points, cells


@pytest.mark.parametrize(
    ("place", "room"),
    [
        ((0.5, 0.5), True),
        ((0.9, 0.1), False),
        ((0.7, 0.25), True),
        ((0.98, 0.5), True),
        ((1.02, 0.5), False),
        ((0.5, -0.3), False),
    ],
)
@pytest.mark.parametrize("nodes", [8, 20, 27])
def test_a_node_on_a_plane_has_room_within_those_around(place, room, nodes):
    mesh = hc.HexMesh(*bottom_of_four(place))
    block = ((HEXAHEDRON, mesh.cells),)
    if nodes > 8:
        mesh = hc.elevated(mesh, nodes)
        block = ((mesh.blocks[0].cell_type, mesh.blocks[0].cells),)
    found = nodes_without_room(mesh.points, block, mesh.points[:, 2] == 0)
    assert (4 in found) == (not room)
    if room:
        assert len(found) == 0
    assert len(nodes_without_room(mesh.points, block, np.zeros(len(mesh.points), dtype=bool))) == 0
    # Nothing is known where the node itself may go.
    held = (mesh.points[:, 2] == 0) & (np.arange(len(mesh.points)) != 4)
    assert 4 not in nodes_without_room(mesh.points, block, held)


def test_directions_that_are_tried_have_room_where_the_program_says_so():
    rng = np.random.default_rng(0)
    ways = rng.normal(size=(20_000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    seen = []
    for _ in range(300):
        normals = rng.normal(size=(rng.integers(3, 9), 3)) + [0.0, 0.0, 0.5]
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        best = (ways @ normals.T).min(axis=1).max()
        if abs(best) > 0.02:
            seen.append(best > 0.0)
            assert _have_room(normals) == seen[-1]
    assert 50 < sum(seen) < len(seen) - 50


def test_the_derivative_at_a_corner_counts_not_the_chord():
    mesh = hc.elevated(box((2, 2, 1)), 20)
    cells, points = mesh.blocks[0].cells, mesh.points.copy()
    # Middle of an edge of the floor, from the middle outwards: beyond a quarter of it the curve begins the other way.
    middle = np.flatnonzero(np.abs(points - [0.75, 0.5, 0.0]).max(axis=1) < 1e-9)[0]
    for x, room in ((0.63, True), (0.62, False)):
        points[middle, 0] = x
        found = nodes_without_room(points, [(HEXAHEDRON20, cells)], points[:, 2] == 0)
        assert (4 in found) == (not room)


@pytest.mark.parametrize("cell_type", [TETRAHEDRON, WEDGE, PYRAMID])
def test_cells_of_other_types_that_are_held_alone(cell_type):
    cells = np.array([cell_type.nodes])
    held = np.ones(len(cell_type.nodes), dtype=bool)
    assert len(nodes_without_room(cell_type.ideal, [(cell_type, cells)], held)) == 0
    turned = cell_type.ideal * [1, 1, -1]
    found = nodes_without_room(turned, [(cell_type, cells)], held)
    np.testing.assert_array_equal(found, np.arange(len(cell_type.neighbours)))


def test_two_types_at_a_node():
    points, cells = bottom_of_four((0.98, 0.5))
    half = points[cells].mean(axis=1)[:, 0] > 0.5
    wedges = np.concatenate([cells[half][:, [0, 1, 2, 4, 5, 6]], cells[half][:, [0, 2, 3, 4, 6, 7]]])
    for x, room in ((0.98, True), (1.02, False)):
        points[4, 0] = x
        blocks = [(HEXAHEDRON, cells[~half]), (WEDGE, wedges)]
        assert (4 in nodes_without_room(points, blocks, points[:, 2] == 0)) == (not room)
