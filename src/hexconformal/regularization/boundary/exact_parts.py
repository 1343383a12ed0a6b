"""What is kept exactly: planes of flat patches, straight curves, their ends; as sums of n n^T at every node."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...geometry import Features, edge_table
from ...solver import count_free_directions, line_normal_sums, planar_normal_sums

__all__ = ["flat_normals", "normals_inside", "normals_of_curves", "on_bent", "wire_normals"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_AXIS = 1e-9  # components of a unit normal below this are rounding


def on_bent(features: Features, sums: Field) -> Mask:
    """(n,) nodes of feature edges at an end of which more than one direction is free."""
    on = np.zeros(len(sums), dtype=bool)
    on[features.edges[count_free_directions(sums)[features.edges].max(axis=1) > 1]] = True
    return on


def normals_inside(points: Field, quads: Ints, kinds: Ints, skin: Ints) -> Field:
    """Sums (n, 3, 3) of n n^T for faces inside (k, 4) of some kinds (k,).

    Nodes slide where all faces lie in one plane, or along where two planes meet; on rims, and between kinds, along
    these, unless they are on the skin (q, 4), which has its own.
    """
    if len(quads) == 0:
        return np.zeros((len(points), 3, 3))
    # A quad with an edge of no length, in a tangled mesh, is no obstacle: the others around its nodes have planes.
    x = points[quads]
    edges = np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2)
    some = (edges > 0.0) | (quads == np.roll(quads, 1, axis=1))  # triangles have a node twice
    sums = planar_normal_sums(points, quads[some.all(axis=1)])
    table = edge_table(quads)
    different = kinds[table.sides[:, 0]] != kinds[table.sides[:, 1]]
    rims = table.nodes[np.union1d(table.nonmanifold, table.manifold[different])]
    width = [len(points), 1]
    return sums + line_normal_sums(points, rims[~np.isin(rims @ width, edge_table(skin).nodes @ width)])


def flat_normals(points: Field, quads: Ints, patches: Ints, tolerance: float) -> tuple[Field, Mask]:
    """Find the flat patches of a boundary, and the normals of their planes.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    quads
        (k, 4) boundary quads.
    patches
        (k,) patch of each.
    tolerance
        Distance from its plane up to which a patch is flat.

    Returns
    -------
    (n, 3, 3) sums of n n^T over the planes of the flat patches around every node;
    (n,) the nodes around which all patches are flat.
    """
    sums, flat = np.zeros((len(points), 3, 3)), np.ones(len(points), dtype=bool)
    order = np.argsort(patches, kind="stable")
    for part in np.split(order, np.flatnonzero(np.diff(patches[order])) + 1):
        nodes = np.unique(quads[part])
        x = points[nodes] - points[nodes].mean(axis=0)
        normal = np.linalg.eigh(x.T @ x)[1][:, 0]
        if np.abs(x @ normal).max() <= tolerance:
            # Exact zeros and ones on the axes: a cube's faces stay flat to the last bit.
            normal[np.abs(normal) < _AXIS] = 0.0
            sums[nodes] += np.outer(normal, normal) / (normal @ normal)
        else:
            flat[nodes] = False
    return sums, flat


def normals_of_curves(points: Field, features: Features, sums: Field, flat: Mask) -> Field:
    """(n, 3, 3) normals that the sums lack to keep straight curves that lie in planes, and their ends: fronts, tags."""
    lines, free = line_normal_sums(points, features.edges), count_free_directions(sums)
    ends = np.zeros(len(points), dtype=bool)
    ends[features.corners] = True
    straight = (free == 2) & (count_free_directions(lines) == 1)
    lines[~flat | ~(straight | ends)] = 0.0
    return lines


def wire_normals(points: Field, wires: Features, bent_slide: bool) -> Field:
    """(n, 3, 3) normals that keep straight curves, their ends and corners; where they bend nodes slide, or stay."""
    lines = line_normal_sums(points, wires.edges)
    if bent_slide:
        lines[count_free_directions(lines) == 0] = 0.0
    lines[wires.corners] = np.eye(3)
    return lines
