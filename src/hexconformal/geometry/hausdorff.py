"""Hausdorff distance between two surfaces of bilinear quads or triangles, in both directions, to a tolerance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from ..mesh import face_edges, unique_edges
from .bilinear_surface import BilinearSurface, bilinear_grid, needed_parts
from .closest_point import ClosestPoints, SurfaceLocator

__all__ = ["distance_between", "hausdorff", "peaks", "surface_samples"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_TOLERANCE = 1e-4  # of diagonals, where none is given
_RELATIVE = 0.02  # of the distance itself: this close is as good
_MOST_SAMPLES = 16  # places along a side of a quad that are compared
_MOST_CUTS = 10  # times that a patch is cut in four


def surface_samples(faces: Ints) -> tuple[Ints, Floats]:
    """Samples of a surface: nodes, edge midpoints, centres, and half-way from centre to corner.

    Parameters
    ----------
    faces
        (q, k) nodes in cyclic order, k of them each.

    Returns
    -------
    (s,) the face of each sample, (s, k) weights of its nodes. Every node and every edge comes once; the nodes
    come first, in ascending order.

    Examples
    --------
    >>> of, weights = surface_samples(np.array([[0, 1, 2, 3], [1, 4, 5, 2]]))
    >>> len(of), weights[6].tolist()  # 6 nodes, 7 edges, 2 centres, 8 quarter points
    (23, [0.5, 0.5, 0.0, 0.0])
    """
    count, size = faces.shape
    corner = np.eye(size)
    nodes = np.unique(faces, return_index=True)[1]
    edges = unique_edges(face_edges(faces)).first
    middle = (corner + np.roll(corner, 1, axis=1)) / 2
    centre = np.full((count, size), 1.0 / size)
    every = np.arange(count)
    of = np.concatenate([nodes // size, edges // size, every, np.repeat(every, size)])
    quarters = np.tile((corner + 1.0 / size) / 2, (count, 1))
    return of, np.concatenate([corner[nodes % size], middle[edges % size], centre, quarters])


def peaks(
    this: SurfaceLocator | BilinearSurface,
    that: SurfaceLocator | BilinearSurface,
    which: Ints,
    spacing: float,
    least: float,
) -> tuple[Ints, Floats]:
    """Places on some quads of a surface that are farther from another one than others around them.

    Parameters
    ----------
    this, that
        The two, with faces in the same order.
    which
        Ids of quads.
    spacing
        Distance between the places that are compared, in units of length.
    least
        Distance that they must exceed.

    Returns
    -------
    (s,) the quad of each place, (s, 4) weights of its nodes.
    """
    x = this.points[this.faces[which]]
    parts = np.ceil(np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2).max(axis=1) / spacing)
    parts = parts.clip(2, _MOST_SAMPLES).astype(np.int64)
    faces, weights = [which[:0]], [np.empty((0, 4))]
    for n in np.unique(parts):
        own, (grid, _) = which[parts == n], bilinear_grid(int(n))
        places = np.einsum("sj,qji->qsi", grid, this.points[this.faces[own]]).reshape(-1, 3)
        distances = that.closest(places, np.repeat(own, len(grid))).distances.reshape(len(own), n + 1, n + 1)
        highest = distances == maximum_filter(distances, size=(1, 3, 3))
        found = (highest & (distances > least)).reshape(len(own), -1)
        faces.append(own[np.nonzero(found)[0]])
        weights.append(grid[np.nonzero(found)[1]])
    return np.concatenate(faces), np.concatenate(weights)


def hausdorff(
    points: Floats, reference: Floats, quads: Ints, tolerance: float | None = None, least: float = 0.0
) -> float:
    """Largest distance between two positions of a surface of bilinear quads, taken in both directions.

    Parameters
    ----------
    points, reference
        (n, 3) coordinates of the two.
    quads
        (q, 4) nodes in cyclic order.
    tolerance, least
        See :func:`distance_between`.

    Returns
    -------
    The distance in units of length.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh.topology import boundary_quads
    >>> points, cells = box((3, 3, 3))
    >>> round(hausdorff(1.1 * points, points, boundary_quads(cells)[0]), 12) == round(0.1 * 3**0.5, 12)
    True
    """
    # Its own quad on the other surface is the best first guess, the whole surface is searched.
    near = np.arange(len(quads))
    return distance_between(
        SurfaceLocator(points, quads), SurfaceLocator(reference, quads), (near, near), tolerance, least
    )


def distance_between(
    one: SurfaceLocator,
    other: SurfaceLocator,
    near: tuple[Ints | None, Ints | None] = (None, None),
    tolerance: float | None = None,
    least: float = 0.0,
) -> float:
    """Largest distance between two surfaces of bilinear quads or triangles, taken in both directions.

    Starting with the faces themselves, patches of a surface are cut in four as long as points on them may be farther
    from the other surface than any looked at so far: a patch is no farther away than its corners are from one face of
    the other surface, or than its corners and centre are from all of it, and what that bends between their closest
    points.

    Parameters
    ----------
    one, other
        The two.
    near
        For the faces of each the faces of the other that are probably close, to save time.
    tolerance
        How far below the distance the one returned may be, in units of length, if that is more than a fiftieth of it;
        default 1e-4 of the diagonal.
    least
        Distance that is returned where there is none above it: with it, it goes faster.

    Returns
    -------
    The distance in units of length.
    """
    if tolerance is None:
        tolerance = _TOLERANCE * float(np.linalg.norm(np.ptp(other.points[np.unique(other.faces)], axis=0)))
    ways = [
        _Patches.of(this, _followed(that, tolerance), guess)
        for (this, that), guess in zip(((one, other), (other, one)), near, strict=True)
    ]
    worst = max(least, *(patches.worst for patches in ways))
    return max(patches.farthest(worst, tolerance) for patches in ways)


def _followed(surface: SurfaceLocator, tolerance: float) -> BilinearSurface:
    """The surface by triangles that are close to it; triangles are quads, two corners of which are one."""
    quads = surface.faces[:, [0, 1, 2, -1]]
    parts = np.ones(len(quads), dtype=np.int64)
    parts = parts if surface.faces.shape[1] == 3 else needed_parts(surface.points, quads, tolerance)
    followed = BilinearSurface(surface.points, quads, parts)
    if parts.max() == 1:
        followed.__dict__["locator"] = surface
    return followed


@dataclass(frozen=True, eq=False)
class _Patches:
    """Bilinear patches of a surface, with what another surface is from their corners.

    Attributes
    ----------
    surface
        The other surface, as small quads or triangles.
    corners
        (p, 4, 3) positions.
    distances, faces
        (p, 4) of the corners from the other surface, and the face of it that is closest.
    """

    surface: SurfaceLocator
    corners: Floats
    distances: Floats
    faces: Ints

    @classmethod
    def of(cls, this: SurfaceLocator, that: BilinearSurface, near: Ints | None) -> _Patches:
        """The faces of a surface."""
        nodes, first, at = np.unique(this.faces, return_index=True, return_inverse=True)
        start = None if near is None else that.first[near[first // this.faces.shape[1]]]
        there = that.locator.closest(this.points[nodes], start)
        at = at.reshape(this.faces.shape)[:, [0, 1, 2, -1]]
        return cls(that.locator, this.points[nodes][at], there.distances[at], there.faces[at])

    @property
    def worst(self) -> float:
        """Largest distance of a corner."""
        return float(self.distances.max(initial=0.0))

    def farthest(self, worst: float, tolerance: float) -> float:
        """Largest distance of any place on the patches, if it is more than `worst` and a tolerance."""
        patches, normals = self, _normals(self.surface)
        for _ in range(_MOST_CUTS):
            centres = patches.corners.mean(axis=1)
            there = self.surface.closest(centres, patches.faces[:, 0])
            worst = max(worst, float(there.distances.max(initial=0.0)))
            enough = worst + max(tolerance, _RELATIVE * worst)
            radius = np.sqrt(((patches.corners - centres[:, None]) ** 2).sum(axis=2).max(axis=1))
            cosine = np.einsum("pki,pi->pk", normals[patches.faces], normals[there.faces]).min(axis=1).clip(0.0, 1.0)
            bend = np.sqrt((1.0 - cosine) / (1.0 + cosine))  # the tangent of half the angle between normals
            most = np.maximum(patches.distances.max(axis=1), there.distances) + radius * bend
            left = np.flatnonzero(np.minimum(most, there.distances + radius) > enough)
            to_one = self.surface.distances_to(patches.corners[left].reshape(-1, 3), np.repeat(there.faces[left], 4))
            left = left[to_one.reshape(-1, 4).max(axis=1) > enough]
            if len(left) == 0:
                break
            patches = patches._quartered(left, centres, there)
            worst = max(worst, patches.worst)
        return worst

    def _quartered(self, which: Ints, centres: Floats, there: ClosestPoints) -> _Patches:
        """The quarters of some patches, of all of which the centres are known and what is closest to them."""
        corners, faces = self.corners[which], self.faces[which]
        middle = 0.5 * (corners + np.roll(corners, -1, axis=1))
        between = self.surface.closest(middle.reshape(-1, 3), faces.ravel())
        return _Patches(
            self.surface,
            _quarters(corners, middle, centres[which]),
            _quarters(self.distances[which], between.distances.reshape(-1, 4), there.distances[which]),
            _quarters(faces, between.faces.reshape(-1, 4), there.faces[which]),
        )


def _quarters(corners: Any, middle: Any, centre: Any) -> Any:
    """(4 p, 4, ...) values at the corners of quarters, from those at corners and edges (p, 4, ...) and centres."""
    centre = np.broadcast_to(centre[:, None], corners.shape)
    quarters = np.stack([corners, middle, centre, np.roll(middle, 1, axis=1)], axis=2)
    return quarters.reshape(-1, *corners.shape[1:])


def _normals(surface: SurfaceLocator) -> Floats:
    """(f, 3) unit normals."""
    x = surface.points[surface.faces]
    normals = np.cross(x[:, 2] - x[:, 0], x[:, -1] - x[:, 1])
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None])
