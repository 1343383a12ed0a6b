"""Edges of a quadrilateral surface, the angle across each, and chains of them: what feature curves are found from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mesh import connected_components, face_edges, unique_edges

__all__ = ["SurfaceEdges", "chains", "dihedral_angles", "steady_normals", "step_quads", "surface_edges"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

# How often normals are averaged; neighbours have a say up to this multiple of the noise, at most so many degrees.
_ROUNDS = 3
_SPREAD = 4.0
_WIDEST = 60.0
# Degrees from which on an edge is a crease whatever is beside it, and else how much sharper it must be.
_ROUND = 55.0
_CONTRAST = 1.5
_TURN = 50.0  # degrees that a curve turns at a corner


@dataclass(frozen=True)
class SurfaceEdges:
    """Every edge of a quadrilateral surface once.

    Attributes
    ----------
    nodes
        (e, 2) its nodes, ascending.
    of_quads
        (k, 4) the edge from node i to node i + 1 of each quad.
    smooth
        (s,) the edges with exactly two quads.
    quads
        (s, 2) those two quads.
    odd
        The other edges: borders, and edges where more than two quads meet.
    """

    nodes: Ints
    of_quads: Ints
    smooth: Ints
    quads: Ints
    odd: Ints


def surface_edges(quads: Ints) -> SurfaceEdges:
    """Find the edges of a quadrilateral surface and the quads on both sides.

    Parameters
    ----------
    quads
        (k, 4) nodes in cyclic order.

    Examples
    --------
    >>> edges = surface_edges(np.array([[0, 1, 2, 3], [1, 4, 5, 2]]))
    >>> edges.nodes[edges.smooth].tolist(), edges.quads.tolist(), len(edges.odd)
    ([[1, 2]], [[0, 1]], 6)
    """
    edges = unique_edges(face_edges(quads))
    order = np.argsort(edges.of_pairs, kind="stable")
    first = np.cumsum(edges.uses) - edges.uses
    smooth = np.flatnonzero(edges.uses == 2)
    sides = np.stack([order[first[smooth]], order[first[smooth] + 1]], axis=1) // 4
    return SurfaceEdges(edges.nodes, edges.of_pairs.reshape(-1, 4), smooth, sides, np.flatnonzero(edges.uses != 2))


def area_vectors(points: Floats, quads: Ints) -> Floats:
    """(k, 3) normals of quads, as long as their area."""
    x = points[quads]
    return np.asarray(0.5 * np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]))


def steady_normals(points: Floats, quads: Ints, edges: SurfaceEdges) -> Floats:
    """Unit normals of quads, averaged with neighbours that agree but for noise: noise goes, creases stay.

    A quad that is folded, or has no area, has no say: it gets the normal of its neighbours.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    quads
        (k, 4) nodes, counter-clockwise seen from outside.
    edges
        Of the same quads.

    Returns
    -------
    (k, 3) unit normals.
    """
    x = points[quads]
    after, before = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    at_corners = np.cross(after, before)
    area = area_vectors(points, quads)
    size = np.linalg.norm(area, axis=1)
    lengths = (after**2).sum(axis=2).max(axis=1)
    sound = (np.einsum("kci,ki->kc", at_corners, area) > 0).all(axis=1) & (size > 1e-3 * lengths)
    left, right = edges.quads.T
    count = len(quads)
    # Where two quads lie on each other, the smaller one is taken for folded; if the surface does turn there, its
    # other neighbours put that right.
    around = np.einsum("ei,ei->e", area[left], area[right]) < -0.5 * size[left] * size[right]
    folded = np.zeros(len(quads), dtype=bool)
    folded[np.where(size[left] < size[right], left, right)[around]] = True
    weight = np.where(sound & ~folded, size, 0.0)
    normals = area / np.where(size > 0, size, 1.0)[:, None]
    least = np.cos(np.radians(np.minimum(_SPREAD * _noise(dihedral_angles(normals, edges), edges, count), _WIDEST)))
    normals[weight == 0] = 0.0
    for turn in range(_ROUNDS):
        agree = np.einsum("ei,ei->e", normals[left], normals[right]) - least
        untold = (weight[left] == 0) | (weight[right] == 0)
        agree = np.where(untold, 1.0, np.maximum(agree, 0.0))
        sums = normals * np.maximum(weight, 1e-300)[:, None]
        for to, of in ((left, right), (right, left)):
            share = (agree * weight[of])[:, None] * normals[of]
            for axis in range(3):
                sums[:, axis] += np.bincount(to, share[:, axis], minlength=count)
        length = np.linalg.norm(sums, axis=1)
        normals = sums / np.where(length > 0, length, 1.0)[:, None]
        # What had no say of its own now passes on what it was told.
        if turn < _ROUNDS - 1:
            weight = np.where((weight == 0) & (length > 0), size, weight)
    return normals


def _noise(angles: Floats, edges: SurfaceEdges, count: int) -> Floats:
    """(s,) degrees by which normals vary for no reason, around each edge with two quads."""
    every = np.zeros(len(edges.nodes))
    every[edges.smooth] = angles
    # Along creases and around cylinders two edges of a quad are flat; only where it is rough are there three bends.
    rough = np.sort(every[edges.of_quads], axis=1)[:, 1]
    left, right = edges.quads.T
    total, number = rough.copy(), np.ones(count)
    for to, of in ((left, right), (right, left)):
        total += np.bincount(to, rough[of], minlength=count)
        number += np.bincount(to, minlength=count)
    mean = total / number
    return np.asarray(np.maximum(mean[left], mean[right]))


def dihedral_angles(normals: Floats, edges: SurfaceEdges) -> Floats:
    """(s,) angles in degrees between the normals on both sides of the edges with two quads, 0 where it is flat."""
    a, b = normals[edges.quads[:, 0]], normals[edges.quads[:, 1]]
    return np.asarray(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ei,ei->e", a, b))))


def round_edges(angles: Floats, edges: SurfaceEdges) -> Mask:
    """(s,) edges hardly sharper than the next ones on both sides: those of a coarse cylinder, not of a crease.

    Parameters
    ----------
    angles
        (s,) degrees at the edges with two quads.
    edges
        Of the same surface.
    """
    every = np.zeros(len(edges.nodes))
    every[edges.smooth] = angles
    # The angle at the edge opposite to each edge of each quad, then the smaller one of both quads.
    opposite = every[np.roll(edges.of_quads, 2, axis=1)]
    least = np.full(len(edges.nodes), np.inf)
    np.minimum.at(least, edges.of_quads.ravel(), opposite.ravel())
    return np.asarray((angles < _ROUND) & (angles < _CONTRAST * least[edges.smooth]))


def step_quads(points: Floats, quads: Ints, edges: SurfaceEdges, angle: float) -> tuple[Mask, Mask]:
    """Treads and risers of stair steps: quads between a sharp convex and a sharp concave edge.

    Returns
    -------
    (k,) the quads that are steps;
    (s,) edges with two quads that are sharper than `angle` degrees.
    """
    area = area_vectors(points, quads)
    size = np.linalg.norm(area, axis=1)
    normals = area / np.where(size > 0, size, 1.0)[:, None]
    sharp = dihedral_angles(normals, edges) > angle
    centers = points[quads].mean(axis=1)
    left, right = edges.quads.T
    rises = np.einsum("ei,ei->e", centers[right] - centers[left], normals[left] - normals[right])
    sign = np.zeros(len(edges.nodes))
    sign[edges.smooth] = np.where(sharp, np.sign(rises), 0.0)
    around = sign[edges.of_quads]
    return np.asarray((around * np.roll(around, 2, axis=1) < 0).any(axis=1)), sharp


@dataclass(frozen=True)
class Chains:
    """Edges strung together.

    Attributes
    ----------
    labels
        (k,) chain of each edge.
    corners
        (n,) nodes where chains end: not two edges meet, or a sharp turn.
    degree
        (n,) edges at each node.
    zigzag
        (c,) per chain how much it changes its sense of turning from node to node: 0 for a straight line or a
        circle, towards 1 for a saw.
    """

    labels: Ints
    corners: Mask
    degree: Ints
    zigzag: Floats


def chains(points: Floats, edges: Ints, stops: Mask) -> Chains:
    """String edges together, up to where several meet or the curve turns sharply.

    A turn counts as sharp if it is more than 50 degrees over one edge and over two edges on each side, and
    clearly more than the turns next to it, so that neither a saw nor a coarse circle is full of corners.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    edges
        (k, 2) nodes.
    stops
        (n,) nodes where every chain ends.
    """
    count = len(points)
    ends = edges.ravel()
    degree = np.bincount(ends, minlength=count)
    order = np.argsort(ends, kind="stable")
    first = np.cumsum(degree) - degree
    inner = np.flatnonzero((degree == 2) & ~stops)
    halves = order[first[inner][:, None] + np.arange(2)].reshape(-1, 2)
    near = np.full((count, 2), -1)
    near[inner] = ends[halves ^ 1]

    def beyond(place: Ints, past: Ints) -> Ints:
        # The next node along the curve, or the same one where the curve ends.
        following = np.where(near[place, 0] == past, near[place, 1], near[place, 0])
        return np.where(following >= 0, following, place)

    a, b = near[inner].T
    bend = np.zeros((count, 3))
    bend[inner] = _bend(points[a], points[inner], points[b])
    one = np.linalg.norm(bend, axis=1)
    two = np.zeros(count)
    two[inner] = np.linalg.norm(_bend(points[beyond(a, inner)], points[inner], points[beyond(b, inner)]), axis=1)
    excess = np.zeros(count)
    excess[inner] = one[inner] - 0.5 * (one[a] + one[b])
    sharp = (one > _TURN) & (two > _TURN) & ((one > 1.5 * _TURN) | (excess > 0.5 * _TURN))
    corners = ((degree > 0) & (degree != 2)) | (stops & (degree > 0)) | sharp
    links = halves[~sharp[inner]] // 2
    labels = connected_components(links, len(edges))

    # Two bends in a row along an edge, brought to the same direction of travel.
    u, v = edges.T
    ahead = near[u, 0] == v
    way_u, way_v = np.where(ahead, -1.0, 1.0), np.where(near[v, 0] == u, 1.0, -1.0)
    both = (near[u, 0] >= 0) & (near[v, 0] >= 0) & ~sharp[u] & ~sharp[v]
    change = np.linalg.norm(way_u[:, None] * bend[u] - way_v[:, None] * bend[v], axis=1) / 180.0
    number = int(labels.max(initial=-1)) + 1
    total = np.bincount(labels[both], change[both], minlength=number)
    return Chains(labels, corners, degree, total / np.maximum(np.bincount(labels[both], minlength=number), 1))


def _bend(a: Floats, b: Floats, c: Floats) -> Floats:
    """Turn from a - b to b - c: its axis, as long as its angle in degrees."""
    one, two = b - a, c - b
    axis = np.cross(one, two)
    length = np.linalg.norm(axis, axis=1)
    angle = np.degrees(np.arctan2(length, np.einsum("ni,ni->n", one, two)))
    # A curve that turns straight back has no axis; any will do.
    back = (length == 0) & (angle > 90)
    axis[back], length[back] = [1.0, 0.0, 0.0], 1.0
    return np.asarray(axis * (angle / np.where(length > 0, length, 1.0))[:, None])
