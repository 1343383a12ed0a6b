"""Dihedral angles of a quadrilateral surface, filtered normals, rounded edges and stair steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..elements import face_area_vectors
from .quad_edges import QuadEdges

__all__ = ["dihedral_angles", "filtered_normals", "rounded_edges", "stair_steps"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_FILTERINGS = 3  # times that normals are averaged
_NOISE_FACTOR, _WIDEST = 4.0, 60.0  # neighbours count up to this multiple of the noise, at most so many degrees
_SHARP, _CONTRAST = 55.0, 1.5  # degrees from which on no edge is rounded, else how much sharper than those beside


def filtered_normals(points: Floats, quads: Ints, edges: QuadEdges, fronts: Mask | None = None) -> Floats:
    """Unit normals of quads after a bilateral filter: averaged with those of neighbours that agree but for noise.

    A quad that is folded, or has no area, does not count: it gets the normal of its neighbours.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    quads
        (k, 4) nodes, counter-clockwise seen from outside.
    edges
        Of the same quads.
    fronts
        (s,) edges with two quads that lie on each other without being folded.

    Returns
    -------
    (k, 3) unit normals.
    """
    x = points[quads]
    after, before = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    at_corners = np.cross(after, before)
    area = face_area_vectors(points, quads)
    size = np.linalg.norm(area, axis=1)
    lengths = (after**2).sum(axis=2).max(axis=1)
    unfolded = (np.einsum("kci,ki->kc", at_corners, area) > 0).all(axis=1) & (size > 1e-3 * lengths)
    left, right = edges.quads.T
    count = len(quads)
    # Where two quads lie on each other, the smaller one is taken for folded; if the surface does turn there, the other
    # neighbours of that quad put its normal right.
    around = np.einsum("ei,ei->e", area[left], area[right]) < -0.5 * size[left] * size[right]
    front = np.zeros(len(around), dtype=bool) if fronts is None else fronts
    around &= ~front
    folded = np.zeros(len(quads), dtype=bool)
    folded[np.where(size[left] < size[right], left, right)[around]] = True
    weight = np.where(unfolded & ~folded, size, 0.0)
    normals = area / np.where(size > 0, size, 1.0)[:, None]
    least = np.cos(
        np.radians(np.minimum(_NOISE_FACTOR * _noise(dihedral_angles(normals, edges), edges, count), _WIDEST))
    )
    normals[weight == 0] = 0.0
    for iteration in range(_FILTERINGS):
        agree = np.einsum("ei,ei->e", normals[left], normals[right]) - least
        unknown = ((weight[left] == 0) | (weight[right] == 0)) & ~front
        agree = np.where(unknown, 1.0, np.maximum(agree, 0.0))
        sums = normals * np.maximum(weight, 1e-300)[:, None]
        for to, of in ((left, right), (right, left)):
            share = (agree * weight[of])[:, None] * normals[of]
            for axis in range(3):
                sums[:, axis] += np.bincount(to, share[:, axis], minlength=count)
        length = np.linalg.norm(sums, axis=1)
        normals = sums / np.where(length > 0, length, 1.0)[:, None]
        # A quad that did not count now passes on the normal that it got.
        if iteration < _FILTERINGS - 1:
            weight = np.where((weight == 0) & (length > 0), size, weight)
    return normals


def _noise(angles: Floats, edges: QuadEdges, count: int) -> Floats:
    """(s,) degrees by which normals vary for noise, around each edge with two quads."""
    every = np.zeros(len(edges.nodes))
    every[edges.manifold] = angles
    # Along creases and around cylinders two edges of a quad are flat; only where it is rough are there three bends.
    rough = np.sort(every[edges.of_quads], axis=1)[:, 1]
    left, right = edges.quads.T
    total, number = rough.copy(), np.ones(count)
    for to, of in ((left, right), (right, left)):
        total += np.bincount(to, rough[of], minlength=count)
        number += np.bincount(to, minlength=count)
    mean = total / number
    return np.asarray(np.maximum(mean[left], mean[right]))


def dihedral_angles(normals: Floats, edges: QuadEdges) -> Floats:
    """(s,) angles in degrees between the normals on both sides of the edges with two quads, 0 where it is flat."""
    a, b = normals[edges.quads[:, 0]], normals[edges.quads[:, 1]]
    return np.asarray(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ei,ei->e", a, b))))


def rounded_edges(angles: Floats, edges: QuadEdges) -> Mask:
    """(s,) edges hardly sharper than the next ones on both sides: of a coarse cylinder, not of a crease.

    Parameters
    ----------
    angles
        (s,) degrees at the edges with two quads.
    edges
        Of the same surface.
    """
    every = np.zeros(len(edges.nodes))
    every[edges.manifold] = angles
    # The angle at the edge opposite to each edge of each quad, then the smaller one of both quads.
    opposite = every[np.roll(edges.of_quads, 2, axis=1)]
    least = np.full(len(edges.nodes), np.inf)
    np.minimum.at(least, edges.of_quads.ravel(), opposite.ravel())
    return np.asarray((angles < _SHARP) & (angles < _CONTRAST * least[edges.manifold]))


def stair_steps(points: Floats, quads: Ints, edges: QuadEdges, angle: float) -> tuple[Mask, Mask]:
    """Find treads and risers of stair steps: quads between a sharp convex and a sharp concave edge.

    Returns
    -------
    (k,) the quads that are steps;
    (s,) edges with two quads that are sharper than `angle` degrees.
    """
    area = face_area_vectors(points, quads)
    size = np.linalg.norm(area, axis=1)
    normals = area / np.where(size > 0, size, 1.0)[:, None]
    sharp = dihedral_angles(normals, edges) > angle
    centers = points[quads].mean(axis=1)
    left, right = edges.quads.T
    rises = np.einsum("ei,ei->e", centers[right] - centers[left], normals[left] - normals[right])
    sign = np.zeros(len(edges.nodes))
    sign[edges.manifold] = np.where(sharp, np.sign(rises), 0.0)
    around = sign[edges.of_quads]
    return np.asarray((around * np.roll(around, 2, axis=1) < 0).any(axis=1)), sharp
