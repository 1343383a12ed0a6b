"""Chains of edges: the curves along which a surface has creases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...mesh import connected_components
from .schedules import FeatureSchedule

__all__ = ["Chains", "chains"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


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


def chains(points: Floats, edges: Ints, stops: Mask, turn: float = FeatureSchedule.turn) -> Chains:
    """String edges together, up to where several meet or the curve turns sharply.

    A turn counts as sharp if it is more than `turn` over one edge and over two edges on each side, and
    clearly more than the turns next to it, so that neither a saw nor a coarse circle is full of corners.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    edges
        (k, 2) nodes.
    stops
        (n,) nodes where every chain ends.
    turn
        Degrees.
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
    sharp = (one > turn) & (two > turn) & ((one > 1.5 * turn) | (excess > 0.5 * turn))
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
