"""Small hexahedral meshes, as points and cells, and what tests do to them."""

import numpy as np
from scipy.spatial.transform import Rotation

from hexconformal import HexMesh, generate
from hexconformal.elements import CORNERS
from hexconformal.mesh import boundary_quads, find_interfaces

# All corners, Gauss points and the 27 lattice points are positive, yet det J is negative inside.
INVALID_INSIDE = np.array(
    [
        [0.453, 0.234, -0.698],
        [1.711, 0.42, 0.308],
        [0.585, 1.63, 0.519],
        [-0.611, 1.154, 0.528],
        [-0.452, 0.014, 1.021],
        [0.565, 0.229, 1.464],
        [0.71, 1.419, 0.628],
        [0.459, 1.749, 1.71],
    ]
)


def block(k):
    """Points and cells of k^3 unit cubes."""
    i = np.arange((k + 1) ** 3).reshape(k + 1, k + 1, k + 1)
    corner = [i[x : x + k, y : y + k, z : z + k].ravel() for x, y, z in CORNERS]
    axes = np.meshgrid(*[np.arange(k + 1.0)] * 3, indexing="ij")
    return np.stack(axes, -1).reshape(-1, 3), np.stack(corner, axis=1)


def separate(x):
    """Points and cells of cells that share no node, from their corners (m, k, 3)."""
    return x.reshape(-1, 3), np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2])


def jittered_box(n=5, seed=0, amount=0.2):
    """The unit cube in n^3 cells, its inner nodes jittered."""
    return generate.jittered(*generate.box((n, n, n)), amount, seed=seed)


def jittered_ball(amount=0.3, **options):
    """A ball of jittered cells."""
    return generate.jittered(*generate.ball(4, 2), amount, seed=1, **options)


def with_rough_surface(mesh):
    """A mesh whose inner nodes are moved at random, and those of its curved boundary a little, too."""
    points, cells = generate.jittered(*mesh, 0.3, seed=1)
    surface = np.unique(boundary_quads(cells)[0])
    points[surface] += 0.01 * np.random.default_rng(2).normal(size=(len(surface), 3))
    return points, cells


def skin(mesh):
    """Points and boundary quadrilaterals of a mesh."""
    return mesh[0], boundary_quads(mesh[1])[0]


def off_boundary(points, cells):
    """True for the nodes that are not on the boundary."""
    inner = np.ones(len(points), dtype=bool)
    inner[boundary_quads(cells)[0]] = False
    return inner


def renumbered(mesh, rng):
    """The mesh with nodes and cells in random order, and the old ids of its nodes and of its cells."""
    points, cells = mesh
    nodes, order = rng.permutation(len(points)), rng.permutation(len(cells))
    return (points[nodes], np.argsort(nodes)[cells[order]]), nodes, order


def cube_in_cube(n=12):
    """A unit cube cut out of one of side 3, n cells along it: points, cells, inner and outer nodes."""
    points, cells = generate.box((n, n, n), (3.0, 3.0, 3.0), (-1.5, -1.5, -1.5))
    cells = cells[(np.abs(points[cells].mean(axis=1)) > 0.5).any(axis=1)]
    used, cells = np.unique(cells, return_inverse=True)
    points = points[used]
    size = np.abs(points).max(axis=1)
    return points, cells.reshape(-1, 8), np.flatnonzero(size < 0.5 + 1e-9), np.flatnonzero(size > 1.5 - 1e-9)


def turned(points, axis, degrees):
    """Displacement of a rotation about the origin."""
    axis = np.asarray(axis) / np.linalg.norm(axis)
    return Rotation.from_rotvec(axis * np.radians(degrees)).apply(points) - points


def parts(points, cells, regions, jitter=0.0, seed=1):
    """A mesh with an array "material", nodes neither on the skin nor between regions moved by shares of an edge."""
    inside = np.ones(len(points), dtype=bool)
    inside[boundary_quads(cells)[0]] = False
    inside[find_interfaces(cells, regions).quads] = False
    edge = np.linalg.norm(points[cells[:, 0]] - points[cells[:, 1]], axis=1).mean()
    shift = jitter * edge * np.random.default_rng(seed).uniform(-1, 1, points.shape)
    return HexMesh(points + shift * inside[:, None], cells, cell_data={"material": regions})


def wavy_layers(n=10, amplitude=0.12, jitter=0.3):
    """The unit cube in two layers with a wavy interface between them."""
    points, cells = generate.box((n, n, n))
    x, y, z = points.T
    height = 0.5 + amplitude * np.sin(2 * np.pi * x) * np.cos(2 * np.pi * y)
    layers = (z[cells].mean(axis=1) > 0.5).astype(np.int64)
    z = np.where(z <= 0.5, 2 * z * height, 1 - 2 * (1 - z) * (1 - height))
    return parts(np.stack([x, y, z], axis=1), cells, layers, jitter)


def grains(n=10, count=8, jitter=0.3):
    """The unit cube in voxels, each of the grain whose seed is closest."""
    points, cells = generate.box((n, n, n))
    seeds = np.random.default_rng(1).uniform(0, 1, (count, 3))
    apart = np.linalg.norm(points[cells].mean(axis=1)[:, None] - seeds, axis=2)
    return parts(points, cells, apart.argmin(axis=1), jitter)


def fibre(jitter=0.1):
    """A round fibre in a round matrix, and the mask of the nodes between them, all of one distance from the axis."""
    points, cells = generate.cylinder(4, 2, 4, radius=0.5)
    rim = np.flatnonzero(np.isclose(np.hypot(*points[:, :2].T), 0.5))
    around = boundary_quads(cells)[0]
    around = np.searchsorted(rim, around[np.isin(around, rim).all(axis=1)])
    rings = [rim, *(len(points) + k * len(rim) + np.arange(len(rim)) for k in range(3))]
    outside = [points[rim] * [2 * r, 2 * r, 1] for r in (0.65, 0.8, 1.0)]
    matrix = [np.hstack([rings[k][around], rings[k + 1][around]]) for k in range(3)]
    regions = np.repeat([0, 1], [len(cells), 3 * len(around)])
    points = np.concatenate([points, *outside])
    return parts(points, np.concatenate([cells, *matrix]), regions, jitter), np.isin(np.arange(len(points)), rim)
