"""Samples of a boundary, of its original and of its features, with what is known of how far apart they are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..energy import Patch
from ..kernel import parallel_ranges
from .barrier_schedule import BarrierSchedule, Steep
from .bilinear_surface import BilinearSurface
from .closest_point import ClosestPoints, CurveLocator, SurfaceLocator
from .features import Features
from .sample_sums import outward_projections, sample_places

__all__ = ["Curves", "Distances", "PartOfSkin", "Samples", "distance_projectors", "identities", "moved_by"]
__all__ += ["normal_projectors", "part_of_skin"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Surface = SurfaceLocator | BilinearSurface


@dataclass(frozen=True, eq=False)
class Distances:
    """Distances of some samples at some points, with what a barrier needs of them.

    Attributes
    ----------
    nodes, weights
        (k, j) nodes that move each sample, and the share of each in it.
    residuals
        (k, 3) from where the sample belongs to where it is.
    distances
        (k,) their lengths.
    surface, faces
        Surface that the distances are measured from, and the closest face (k,) of it.
    """

    nodes: Ints
    weights: Field
    residuals: Field
    distances: Field
    surface: Surface
    faces: Ints

    def directions(self, bound: float) -> Field:
        """(k, 3, 3) projections onto the directions in which the distances grow."""
        return distance_projectors(self.residuals, self.distances, bound, self.surface, self.faces)


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples in one direction: of the moved surface from another one, or of another one from the moved surface.

    Attributes
    ----------
    faces, weights
        (k,) face of the moved surface each lies on, (k, 4) weights of its nodes; both empty backwards.
    places
        (k, 3) where they are, backwards; empty forwards.
    near
        (k,) face that was closest when they were last looked at.
    distances
        (k,) distance then.
    attraction
        (k,) how strongly each is drawn back from wherever it is, in that of the schedule; 0 where only from near the
        bound.
    """

    faces: Ints
    weights: Field
    places: Field
    near: Ints
    distances: Field
    attraction: Field

    @classmethod
    def forward(
        cls, faces: Ints, weights: Field, near: Ints, distances: Field, attraction: Field | None = None
    ) -> Samples:
        """Samples of the moved surface."""
        attraction = np.zeros(len(faces)) if attraction is None else attraction
        return cls(faces, weights, np.empty((0, 3)), near, distances, attraction)

    @classmethod
    def backward(cls, places: Field, near: Ints, distances: Field) -> Samples:
        """Places that the moved surface should be near to."""
        none = np.empty(0, np.int64), np.empty((0, 4))
        return cls(*none, places, near, distances, np.zeros(len(places)))

    def chosen(self, which: Mask) -> Samples:
        """Some of them."""
        names = ("faces", "weights", "places", "near", "distances", "attraction")
        return Samples(*(x[which] if len(x := getattr(self, name)) else x for name in names))

    def __len__(self) -> int:
        return len(self.near)

    @property
    def carriers(self) -> Ints:
        """(k,) faces of the moved surface whose movement changes the distances."""
        return self.faces if len(self.faces) else self.near

    def most(self, moved: Field) -> Field:
        """(k,) largest distance they can have, where each face (q,) has moved so far since: it grows no faster."""
        return np.asarray(self.distances + moved[self.carriers])

    def among(self, movable: Mask, numbers: Ints) -> Samples:
        """Those that move with faces (q,), or are near them, by the numbers that faces (q,) have from now on."""
        keep, forward = movable[self.carriers], len(self.faces) > 0
        return Samples(
            numbers[self.faces[keep]] if forward else self.faces,
            self.weights[keep] if forward else self.weights,
            self.places if forward else self.places[keep],
            self.near[keep] if forward else numbers[self.near[keep]],
            self.distances[keep],
            self.attraction[keep],
        )

    def joined(self, other: Samples) -> Samples:
        """These samples and others."""
        names = ("faces", "weights", "places", "near", "distances", "attraction")
        return Samples(*(np.concatenate([getattr(self, name), getattr(other, name)]) for name in names))

    def measured(self, which: Ints, moved: Surface, other: Surface, far: float | None = None) -> Distances:
        """Distances of some of them between the moved surface and the other one.

        Closest points are found by walking; those farther away than `far` are looked for everywhere, if it is given, as
        a walk may end in a dead end.
        """
        if len(self.faces):
            every = len(which) == len(self)
            faces, weights = (self.faces, self.weights) if every else (self.faces[which], self.weights[which])
            nodes = moved.faces[faces]
            places = np.empty((len(which), 3))
            parallel_ranges(sample_places, len(which), nodes, weights, moved.points, places)
            there = _closest(other, places, self.near[which], far)
            return Distances(nodes, weights, places - there.positions, there.distances, other, there.faces)
        if len(which) == 0:  # the moved surface is new each time: nothing is prepared for nothing
            none = np.empty((0, moved.faces.shape[1]))
            return Distances(none.astype(np.int64), none, np.empty((0, 3)), np.empty(0), moved, np.empty(0, np.int64))
        there = _closest(moved, self.places[which], self.near[which], far)
        residuals = there.positions - self.places[which]
        return Distances(moved.faces[there.faces], there.weights, residuals, there.distances, moved, there.faces)

    def seen(self, which: Ints, found: Distances, most: Field) -> Samples:
        """The same, of which some have been measured, and all others may be so far away."""
        near, distances = self.near.copy(), most.copy()
        near[which], distances[which] = found.faces, found.distances
        return replace(self, near=near, distances=distances)


