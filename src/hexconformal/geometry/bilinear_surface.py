"""Surfaces of bilinear quads, by triangles as small as it takes to be near enough to them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .closest_point import ClosestPoints, SurfaceLocator
from .closest_point_kernels import walk_parts_range

__all__ = ["BilinearSurface", "bilinear_grid", "bilinear_weights", "needed_parts"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_MOST_PARTS = 16


@dataclass(frozen=True, eq=False)
class BilinearSurface:
    """A surface of quads, each of which is cut into parts, n along a side; for closest points as a SurfaceLocator.

    Attributes
    ----------
    points
        (n, 3) coordinates.
    faces
        (q, 4) nodes in cyclic order.
    parts
        (q,) parts along a side of each quad; see :func:`needed_parts`.
    sheets
        (q,) as of a :class:`SurfaceLocator`.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 0]])
    >>> quads, place = np.array([[0, 1, 2, 3]]), np.array([[0.25, 0.25, 0.0625]])
    >>> coarse = SurfaceLocator(points, quads).closest(place)
    >>> fine = BilinearSurface(points, quads, needed_parts(points, quads, 0.005)).closest(place)
    >>> coarse.distances.round(4), fine.distances.round(4), fine.weights.round(4)
    (array([0.0559]), array([0.]), array([[0.5625, 0.1875, 0.0625, 0.1875]]))
    """

    points: Floats
    faces: Ints
    parts: Ints
    sheets: Ints | None = None

    def with_points(self, points: Floats) -> BilinearSurface:
        """The same faces and parts with other points (n, 3)."""
        other = replace(self, points=points)
        other.__dict__["_cut"] = self._cut
        other.__dict__["_neighbours"] = self._neighbours
        return other

    def part(self, faces: Ints, local: Ints, points: Floats) -> BilinearSurface:
        """Some of the faces; see :meth:`SurfaceLocator.part`."""
        sheets = None if self.sheets is None else self.sheets[faces]
        return BilinearSurface(points, local[self.faces[faces]], self.parts[faces], sheets)

    def prepared(self) -> BilinearSurface:
        """Itself, with all that queries need made now."""
        self.locator.prepared()
        for name in ("first", "parents", "_boxes", "_neighbours"):
            getattr(self, name)
        return self

    @property
    def nodes_of_sheets(self) -> Ints:
        """(q, 4) as of a :class:`SurfaceLocator`."""
        return SurfaceLocator(self.points, self.faces, self.sheets).nodes_of_sheets

    @cached_property
    def first(self) -> Ints:
        """(q,) the first part of each quad."""
        return np.asarray(np.cumsum(self.parts**2) - self.parts**2)

    @cached_property
    def parents(self) -> Ints:
        """(f,) quad of each part."""
        return np.repeat(np.arange(len(self.faces)), self.parts**2)

    @cached_property
    def _cut(self) -> tuple[Ints, Floats, Ints, Floats]:
        # Quads and weights of the points that come with cutting; nodes of the parts, and their weights in the quads.
        faces = np.empty((int((self.parts**2).sum()), 4), dtype=np.int64)
        weights = np.empty((len(faces), 4, 4))
        quads, shares, count = [np.empty(0, np.int64)], [np.empty((0, 4))], len(self.points)
        for n in np.unique(self.parts):
            which = np.flatnonzero(self.parts == n)
            places = self.first[which][:, None] + np.arange(n * n)
            grid, around = bilinear_grid(int(n))
            weights[places] = grid[around]
            if n == 1:
                faces[places[:, 0]] = self.faces[which]
                continue
            faces[places] = around + (count + len(grid) * np.arange(len(which)))[:, None, None]
            quads.append(np.repeat(which, len(grid)))
            shares.append(np.tile(grid, (len(which), 1)))
            count += len(grid) * len(which)
        return np.concatenate(quads), np.concatenate(shares), faces, weights

    @cached_property
    def locator(self) -> SurfaceLocator:
        """The parts, each of which stands for four triangles around its centre."""
        quads, shares, faces, _ = self._cut
        inside = np.einsum("sj,sji->si", shares, self.points[self.faces[quads]])
        sheets = None if self.sheets is None else self.sheets[self.parents]
        return SurfaceLocator(np.concatenate([self.points, inside]), faces, sheets)

    @cached_property
    def _neighbours(self) -> tuple[Ints, Ints]:
        # Quads that share a node with each quad, itself among them: (q + 1,) offsets and ids.
        return SurfaceLocator(self.points, self.faces, self.sheets).neighbours

    @cached_property
    def _boxes(self) -> Floats:
        # (q, 2, 3) lower and upper corner of the box around the parts of each quad.
        low, high = np.moveaxis(self.locator.boxes, 1, 0)
        return np.stack([np.minimum.reduceat(low, self.first), np.maximum.reduceat(high, self.first)], axis=1)

    def closest(self, places: ArrayLike, near: Ints | None = None) -> ClosestPoints:
        """The closest point of the whole surface; see :meth:`SurfaceLocator.closest`."""
        return self._of_quads(self.locator.closest(places, None if near is None else self.first[near]))

    def closest_by_walk(self, places: ArrayLike, start: Ints) -> ClosestPoints:
        """The closest point found by going to neighbours; see :meth:`SurfaceLocator.closest_by_walk`."""
        parts = np.append(self.first, len(self.parents)), self.parents
        tables = self.locator.boxes, self._boxes, *parts, *self._neighbours
        return self._of_quads(self.locator.query(walk_parts_range, places, start, *tables))

    def _of_quads(self, there: ClosestPoints) -> ClosestPoints:
        weights = np.einsum("kj,kjc->kc", there.weights, self._cut[3][there.faces])
        return replace(there, faces=self.parents[there.faces], weights=weights)


def needed_parts(points: Floats, quads: Ints, tolerance: float) -> Ints:
    """(q,) parts along a side of each quad for which triangles are no farther from it than a tolerance.

    Triangles, which have their last node twice, are flat. A quad a, b, c, d is at most \\|a - b + c - d\\| / 16 away
    from its four triangles, and its parts n^2 times less.
    """
    a, b, c, d = np.moveaxis(points[quads], 1, 0)
    warp = np.where(quads[:, 2] == quads[:, 3], 0.0, np.linalg.norm(a - b + c - d, axis=1) / 16.0)
    return np.ceil(np.sqrt(warp / max(tolerance, 1e-300))).clip(1, _MOST_PARTS).astype(np.int64)


def bilinear_weights(places: Floats) -> Floats:
    """(s, 4) weights of the nodes of a quad at places (s, 2) in the unit square."""
    u, v = places.T
    return np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=1)


def bilinear_grid(n: int) -> tuple[Floats, Ints]:
    """Weights ((n + 1)^2, 4) of the nodes of a quad at a grid on it, and the grid's own quads (n^2, 4)."""
    s = np.linspace(0.0, 1.0, n + 1)
    weights = bilinear_weights(np.stack([side.ravel() for side in np.meshgrid(s, s, indexing="ij")], axis=1))
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    around = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    return weights, np.stack([corner.ravel() for corner in around], axis=1)
