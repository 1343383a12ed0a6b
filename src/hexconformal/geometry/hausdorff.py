"""Hausdorff distance between surfaces of triangles and bilinear quadrilaterals, both ways, to a tolerance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ..mesh import face_edges, unique_edges
from .area_vectors import face_area_vectors, unit_vectors
from .bilinear_surface import BilinearSurface, bilinear_grid, needed_parts
from .closest_point import ClosestPoints, SurfaceLocator
from .faces import Faces

__all__ = ["distance_between", "faces_beyond", "hausdorff", "peaks", "peaks_between", "surface_samples"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

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
    unique = unique_edges(face_edges(faces))
    edges = unique.first[unique.nodes[:, 0] != unique.nodes[:, 1]]  # a triangle may have a node twice
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
        highest = distances == scipy.ndimage.maximum_filter(distances, size=(1, 3, 3))
        found = (highest & (distances > least)).reshape(len(own), -1)
        faces.append(own[np.nonzero(found)[0]])
        weights.append(grid[np.nonzero(found)[1]])
    return np.concatenate(faces), np.concatenate(weights)


def peaks_between(
    one: SurfaceLocator | BilinearSurface,
    other: SurfaceLocator | BilinearSurface,
    faces: Ints,
    weights: Floats,
    spacing: float,
    least: float,
    reach: float,
) -> list[tuple[Ints, Floats]]:
    """The :func:`peaks` of each of two surfaces beyond the other, on quads that may have one.

    That is told by samples (s,) of quads with weights (s, 4), which peaks are no higher above than a share of the
    longest edge of the quad of `one`.
    """
    x = one.points[one.faces]
    rise = reach * np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2).max(axis=1)
    found = []
    for this, that in ((one, other), (other, one)):
        places = np.einsum("sj,sji->si", weights, this.points[this.faces[faces]])
        may_be = that.closest(places, faces).distances > (least - rise)[faces]
        found.append(peaks(this, that, np.unique(faces[may_be]), spacing, least))
    return found


def hausdorff(
    points: Floats,
    reference: Floats,
    faces: Faces | Ints,
    tolerance: float | None = None,
    least: float = 0.0,
    relative: float = _RELATIVE,
    sheets: Ints | None = None,
) -> float:
    """Largest distance between two positions of a surface, taken in both directions.

    Parameters
    ----------
    points, reference
        (n, 3) coordinates of the two.
    faces
        Triangles and bilinear quadrilaterals.
    tolerance, least, relative
        See :func:`distance_between`.
    sheets
        (f,) sheet of each face: each is compared with itself.

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
    # Its own face on the other surface is the best first guess, the whole surface is searched.
    table = faces.table if isinstance(faces, Faces) else faces
    near = np.arange(len(table))
    one, other = (SurfaceLocator(x, table, sheets) for x in (points, reference))
    return distance_between(one, other, (near, near), tolerance, least, relative)


def distance_between(
    one: SurfaceLocator,
    other: SurfaceLocator,
    near: tuple[Ints | None, Ints | None] = (None, None),
    tolerance: float | None = None,
    least: float = 0.0,
    relative: float = _RELATIVE,
) -> float:
    """Largest distance between two surfaces of triangles and bilinear quadrilaterals, taken in both directions.

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
        How far below the distance the one returned may be, in units of length; default 1e-4 of the diagonal.
    least
        Distance that is returned where there is none above it: with it, it goes faster.
    relative
        How far below, as a share of the distance, if that is more.

    Returns
    -------
    The distance in units of length.
    """
    tolerance, ways = _both_ways(one, other, near, tolerance)
    least = max(least, *(float(patches.distances.max(initial=0.0)) for patches in ways))
    found = [distances.max() for patches in ways for _, distances, _ in patches.levels(least, tolerance, relative)]
    return float(max(least, *found))


def faces_beyond(
    one: SurfaceLocator,
    other: SurfaceLocator,
    bound: float,
    near: tuple[Ints | None, Ints | None] = (None, None),
    tolerance: float | None = None,
) -> Mask:
    """Find the faces of a surface to which a distance of :func:`distance_between` is due that is more than a bound.

    Parameters
    ----------
    one, other, near, tolerance
        See :func:`distance_between`.
    bound
        In units of length.

    Returns
    -------
    (f,) the faces of `one` with a place farther than that from `other`, or closest to such a place of it.

    Examples
    --------
    >>> strip = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]])
    >>> quads, lifted = np.array([[0, 1, 4, 3], [1, 2, 5, 4]]), strip.copy()
    >>> lifted[[2, 5], 2] = 0.1
    >>> flat, bent = SurfaceLocator(strip, quads), SurfaceLocator(lifted, quads)
    >>> round(distance_between(bent, flat), 12), faces_beyond(bent, flat, 0.01)
    (0.1, array([False,  True]))
    """
    tolerance, ways = _both_ways(one, other, near, tolerance)
    beyond = np.zeros(len(one.faces), dtype=bool)
    for backward, patches in enumerate(ways):
        for owners, distances, below in patches.levels(bound, tolerance):
            patch, place = np.nonzero(distances > bound)
            beyond[patches.surface.parents[below[patch, place]] if backward else owners[patch]] = True
    return beyond


