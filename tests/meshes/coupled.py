"""Meshes with nodes that move together: periodic boxes, sectors of rings, parts that are not merged."""

import numpy as np

from hexconformal import generate

QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def periodic_box(shape=(5, 5, 5), amount=0.15, seed=0):
    """A box whose nodes, those of its skin too, are jittered alike in every period; pairs (k, 2) of facing nodes."""
    points, cells = generate.box(shape)
    index = grid_index(points, shape)
    shift = np.random.default_rng(seed).uniform(-1, 1, (*shape, 3)) * amount / np.array(shape)
    points = points + shift[tuple((index % shape).T)]
    pairs = [facing(index, axis, shape[axis], 0) for axis in range(3)]
    return points, cells, np.concatenate(pairs)


def sector(shape=(4, 6, 4), amount=0.25, seed=0, flat=False):
    """A quarter of a thick ring, jittered but for its flat ends and round walls; the pairs of its two cut faces."""
    points, cells = generate.box(shape)
    index = grid_index(points, shape)
    shift = np.random.default_rng(seed).uniform(-1, 1, points.shape) * amount / np.array(shape)
    pairs = facing(index, 1, shape[1], 0)
    shift[pairs[:, 1], 1] *= not flat
    shift[pairs[:, 0]] = shift[pairs[:, 1]]
    held = (index[:, [0, 2]] == 0) | (index[:, [0, 2]] == np.array(shape)[[0, 2]])
    shift[:, [0, 2]] *= ~held
    shift[held.any(axis=1), 1] = 0.0
    radius, angle, height = (points / points.max(axis=0) + shift).T
    radius, angle = 1.0 + radius, np.pi / 2 * angle
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    points[pairs[:, 0]] = points[pairs[:, 1]] @ QUARTER.T
    return points, cells, pairs


def unmerged(points, cells, second):
    """The mesh with a part (m,) of its cells that has its own copies of nodes; pairs of a copy and its original."""
    shared = np.intersect1d(cells[second], cells[~second])
    copies = np.arange(len(points))
    copies[shared] = len(points) + np.arange(len(shared))
    cells = np.where(second[:, None], copies[cells], cells)
    return np.concatenate([points, points[shared]]), cells, np.column_stack([copies[shared], shared])


def grid_index(points, shape):
    """(n, 3) place of each node of a regular box in its grid."""
    return np.rint(points / points.max(axis=0) * shape).astype(int)


def facing(index, axis, last, first):
    """(k, 2) nodes of the last and of the first layer of a grid along an axis."""
    others = [k for k in range(3) if k != axis]
    look = {tuple(index[k, others]): k for k in np.flatnonzero(index[:, axis] == first)}
    return np.array([(k, look[tuple(index[k, others])]) for k in np.flatnonzero(index[:, axis] == last)])


def gaps(points, pairs, turn=None):
    """(k,) distances of the first nodes of pairs from the second ones, these turned, up to one translation each."""
    return points[pairs[:, 0]] - points[pairs[:, 1]] @ (np.eye(3) if turn is None else turn).T
