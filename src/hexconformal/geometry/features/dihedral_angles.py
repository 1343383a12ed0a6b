"""Dihedral angles of a surface, filtered normals, rounded edges and stair steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..area_vectors import face_area_vectors
from ..edges import EdgeTable
from ..faces import Faces
from .schedules import FeatureSchedule

__all__ = ["dihedral_angles", "filtered_normals", "rounded_edges", "stair_steps"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def filtered_normals(
    points: Floats, faces: Faces, edges: EdgeTable, fronts: Mask | None = None, schedule: FeatureSchedule | None = None
) -> Floats:
    """Unit normals of faces after a bilateral filter: averaged with those of neighbours that agree but for noise.

    A face that is folded, or has no area, does not count: it gets the normal of its neighbours.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    faces
        Counter-clockwise seen from outside.
    edges
        Of the same faces.
    fronts
        (s,) edges with two faces that lie on each other without being folded.
    schedule
        How often, and up to which angle.

    Returns
    -------
    (f, 3) unit normals.
    """
    schedule = FeatureSchedule() if schedule is None else schedule
    x = points[faces.corners]
    after, before = x[faces.around(1)] - x, x[faces.around(-1)] - x
    area = face_area_vectors(points, faces)
    size = np.linalg.norm(area, axis=1)
    convex = np.einsum("ci,ci->c", np.cross(after, before), area[faces.owners]) > 0
    lengths = faces.over_corners(np.maximum, (after**2).sum(axis=1))
    unfolded = faces.over_corners(np.logical_and, convex) & (size > 1e-3 * lengths)
    left, right = edges.sides.T
    count = len(faces)
    # Where two faces lie on each other, the smaller one is taken for folded; if the surface does turn there, the other
    # neighbours of that face put its normal right.
    around = np.einsum("ei,ei->e", area[left], area[right]) < -0.5 * size[left] * size[right]
    front = np.zeros(len(around), dtype=bool) if fronts is None else fronts
    around &= ~front
    folded = np.zeros(count, dtype=bool)
    folded[np.where(size[left] < size[right], left, right)[around]] = True
    weight = np.where(unfolded & ~folded, size, 0.0)
    normals = area / np.where(size > 0, size, 1.0)[:, None]
    noise = _noise(dihedral_angles(normals, edges), faces, edges)
    least = np.cos(np.radians(np.minimum(schedule.noise_factor * noise, schedule.widest)))
    normals[weight == 0] = 0.0
    for iteration in range(schedule.filterings):
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
        # A face that did not count now passes on the normal that it got.
        if iteration < schedule.filterings - 1:
            weight = np.where((weight == 0) & (length > 0), size, weight)
    return normals


def _noise(angles: Floats, faces: Faces, edges: EdgeTable) -> Floats:
    """(s,) degrees by which normals vary for noise, around each edge with two faces."""
    every = np.zeros(len(edges.nodes))
    every[edges.manifold] = angles
    # Along creases and around cylinders two edges of a face are flat; only where it is rough are there more bends.
    rough = np.concatenate([np.sort(every[table], axis=1)[:, 1] for table in edges.of_faces(faces)])
    left, right = edges.sides.T
    total, number = rough.copy(), np.ones(len(faces))
    for to, of in ((left, right), (right, left)):
        total += np.bincount(to, rough[of], minlength=len(faces))
        number += np.bincount(to, minlength=len(faces))
    mean = total / number
    return np.asarray(np.maximum(mean[left], mean[right]))


def dihedral_angles(normals: Floats, edges: EdgeTable) -> Floats:
    """(s,) angles in degrees between the normals on both sides of the edges with two faces, 0 where it is flat."""
    a, b = normals[edges.sides[:, 0]], normals[edges.sides[:, 1]]
    return np.asarray(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ei,ei->e", a, b))))


def rounded_edges(angles: Floats, faces: Faces, edges: EdgeTable, schedule: FeatureSchedule) -> Mask:
    """(s,) edges hardly sharper than the next ones on both sides: of a coarse cylinder, not of a crease.

    Parameters
    ----------
    angles
        (s,) degrees at the edges with two faces.
    faces, edges
        Of the same surface.
    schedule
        How sharp no rounded one is.
    """
    every = np.zeros(len(edges.nodes))
    every[edges.manifold] = angles
    # The angle at the edge opposite to each edge of each quadrilateral, then the smaller one of both; in a triangle
    # there is none.
    triangles, quads = edges.of_faces(faces)
    opposite = every[np.roll(quads, 2, axis=1)]
    least = np.full(len(edges.nodes), np.inf)
    np.minimum.at(least, quads.ravel(), opposite.ravel())
    least[triangles] = 0.0
    return np.asarray((angles < schedule.sharp) & (angles < schedule.contrast * least[edges.manifold]))


def stair_steps(points: Floats, faces: Faces, edges: EdgeTable, angle: float) -> tuple[Mask, Mask]:
    """Find treads and risers of stair steps: quadrilaterals between a sharp convex and a sharp concave edge.

    Returns
    -------
    (f,) the faces that are steps;
    (s,) edges with two faces that are sharper than `angle` degrees.
    """
    area = face_area_vectors(points, faces)
    size = np.linalg.norm(area, axis=1)
    normals = area / np.where(size > 0, size, 1.0)[:, None]
    sharp = dihedral_angles(normals, edges) > angle
    centers = faces.centres(points)
    left, right = edges.sides.T
    rises = np.einsum("ei,ei->e", centers[right] - centers[left], normals[left] - normals[right])
    sign = np.zeros(len(edges.nodes))
    sign[edges.manifold] = np.where(sharp, np.sign(rises), 0.0)
    around = sign[edges.of_faces(faces)[1]]
    steps = (around * np.roll(around, 2, axis=1) < 0).any(axis=1)
    return np.concatenate([np.zeros(len(faces.triangles), dtype=bool), steps]), sharp
