"""Edges that follow others, against the minimum found by dense linear algebra."""

import numpy as np

from hexconformal.elements import BETWEEN, LATTICE
from hexconformal.generate import box
from hexconformal.mesh import middle_nodes, with_middles
from hexconformal.regularization.quadratic.following import followed


def stack(heights, amount=0.0):
    points, cells = box((2, 1, len(heights)))
    count = len(points)
    points = points.copy()
    points[:, 2] = np.concatenate([[0.0], np.cumsum(heights)])[np.rint(points[:, 2] * len(heights)).astype(int)]
    points += np.random.default_rng(0).uniform(-amount, amount, points.shape)
    cells, corners = middle_nodes(cells, count, 20)
    return with_middles(points, corners), cells


def opposite(cells):
    """Pairs of middles of edges that are on one face of a cell, and on none of its corners both."""
    places, pairs = LATTICE[8:20], set()
    for a in range(12):
        for b in range(a):
            along = (places[a] == 1) & (places[b] == 1)
            if along.any() and (places[a] != places[b]).sum() == 1:
                pairs |= {tuple(sorted(pair)) for pair in cells[:, [8 + a, 8 + b]].tolist()}
    return np.array(sorted(pairs))


def minimum(cells, points, ways, sides):
    """The ways by Lagrange multipliers."""
    size, links = 3 * len(points), opposite(cells)
    stiffness = 1e-14 * np.eye(size)
    for a, b in links:
        weight = 1.0 / ((points[a] - points[b]) ** 2).sum()
        for i in range(3):
            rows = [3 * a + i, 3 * b + i]
            stiffness[np.ix_(rows, rows)] += weight * np.array([[1, -1], [-1, 1]])
    fixed = []
    for cell in cells:
        for node, (a, b) in zip(cell[8:20], BETWEEN[:12], strict=True):
            fixed.append((node, points[cell[b]] - points[cell[a]]))
    fixed += [(node, normal) for nodes, normals in sides for node, normal in zip(nodes, normals, strict=True)]
    rows = np.zeros((len(fixed), size))
    for row, (node, way) in zip(rows, fixed, strict=True):
        row[3 * node : 3 * node + 3] = way
    matrix = np.block([[stiffness, rows.T], [rows, np.zeros((len(rows), len(rows)))]])
    right = np.concatenate([np.zeros(size), rows @ ways.ravel()])
    return np.linalg.lstsq(matrix, right, rcond=1e-13)[0][:size].reshape(-1, 3)


def test_ways_are_the_minimum():
    points, cells = stack([0.1, 0.3, 0.5], amount=0.03)
    middles = np.unique(cells[:, 8:20])
    order = np.argsort(points[middles, 2])
    bottom, top = middles[order[:7]], middles[order[-7:]]
    rng = np.random.default_rng(1)
    ways = np.zeros_like(points)
    ways[bottom] = rng.uniform(-0.1, 0.1, (7, 3))
    normals = rng.normal(size=(14, 3))
    normals[:, 2] += 4.0
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    sides = [(np.concatenate([bottom, top]), normals)]
    found = followed(cells, points, ways, sides)
    np.testing.assert_allclose(found[middles], minimum(cells, points, ways, sides)[middles], atol=1e-6)
    assert np.linalg.norm(found[middles], axis=1).max() > 0.03
    np.testing.assert_array_equal(np.delete(found, middles, axis=0), 0.0)


def test_layers_follow_by_the_squares_of_their_thickness():
    heights = np.array([0.05, 0.1, 0.2, 1.0])
    points, cells = stack(heights)
    floor, roof = (np.unique(cells[:, 8:16][points[cells[:, 8:16], 2] == z]) for z in (0.0, heights.sum()))
    up = np.array([[0.0, 0.0, 1.0]])
    ways = np.zeros_like(points)
    ways[floor] = up
    ends = np.concatenate([floor, roof])
    found = followed(cells, points, ways, [(ends, np.repeat(up, len(ends), axis=0))])
    levels = np.concatenate([[0.0], np.cumsum(heights)])
    shares = 1.0 - np.concatenate([[0.0], np.cumsum(heights**2)]) / (heights**2).sum()
    level = np.unique(cells[:, 8:16])
    np.testing.assert_allclose(found[level, 2], np.interp(points[level, 2], levels, shares), atol=1e-7)
    # Edges between layers are held along themselves.
    np.testing.assert_array_equal(found[np.unique(cells[:, 16:20]), 2], 0.0)


def test_an_edge_with_two_planes_stays_on_their_line():
    points, cells = stack([1.0])
    node = cells[0, 8]  # along x
    ways = np.zeros_like(points)
    ways[node] = [0.0, 0.0, 0.1]
    slanted = np.array([[0.0, np.sin(0.3), np.cos(0.3)]])
    found = followed(
        cells, points, ways, [(np.array([node]), np.array([[0.0, 0.0, 1.0]])), (np.array([node]), slanted)]
    )
    np.testing.assert_allclose(found[node], [0.0, 0.0, 0.1], atol=1e-12)
