"""Surfaces made from formulas."""

import numpy as np
from scipy.spatial import ConvexHull

from hexconformal.geometry import Faces


def no_cells(width):
    """The array of no triangles or quadrilaterals."""
    return np.empty((0, width), dtype=np.int64)


def icosphere(level):
    """The unit sphere in 20 x 4^level triangles."""
    g = (1 + 5**0.5) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    points += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)]
    faces += [(10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5)]
    faces += [(2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    points, faces = np.array(points, float), np.array(faces)
    for _ in range(level):
        sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        edges, place = np.unique(sides, axis=0, return_inverse=True)
        middle = len(points) + place.reshape(-1, 3)
        points = np.concatenate([points, points[edges].mean(axis=1)])
        a, b, c = faces.T
        ab, bc, ca = middle.T
        corners = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = np.concatenate([np.stack(corner, axis=1) for corner in corners])
    return points / np.linalg.norm(points, axis=1, keepdims=True), Faces(faces, no_cells(4))


def quad_cube(n):
    """Surface of the cube [-1, 1]^3 in n x n squares per face."""
    axis = np.linspace(-1, 1, n + 1)
    u, v = np.meshgrid(axis, axis, indexing="ij")
    one = np.ones_like(u)
    i = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    table = np.stack([i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]], axis=2).reshape(-1, 4)
    points, quads = [], []
    for k in range(3):
        for sign in (1, -1):
            face = np.empty((n + 1, n + 1, 3))
            face[..., k], face[..., (k + 1) % 3], face[..., (k + 2) % 3] = sign * one, u, v
            quads.append(len(points) * (n + 1) ** 2 + (table if sign > 0 else table[:, ::-1]))
            points.append(face.reshape(-1, 3))
    points = np.concatenate(points)
    _, first, inverse = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
    return points[first], Faces(no_cells(3), inverse.ravel()[np.concatenate(quads)])


def quad_sphere(n):
    """The unit sphere in 6 n^2 quadrilaterals."""
    points, cells = quad_cube(n)
    return points / np.linalg.norm(points, axis=1, keepdims=True), cells


def mixed_sphere(n):
    """The unit sphere in quadrilaterals, half of them split into triangles."""
    points, cells = quad_sphere(n)
    split, kept = cells.quads[::2], cells.quads[1::2]
    return points, Faces(np.concatenate([split[:, [0, 1, 2]], split[:, [0, 2, 3]]]), kept)


def scattered_sphere(n, seed=1):
    """Points at random on a sphere: every valence from 3 to 11."""
    points = np.random.default_rng(seed).standard_normal((n, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    triangles = ConvexHull(points).simplices
    x = points[triangles]
    inward = (np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) * x[:, 0]).sum(axis=1) < 0
    return points, np.where(inward[:, None], triangles[:, ::-1], triangles)


def grid(n, jitter=0.0, seed=0):
    """Unit square of 2 n^2 triangles, inner nodes jittered."""
    axis = np.linspace(0, 1, n + 1)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    i = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (part.ravel() for part in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]))
    inner = (points[:, :2] > 0).all(axis=1) & (points[:, :2] < 1).all(axis=1)
    points[inner, :2] += jitter / n * np.random.default_rng(seed).uniform(-1, 1, (inner.sum(), 2))
    return points, Faces(np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]), no_cells(4)), inner


def shaken(surface, size, seed=0):
    """Nodes of a surface on the unit sphere, moved on it at random."""
    points, cells = surface
    moved = points + size * np.random.default_rng(seed).normal(size=points.shape)
    return moved / np.linalg.norm(moved, axis=1, keepdims=True), cells


SHAKEN_SPHERES = {
    "triangles": lambda: shaken(icosphere(2), 0.03),
    "quads": lambda: shaken(quad_sphere(3), 0.03),
    "both": lambda: shaken(mixed_sphere(3), 0.03),
}


def as_arrays(surface):
    """Points, triangles and quadrilaterals."""
    points, cells = surface[:2]
    return points, cells.triangles, cells.quads


def quad_torus(major, minor, n, m):
    """A torus of n x m quadrilaterals."""
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    r = major + minor * np.cos(v)
    points = np.stack([r * np.cos(u), r * np.sin(u), minor * np.sin(v)], axis=2).reshape(-1, 3)
    i = np.arange(n * m).reshape(n, m)
    a, b = i, np.roll(i, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    return points, Faces(no_cells(3), np.stack([a, b, c, d], axis=2).reshape(-1, 4))


def sheared_torus(n, m, seed=0):
    """Points and 2 n m triangles of a torus, sheared, every node off its place by up to a quarter of an edge."""
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    v = v + 0.5 * np.sin(u) + 0.5 * np.pi / m * rng.uniform(-1, 1, v.shape)
    u = u + 0.5 * np.pi / n * rng.uniform(-1, 1, u.shape)
    points = np.stack([(2 + np.cos(v)) * np.cos(u), (2 + np.cos(v)) * np.sin(u), np.sin(v)], axis=2).reshape(-1, 3)
    i = np.arange(n * m).reshape(n, m)
    j, k, r = np.roll(i, -1, 0), np.roll(i, (-1, -1), (0, 1)), np.roll(i, -1, 1)
    return points, np.concatenate([np.stack(t, axis=2).reshape(-1, 3) for t in ((i, j, k), (i, k, r))])