@dataclass(frozen=True, eq=False)
class Curves:
    """Feature curves and corners: nodes and midpoints of edges stay near the curve that they were on.

    Attributes
    ----------
    locator
        The original curves; None where there are none.
    nodes, weights
        (k, 2) nodes that move each sample, and their shares.
    near
        (k,) edge that was closest when they were last looked at.
    slack
        (k,) samples that may go as far as the surface.
    corners, places
        (c,) nodes that stay near where they were, and (c, 3) where that is.
    slack_corners
        (c,) those that may go as far as the surface.
    """

    locator: CurveLocator | None
    nodes: Ints
    weights: Field
    near: Ints
    slack: Mask
    corners: Ints
    places: Field
    slack_corners: Mask

    @classmethod
    def of(cls, points: Field, features: Features | None, there: CurveLocator | None = None) -> Curves:
        """The features that are not soft; near to where they are, or to curves of the same numbers elsewhere."""
        none, never = np.empty(0, np.int64), np.empty(0, bool)
        if features is None or features.soft:
            return cls(None, np.empty((0, 2), np.int64), np.empty((0, 2)), none, never, none, np.empty((0, 3)), never)
        edges = features.edges
        # Each node once per curve; corners are held by themselves.
        keys = edges * (int(features.curves.max(initial=0)) + 1) + features.curves[:, None]
        first = np.unique(keys, return_index=True)[1]
        first = first[~np.isin(edges.ravel()[first], features.corners)]
        ends = edges.ravel()[first]
        nodes = np.vstack([np.column_stack([ends, ends]), edges])
        weights = np.vstack([np.tile([1.0, 0.0], (len(ends), 1)), np.full((len(edges), 2), 0.5)])
        corners = features.corners, points[features.corners], features.slack_corners
        if len(edges) == 0:
            return cls(None, nodes, weights, none, never, *corners)
        near = np.concatenate([first // 2, np.arange(len(edges))])
        slack, locator = features.slack[near], CurveLocator(points, edges, features.curves)
        if there is not None:
            places, locator = np.einsum("kj,kji->ki", weights, points[nodes]), there
            near = locator.closest(places, features.curves[near]).faces
            # Nodes can lie on another curve; the middle of an edge is where its bend puts it.
            slack[len(first) :] = True
        return cls(locator, nodes, weights, near, slack, *corners)

    def measured(self, points: Field, bound: float, schedule: BarrierSchedule) -> tuple[list[Steep], Curves]:
        """What the barrier makes of their distances at points (n, 3), and the same with the edges closest now."""
        steep, near = [], self.near
        if self.locator is not None and len(near):
            places = np.einsum("kj,kji->ki", self.weights, points[self.nodes])
            there = self.locator.closest_by_walk(places, near)
            ends = self.locator.points[self.locator.edges[there.faces]]
            growing, near = partial(normal_projectors, ends, there.weights), there.faces
            found = places - there.positions, there.distances
            steep.append(schedule.steep_of_curves(self.nodes, self.weights, *found, bound, self.slack, growing))
        if len(self.corners):
            residuals, nodes = points[self.corners] - self.places, np.column_stack([self.corners, self.corners])
            weights, found = np.tile([1.0, 0.0], (len(nodes), 1)), (residuals, np.linalg.norm(residuals, axis=1))
            growing = partial(identities, len(nodes))
            steep.append(schedule.steep_of_curves(nodes, weights, *found, bound, self.slack_corners, growing))
        return steep, replace(self, near=near)

    def with_slack(self, nodes: Mask) -> tuple[Curves, int]:
        """The same, where curves and corners at some nodes (n,) may go as far as the surface; how many are new."""
        if self.locator is None:
            corners = self.slack_corners | nodes[self.corners]
            return replace(self, slack_corners=corners), int((corners & ~self.slack_corners).sum())
        curves = self.locator.curves[self.near]
        touched = np.unique(curves[nodes[self.nodes].any(axis=1) & ~self.slack])
        slack, corners = self.slack | nodes[self.nodes].any(axis=1), self.slack_corners | nodes[self.corners]
        return replace(self, slack=slack, slack_corners=corners), len(touched)

    def restricted(self, patch: Patch) -> Curves:
        """Those that can move, as nodes of the patch."""
        keep, inside = patch.moving[self.nodes].any(axis=1), patch.moving[self.corners]
        return replace(
            self,
            nodes=patch.local[self.nodes[keep]],
            corners=patch.local[self.corners[inside]],
            **{name: getattr(self, name)[keep] for name in ("weights", "near", "slack")},
            **{name: getattr(self, name)[inside] for name in ("places", "slack_corners")},
        )


@dataclass(frozen=True, eq=False)
class PartOfSkin:
    """The faces of a surface that move with a patch, and those beside them.

    Attributes
    ----------
    skin
        These faces, by the nodes of the patch, and others behind them.
    nodes
        (k,) ids of all these nodes.
    movable
        (f,) faces of the whole that move.
    numbers
        (f,) number of each face here; -1 for those that are not.
    """

    skin: Surface
    nodes: Ints
    movable: Mask
    numbers: Ints


def part_of_skin(skin: Surface, patch: Patch, points: Field) -> PartOfSkin | None:
    """What a patch moves of a surface with points (n, 3), nodes of the mesh first; None where that is nothing."""
    faces, stay = skin.faces, len(points) - len(patch.moving)
    moving = np.concatenate([patch.moving, np.zeros(stay, dtype=bool)])
    movable = np.asarray(moving[faces].any(axis=1))
    if not movable.any():
        return None
    touched = np.zeros(len(points), dtype=bool)
    touched[faces[movable]] = True
    kept, numbers = np.flatnonzero(touched[faces].any(axis=1)), np.full(len(faces), -1)
    numbers[kept] = np.arange(len(kept))
    local = np.concatenate([patch.local, np.full(stay, -1)])
    beyond = np.unique(faces[kept])
    beyond = beyond[local[beyond] < 0]
    local[beyond] = len(patch.nodes) + np.arange(len(beyond))
    nodes = np.concatenate([patch.nodes, beyond])
    return PartOfSkin(skin.part(kept, local, points[nodes]), nodes, movable, numbers)


def moved_by(shift: Field, faces: Ints) -> Field:
    """(q,) how far the nodes of each face have gone at most, of displacements (n, 3)."""
    steps = np.sqrt(np.einsum("ni,ni->n", shift, shift))[faces]
    return np.asarray(np.maximum(np.maximum(steps[:, 0], steps[:, 1]), np.maximum(steps[:, -2], steps[:, -1])))


def _closest(surface: Surface, places: Field, start: Ints, far: float | None) -> ClosestPoints:
    there = surface.closest_by_walk(places, start)
    if far is not None and (away := there.distances > far).any():
        start = there.faces.copy()
        start[away] = surface.closest(places[away], start[away]).faces
        there = surface.closest_by_walk(places, start)
    return there


def distance_projectors(
    residuals: Field, distances: Field, bound: float, surface: SurfaceLocator | BilinearSurface, faces: Ints
) -> Field:
    """n n^T of the direction in which the distance grows; the normal of the face where there is no distance."""
    out = np.empty((len(faces), 3, 3))
    where = surface.points, surface.faces, faces
    parallel_ranges(outward_projections, len(faces), residuals, distances, 1e-9 * bound, *where, out)
    return out


def normal_projectors(ends: Field, weights: Field) -> Field:
    """1 - t t^T of straight edges (k, 2, 3); 1 where the closest point is one of the ends."""
    tangent = ends[:, 1] - ends[:, 0]
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1), 1e-300)[:, None]
    inside = (weights.min(axis=1) > 0.0)[:, None, None]
    return np.asarray(np.eye(3) - inside * np.einsum("ki,kj->kij", tangent, tangent))


def identities(count: int) -> Field:
    return np.broadcast_to(np.eye(3), (count, 3, 3))