def _both_ways(
    one: SurfaceLocator, other: SurfaceLocator, near: tuple[Ints | None, Ints | None], tolerance: float | None
) -> tuple[float, list[_Patches]]:
    """The tolerance, and the patches of each surface, measured against the other one."""
    if tolerance is None:
        tolerance = _TOLERANCE * float(np.linalg.norm(np.ptp(other.points[np.unique(other.faces)], axis=0)))
    ways = zip(((one, other), (other, one)), near, strict=True)
    return tolerance, [_Patches.of(this, _followed(that, tolerance), guess) for (this, that), guess in ways]


def _followed(surface: SurfaceLocator, tolerance: float) -> BilinearSurface:
    """The surface by triangles that are close to it."""
    quads = surface.faces[:, [0, 1, 2, -1]]
    parts = needed_parts(surface.points, quads, tolerance)
    followed = BilinearSurface(surface.points, quads, parts, surface.sheets)
    if parts.max() == 1:
        followed.__dict__["locator"] = surface
    return followed


@dataclass(frozen=True, eq=False)
class _Patches:
    """Bilinear patches of a surface, with what another surface is from their corners.

    Attributes
    ----------
    surface
        The other surface.
    owners
        (p,) the face that each is a part of.
    corners
        (p, 4, 3) positions.
    distances, below
        (p, 4) of the corners from the other surface, and the small quad of it that is closest.
    """

    surface: BilinearSurface
    owners: Ints
    corners: Floats
    distances: Floats
    below: Ints

    @classmethod
    def of(cls, this: SurfaceLocator, that: BilinearSurface, near: Ints | None) -> _Patches:
        """The faces of a surface."""
        _, first, at = np.unique(this.nodes_of_sheets, return_index=True, return_inverse=True)
        start = None if near is None else that.first[near[first // this.faces.shape[1]]]
        places = this.points[this.faces.ravel()[first]]
        there = that.locator.closest(places, start)
        at = at.reshape(this.faces.shape)[:, [0, 1, 2, -1]]
        return cls(that, np.arange(len(at)), places[at], there.distances[at], there.faces[at])

    def levels(
        self, least: float, tolerance: float, relative: float | None = None
    ) -> Iterator[tuple[Ints, Floats, Ints]]:
        """Measure patches, then the quarters of those that may be more than a tolerance beyond a distance, and so on.

        If a relative tolerance is given, too, that distance becomes the largest one found; otherwise a patch with a
        place beyond it is cut no further.

        Yields the faces (p,) that patches are parts of, distances (p, 5) of their corners and centres, and the small
        quads (p, 5) that these are closest to.
        """
        patches, other = self, self.surface.locator
        normals = unit_vectors(face_area_vectors(other.points, other.faces))
        for _ in range(_MOST_CUTS + 1):
            centres = patches.corners.mean(axis=1)
            there = other.closest(centres, patches.below[:, 0])
            distances = np.column_stack([patches.distances, there.distances])
            yield patches.owners, distances, np.column_stack([patches.below, there.faces])
            if relative is not None:
                least = max(least, float(distances.max()))
                tolerance = max(tolerance, relative * least)
            limit = least + tolerance
            radius = np.sqrt(((patches.corners - centres[:, None]) ** 2).sum(axis=2).max(axis=1))
            cosine = np.einsum("pki,pi->pk", normals[patches.below], normals[there.faces]).min(axis=1).clip(0.0, 1.0)
            bend = np.sqrt((1.0 - cosine) / (1.0 + cosine))  # the tangent of half the angle between normals
            most = distances.max(axis=1) + radius * bend
            unknown = (distances <= least).all(axis=1) if relative is None else True
            left = np.flatnonzero((np.minimum(most, there.distances + radius) > limit) & unknown)
            to_one = other.distances_to(patches.corners[left].reshape(-1, 3), np.repeat(there.faces[left], 4))
            left = left[to_one.reshape(-1, 4).max(axis=1) > limit]
            if len(left) == 0:
                break
            patches = patches._quartered(left, centres, there)

    def _quartered(self, which: Ints, centres: Floats, there: ClosestPoints) -> _Patches:
        """The quarters of some patches, of all of which the centres are known and what is closest to them."""
        corners, below = self.corners[which], self.below[which]
        middle = 0.5 * (corners + np.roll(corners, -1, axis=1))
        between = self.surface.locator.closest(middle.reshape(-1, 3), below.ravel())
        return _Patches(
            self.surface,
            np.repeat(self.owners[which], 4),
            _quarters(corners, middle, centres[which]),
            _quarters(self.distances[which], between.distances.reshape(-1, 4), there.distances[which]),
            _quarters(below, between.faces.reshape(-1, 4), there.faces[which]),
        )


def _quarters(corners: Any, middle: Any, centre: Any) -> Any:
    """(4 p, 4, ...) values at the corners of quarters, from those at corners and edges (p, 4, ...) and centres."""
    centre = np.broadcast_to(centre[:, None], corners.shape)
    quarters = np.stack([corners, middle, centre, np.roll(middle, 1, axis=1)], axis=2)
    return quarters.reshape(-1, *corners.shape[1:])
