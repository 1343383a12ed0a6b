"""Keep a moving boundary near where it was: the compatible constraint, as a penalty with a hard limit.

The note's constraint makes the displacement of a surface orthogonal to its normal, relaxed by eps. Eliminating
the multiplier leaves the penalty |<v, N>|^2 / (2 eps); measured from the closest point of the original surface
instead of the last position, it also brings nodes back that have drifted. That is the soft part here, with
eps = bound^2 / (2 ATTRACTION), so that no unit of length matters. The steep part begins near the bound, becomes
infinite before it, and holds both directions of the Hausdorff distance, sample by sample: of the moved surface to
the original, and of the original to the moved one. Feature curves and corners have a narrower band of their own.
Equation (14) of docs/mathematics.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..energy import BlockMatrix
from ..kernel import loop
from ..mesh import binary_search
from .closest_point import ClosestPoints, CurveLocator, SurfaceLocator
from .features import Features
from .hausdorff import surface_samples

__all__ = ["DistanceBarrier"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_ATTRACTION = 30.0  # soft weight of nodes, per squared distance in bounds: without it thin bodies inflate
_STEEP = 200.0  # weight beyond the onset
_ONSET = 0.8  # share of the bound where the steep part begins
_LIMIT = 0.98  # share of the bound that is never crossed from inside
_BEYOND = 2.0  # where something is outside: room behind it, over how far beyond the onset it is
_NARROW = 0.2  # width of the band of feature curves and corners, as a share of the bound
_CURVE_ATTRACTION, _CURVE_ONSET = 0.1, 0.7


@dataclass
class _Rows:
    """Distances of samples that are attached to nodes: what they pull at, and how steeply."""

    nodes: Ints  # (k, j)
    weights: Field  # (k, j) share of each node in the sample
    residuals: Field  # (k, 3) from where the sample belongs to where it is
    distances: Field  # (k,)
    width: float  # of the band
    attraction: Field | float  # (k,) weight of the soft part
    onset: float  # share of the width where the steep part begins
    directions: Callable[[], Field]  # (k, 3, 3) projection onto the directions in which the distance grows


@dataclass
class DistanceBarrier:
    """A penalty on the distance between a boundary and its original, in the interface of a CornerEnergy's surface.

    Attributes
    ----------
    original
        Where the boundary was: its points, and the quads.
    bound
        Distance that must not be exceeded.
    features
        Curves and corners to keep; None where there are none, or they may be soft.
    steepness
        Weight of the steep part; raise it where the bound is not kept.
    reference
        Surface to return to, if it is not the original one; its nodes are the samples of the way back, and the
        features of the original are not kept.
    """

    original: SurfaceLocator
    bound: float
    features: Features | None = None
    steepness: float = _STEEP
    reference: SurfaceLocator | None = None
    _nodes: Ints | None = field(default=None, repr=False)
    _local: Ints = field(default_factory=lambda: np.empty(0, np.int64), repr=False)

    def __post_init__(self) -> None:
        points, quads = self.original.points, self.original.faces
        self._full = points.copy()
        self._of, self._weights = surface_samples(quads)
        self._is_node = self._weights.max(axis=1) == 1.0
        places = np.einsum("sj,sji->si", self._weights, points[quads[self._of]])
        if self.reference is None:
            self._places, self._onto, self._back = places, self._of.copy(), self._of.copy()
            self._ahead_distance, self._back_distance = np.zeros(len(places)), np.zeros(len(places))
        else:
            nodes = self.reference.points[np.unique(self.reference.faces)]
            there, here = self.reference.closest(places), self.original.closest(nodes)
            self._places, self._onto, self._back = nodes, there.faces, here.faces
            self._ahead_distance, self._back_distance = there.distances, here.distances
        self._ahead_take, self._back_take = np.ones(len(places), dtype=bool), np.ones(len(self._places), dtype=bool)
        self._since = points.copy()
        self._limit = _LIMIT
        self._curves, self._along = self._feature_samples()

    def _feature_samples(self) -> tuple[CurveLocator | None, Ints]:
        """The original curves; the samples on them are the nodes and midpoints of their edges."""
        points, features = self.original.points, self.features
        if features is None or features.soft or self.reference is not None:
            self._edge_nodes, self._edge_weights = np.empty((0, 2), np.int64), np.empty((0, 2))
            self._corners = np.empty(0, np.int64)
            return None, np.empty(0, np.int64)
        self._corners = features.corners
        edges = features.edges
        # Each node once per curve; corners are held by themselves.
        keys = edges * (int(features.curves.max(initial=0)) + 1) + features.curves[:, None]
        first = np.unique(keys, return_index=True)[1]
        first = first[~np.isin(edges.ravel()[first], features.corners)]
        ends = edges.ravel()[first]
        self._edge_nodes = np.vstack([np.column_stack([ends, ends]), edges])
        self._edge_weights = np.vstack([np.tile([1.0, 0.0], (len(ends), 1)), np.full((len(edges), 2), 0.5)])
        if len(edges) == 0:
            return None, np.empty(0, np.int64)
        return CurveLocator(points, edges, features.curves), np.concatenate([first // 2, np.arange(len(edges))])

    # ------------------------------------------------------------------------------------ interface
    def value(self, points: Field) -> float:
        """Penalty at the points; infinite beyond the limit."""
        return float(sum(self._penalty(rows)[0] for rows in self._measured(self._all(points), refresh=False)))

    def add(self, points: Field, forces: Field, matrix: BlockMatrix) -> float:
        """Penalty; adds its gradient and the Gauss-Newton part of its Hessian, and remembers where things are."""
        total = 0.0
        kinds = list(self._measured(self._all(points), refresh=True))
        self._limit = max(_limit(float(rows.distances.max(initial=0.0)) / rows.width, rows.onset) for rows in kinds)
        for rows in kinds:
            value, slopes, curvatures = self._penalty(rows)
            total += value
            pull = slopes[:, None] * rows.residuals
            nodes = rows.nodes if self._nodes is None else self._local[rows.nodes]
            _add_rows(
                nodes, rows.weights, pull, curvatures[:, None, None] * rows.directions(),
                matrix.indptr, matrix.indices, matrix.data, forces,
            )  # fmt: skip
        return float(total)

    def restricted(self, nodes: Ints, moving: Mask, points: Field) -> DistanceBarrier:
        """The band of a patch whose own nodes are numbered 0..; the others stay at the points (n, 3) given."""
        quads = self.original.faces
        movable = np.asarray(moving[quads].any(axis=1))
        patch = object.__new__(DistanceBarrier)
        patch.__dict__.update(self.__dict__)
        patch._ahead_take = self._ahead_take & movable[self._of]
        patch._back_take = self._back_take & movable[self._back]
        patch._full = points.copy()
        patch._nodes = nodes
        patch._local = np.full(len(points), -1)
        patch._local[nodes] = np.arange(len(nodes))
        for name in ("_onto", "_back", "_ahead_distance", "_back_distance", "_since", "_along"):
            setattr(patch, name, getattr(self, name).copy())
        keep = moving[self._edge_nodes].any(axis=1)
        patch._edge_nodes, patch._edge_weights = self._edge_nodes[keep], self._edge_weights[keep]
        patch._along = self._along[keep]
        patch._corners = self._corners[moving[self._corners]]
        return patch

    def excess(self, points: Field) -> float:
        """Largest distance of any sample, in both directions, in units of the bound."""
        ahead, _ = self._ahead(points, np.arange(len(self._of)), everywhere=True)
        back, _ = self._backward(points, np.arange(len(self._places)), everywhere=True)
        worst = max(ahead.distances.max(initial=0.0), back.distances.max(initial=0.0))
        return float(worst / self.bound)

    # ------------------------------------------------------------------------------------- measuring
    def _all(self, points: Field) -> Field:
        if self._nodes is None:
            return points
        self._full[self._nodes] = points
        return self._full

    def _measured(self, x: Field, refresh: bool) -> Iterator[_Rows]:
        """Rows of every kind that may matter."""
        shift = x - self._since
        steps = np.sqrt(np.einsum("ni,ni->n", shift, shift))[self.original.faces]
        moved = np.maximum(np.maximum(steps[:, 0], steps[:, 1]), np.maximum(steps[:, -2], steps[:, -1]))
        onset = _ONSET * self.bound
        # A distance changes no faster than the nodes move: what was far from the bound need not be looked at.
        ahead_bound = self._ahead_distance + moved[self._of]
        back_bound = self._back_distance + moved[self._back]
        near = np.flatnonzero(self._ahead_take & (self._is_node | (ahead_bound >= onset)))
        behind = np.flatnonzero(self._back_take & (back_bound >= onset))
        ahead, faces = self._ahead(x, near, everywhere=refresh)
        back, back_faces = self._backward(x, behind, everywhere=refresh)
        if refresh:
            self._ahead_distance, self._back_distance = ahead_bound, back_bound
            self._onto[near], self._ahead_distance[near] = faces, ahead.distances
            self._back[behind], self._back_distance[behind] = back_faces, back.distances
            self._since = x.copy()
        yield ahead
        yield back
        width = _NARROW * self.bound
        if self._curves is not None and len(self._along):
            places = np.einsum("kj,kji->ki", self._edge_weights, x[self._edge_nodes])
            there = self._curves.walked(places, self._along)
            if refresh:
                self._along = there.faces
            ends = self._curves.points[self._curves.edges[there.faces]]
            yield _Rows(
                self._edge_nodes, self._edge_weights, places - there.positions, there.distances,
                width, _CURVE_ATTRACTION, _CURVE_ONSET, partial(_across, ends, there.weights),
            )  # fmt: skip
        if len(self._corners):
            residuals = x[self._corners] - self.original.points[self._corners]
            nodes = np.column_stack([self._corners, self._corners])
            yield _Rows(
                nodes, np.tile([1.0, 0.0], (len(nodes), 1)), residuals, np.linalg.norm(residuals, axis=1),
                width, _CURVE_ATTRACTION, _CURVE_ONSET, partial(_everywhere, len(nodes)),
            )  # fmt: skip

    def _ahead(self, x: Field, samples: Ints, everywhere: bool) -> tuple[_Rows, Ints]:
        """From samples of the moved surface to the original, or to the reference."""
        surface = self.original if self.reference is None else self.reference
        nodes, weights = self.original.faces[self._of[samples]], self._weights[samples]
        places = np.einsum("kj,kji->ki", weights, x[nodes])
        there = self._closest(surface, places, self._onto[samples], everywhere)
        residuals = places - there.positions
        return _Rows(
            nodes, weights, residuals, there.distances, self.bound, _ATTRACTION * self._is_node[samples], _ONSET,
            partial(_directions, residuals, there.distances, self.bound, surface, there.faces),
        ), there.faces  # fmt: skip

    def _backward(self, x: Field, samples: Ints, everywhere: bool) -> tuple[_Rows, Ints]:
        """From samples of the original surface to the moved one."""
        moved = self.original if len(samples) == 0 else self.original.moved(x)
        there = self._closest(moved, self._places[samples], self._back[samples], everywhere)
        residuals = there.positions - self._places[samples]
        return _Rows(
            moved.faces[there.faces], there.weights, residuals, there.distances, self.bound, 0.0, _ONSET,
            partial(_directions, residuals, there.distances, self.bound, moved, there.faces),
        ), there.faces  # fmt: skip

    def _closest(self, surface: SurfaceLocator, places: Field, start: Ints, everywhere: bool) -> ClosestPoints:
        """Closest points by walking; those too far away are looked for everywhere: a walk may end in a dead end."""
        there = surface.walked(places, start)
        if everywhere and (far := there.distances > _LIMIT * self.bound).any():
            start = there.faces.copy()
            start[far] = surface.closest(places[far], start[far]).faces
            there = surface.walked(places, start)
        return there

    def _penalty(self, rows: _Rows) -> tuple[float, Field, Field]:
        """Summed penalty, of each distance its slope over the distance, and its second derivative."""
        t = rows.distances / rows.width
        over, room = np.maximum(t - rows.onset, 0.0), self._limit - t
        if room.min(initial=1.0) <= 0.0:
            return np.inf, t, t
        k, r = self.steepness * (self._limit - rows.onset), 1.0 / room
        value = k * (over**2 * r).sum() + (rows.attraction * t**2).sum()
        slopes = k * over * r * (2.0 + over * r) / np.maximum(t, 1e-300) + 2.0 * rows.attraction
        curvatures = 2.0 * (k * (over > 0) * r * (1.0 + over * r) ** 2 + rows.attraction)
        return float(value), slopes / rows.width**2, curvatures / rows.width**2


def _limit(worst: float, onset: float) -> float:
    """Where the wall is: at its place with everything inside, else behind the worst, so that it comes in with it."""
    return _LIMIT if worst < _LIMIT else worst + _BEYOND * (worst - onset)


def _directions(residuals: Field, distances: Field, bound: float, surface: SurfaceLocator, faces: Ints) -> Field:
    """n n^T of the direction in which the distance grows; the normal of the face where there is no distance."""
    x = surface.points[surface.faces[faces]]
    normals = np.cross(x[:, 2] - x[:, 0], x[:, -1] - x[:, 1])
    far = distances > 1e-9 * bound
    normals[far] = residuals[far]
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    return np.einsum("ki,kj->kij", normals, normals)


def _across(ends: Field, weights: Field) -> Field:
    """1 - t t^T of straight edges (k, 2, 3); 1 where the closest point is one of the ends."""
    tangent = ends[:, 1] - ends[:, 0]
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1), 1e-300)[:, None]
    inside = (weights.min(axis=1) > 0.0)[:, None, None]
    return np.asarray(np.eye(3) - inside * np.einsum("ki,kj->kij", tangent, tangent))


def _everywhere(count: int) -> Field:
    return np.broadcast_to(np.eye(3), (count, 3, 3))


@loop
def _add_rows(nodes, weights, pull, curvature, indptr, indices, data, forces):  # type: ignore[no-untyped-def]
    """Add the forces and curvatures of samples to their nodes; nodes below zero take no part."""
    for k in range(len(nodes)):
        for i in range(nodes.shape[1]):
            a, w = nodes[k, i], weights[k, i]
            if a < 0 or w == 0.0:
                continue
            for r in range(3):
                forces[a, r] += w * pull[k, r]
            for j in range(nodes.shape[1]):
                b, share = nodes[k, j], w * weights[k, j]
                # The matrix holds its lower triangle, without the rows and columns of held nodes.
                if b < 0 or b > a or share == 0.0:
                    continue
                place = binary_search(indices, indptr[a], indptr[a + 1], b)
                if place >= indptr[a + 1] or indices[place] != b:
                    continue
                for r in range(3):
                    for c in range(3):
                        data[place, r, c] += share * curvature[k, r, c]
