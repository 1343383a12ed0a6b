"""The order of nodes and cells: the same mesh in any numbering comes in the same order, coincident nodes too."""

import numpy as np
import pytest
from meshes.hexahedra import separate

from hexconformal import generate, regularize
from hexconformal.mesh.spatial_order import spatial_order

BOX = generate.box((3, 3, 3))


def copies(mesh, count):
    """The mesh so many times at the same place."""
    points, cells = mesh
    return np.tile(points, (count, 1)), np.concatenate([cells + k * len(points) for k in range(count)])


def collapsed(mesh):
    """Half of the nodes at one point."""
    points, cells = mesh
    points = points.copy()
    points[np.random.default_rng(0).random(len(points)) < 0.5] = points[5]
    return points, cells


def glued(mesh):
    """Two copies that share one node."""
    points, cells = copies(mesh, 2)
    half = len(cells) // 2
    return points, np.where(cells == cells[half, 0], cells[0, 0], cells)


def with_loose_points(mesh):
    """Points of no cell where nodes are."""
    points, cells = mesh
    return np.concatenate([points, points[[3, 3, 7, 7]]]), cells


MESHES = {
    "apart": separate(BOX[0][BOX[1]]),
    "collapsed": collapsed(BOX),
    "at a point": (np.zeros_like(BOX[0]), BOX[1]),
    "copies": copies(BOX, 2),
    "many copies of a cell": copies(generate.box((1, 1, 1)), 50),
    "glued": glued(BOX),
    "loose points": with_loose_points(BOX),
}


@pytest.mark.parametrize("name", MESHES)
def test_any_numbering_comes_in_one_order(name):
    points, cells = MESHES[name]
    nodes, order = spatial_order(points, cells)
    there = points[nodes], np.argsort(nodes)[cells[order]]
    rng = np.random.default_rng(1)
    for _ in range(3):
        numbers, places = rng.permutation(len(points)), rng.permutation(len(cells))
        again, renumbered = points[numbers], np.argsort(numbers)[cells[places]]
        nodes, order = spatial_order(again, renumbered)
        assert np.array_equal(again[nodes], there[0])
        assert np.array_equal(np.argsort(nodes)[renumbered[order]], there[1])


def test_points_as_high_as_each_other_are_told_apart_by_their_coordinates():
    # Closer than the curve and the height can tell.
    points, cells = BOX
    points = points.copy()
    points[[20, 21, 22]] = [[0.5, 0.0, 0.0], [0.5, 1e-18, 0.0], [0.5, -1e-18, 0.0]]
    nodes, _ = spatial_order(points, cells)
    rng = np.random.default_rng(2)
    for _ in range(3):
        numbers = rng.permutation(len(points))
        again, _ = spatial_order(points[numbers], np.argsort(numbers)[cells])
        assert np.array_equal(points[numbers][again], points[nodes])


def test_coincident_nodes_in_any_order_give_the_same_bits():
    points, cells = generate.jittered(*generate.box((3, 3, 2)), 0.3, seed=4)
    points = points.copy()
    for seed in range(4):
        one, other = cells[np.random.default_rng(seed).integers(len(cells)), [0, 1]]
        points[one] = points[other]
    plain = regularize((points, cells)).points
    rng = np.random.default_rng(5)
    for _ in range(2):
        numbers, places = rng.permutation(len(points)), rng.permutation(len(cells))
        again = regularize((points[numbers], np.argsort(numbers)[cells[places]])).points
        assert np.array_equal(again, plain[numbers])


def test_points_of_no_cell_come_last_and_change_nothing():
    points, cells = generate.jittered(*generate.ball(3, 2), 0.2)
    far = np.random.default_rng(0).normal(size=(20, 3)) * 10.0
    nodes, order = spatial_order(points, cells)
    with_far, same = spatial_order(np.vstack([far, points]), cells + 20)
    np.testing.assert_array_equal(with_far[: len(points)], nodes + 20)
    np.testing.assert_array_equal(same, order)
