"""Tetrahedra, wedges and pyramids for tests: random ones, and det J by shape functions that are written out here."""

import itertools

import numpy as np

from hexconformal.elements import CELL_TYPES

TYPES = list(CELL_TYPES.values())
OTHERS = [one for one in TYPES if one.name != "hexahedron"]


def random_cells(cell_type, count, amount, seed=0):
    """(count, k, 3) ideal cells whose nodes are moved by up to `amount` along each axis."""
    moves = np.random.default_rng(seed).uniform(-amount, amount, (count, len(cell_type.nodes), 3))
    return cell_type.ideal + moves


def shape_gradients(cell_type, xi):
    """(q, k, 3) derivatives of the shape functions at places (q, 3), along the base of a pyramid over 1 - t."""
    r, s, t = xi.T
    one, zero = np.ones_like(r), np.zeros_like(r)
    if cell_type.name == "tetra":
        rows = [(-one, -one, -one), (one, zero, zero), (zero, one, zero), (zero, zero, one)]
    elif cell_type.name == "wedge":
        flat = [(1 - r - s, -one, -one), (r, one, zero), (s, zero, one)]
        rows = [(dr * (1 - t), ds * (1 - t), -n) for n, dr, ds in flat] + [(dr * t, ds * t, n) for n, dr, ds in flat]
    else:
        # A hexahedron whose upper four nodes are one.
        corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
        rows = [
            (
                (2 * i - 1) * (s if j else 1 - s),
                (r if i else 1 - r) * (2 * j - 1),
                -(r if i else 1 - r) * (s if j else 1 - s),
            )
            for i, j in corners
        ]
        rows.append((zero, zero, one))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=1)


def determinants(cell_type, x, xi):
    """(m, q) det J of cells (m, k, 3) at points of the reference cell, of pyramids over (1 - t)^2."""
    return np.linalg.det(np.einsum("cai,qaj->cqij", x, shape_gradients(cell_type, xi)))


def sample_points(cell_type, steps):
    """Points of the reference cell: corners, and a lattice."""
    line = np.linspace(0, 1, steps)
    plane = [(a, b) for a, b in itertools.product((0.0, 0.25, 0.5, 1.0), repeat=2)]
    if cell_type.name != "pyramid":
        plane = [(a, b) for a, b in plane if a + b <= 1]
    return np.array([(a, b, t) for a, b in plane for t in line])


def renumberings(cell_type, sign=1):
    """All orders of the nodes that a rotation of the ideal brings about, or (sign -1) a reflection."""
    x = cell_type.ideal - cell_type.ideal.mean(axis=0)
    distances = np.linalg.norm(x[:, None] - x[None], axis=2)
    found = []

    def extend(order):
        if len(order) == len(x):
            rotation, *_ = np.linalg.lstsq(x, x[order], rcond=None)
            if sign * np.linalg.det(rotation) > 0:
                found.append(order)
            return
        for node in set(range(len(x))) - set(order):
            if np.allclose(distances[node, order], distances[len(order), : len(order)]):
                extend([*order, node])

    extend([])
    return found
