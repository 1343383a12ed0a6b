"""Meshes with cells that have next to no volume."""

import numpy as np

from hexconformal.elements import CORNER_NEIGHBOURS
from hexconformal.geometry import nodal_area_vectors
from hexconformal.mesh import boundary_quads


def flattened(points, cells, flatness, count=1, seed=0):
    """A mesh with some inner nodes put so that a corner there has a scaled Jacobian of that; apart from each other."""
    points, inner = points.copy(), np.ones(len(points), dtype=bool)
    inner[boundary_quads(cells)[0]] = False
    around = np.zeros(len(points), dtype=bool)
    for cell in np.random.default_rng(seed).permutation(len(cells)):
        corners = np.flatnonzero(inner[cells[cell]])
        if around[cells[cell]].any() or len(corners) == 0:
            continue
        node = cells[cell, corners[0]]
        a, b, c = points[cells[cell][CORNER_NEIGHBOURS[corners[0]]]]
        normal, middle = np.cross(b - a, c - a), (a + b + c) / 3.0
        lengths = np.prod(np.linalg.norm([a - middle, b - middle, c - middle], axis=1))
        # At height h above the triangle det = -h |normal|, whatever the place.
        points[node] = middle - flatness * lengths / (normal @ normal) * normal
        if np.linalg.det(np.array([a, b, c]) - points[node]) * flatness < 0.0:
            points[node] = 2.0 * middle - points[node]
        around[cells[(cells == node).any(axis=1)]] = True
        count -= 1
        if count == 0:
            return points, cells
    raise ValueError("there are not so many inner nodes apart from each other")


def padded(points, cells, thickness):
    """A mesh with a layer of cells around it, of some thickness, inside its surface."""
    quads = boundary_quads(cells)[0]
    nodes = np.unique(quads)
    normals = nodal_area_vectors(points, quads)[nodes]
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    outer = np.full(len(points), -1)
    outer[nodes] = len(points) + np.arange(len(nodes))
    inside = points.copy()
    inside[nodes] -= thickness * normals
    return np.vstack([inside, points[nodes]]), np.vstack([cells, np.hstack([quads, outer[quads]])])
