"""The distance barrier: the compatible constraint of a moving boundary, as a penalty with a wall.

The constraint of Gruber & Aulisa makes the displacement of a surface orthogonal to its normal, relaxed by eps.
Eliminating the multiplier leaves the penalty |<v, N>|^2 / (2 eps); measured from the closest point of the original
surface instead of the last position, it also brings nodes back that have drifted. That is the soft part here, with
eps = bound^2 / 60, so that no unit of length matters. The steep part begins near the bound, becomes
infinite before it, and holds both directions of the Hausdorff distance, sample by sample: of the moved surface to
the original, and of the original to the moved one. Feature curves and corners have a barrier of their own, at a fifth
of the bound. Equation (14) of docs/mathematics.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..energy import BlockMatrix
from .barrier_directions import distance_projectors, identities, normal_projectors
from .bilinear_surface import BilinearSurface, bilinear_weights, needed_parts
from .closest_point import ClosestPoints, CurveLocator, SurfaceLocator
from .features import Features
from .hausdorff import dense_samples, hausdorff, surface_samples
from .sample_sums import add_samples

__all__ = ["DistanceBarrier"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

# The terms of equation (14), in distances t = r / bound.
_ATTRACTION = 30.0  # factor of t^2, at nodes: without it thin bodies inflate
_STEEPNESS = 200.0  # k / (t1 - t0)
_ONSET = 0.8  # t0
_WALL = 0.98  # t1, never crossed from inside
_WITHIN = 0.995  # share of the bound that leaves room for rounding
_TOLERANCE = 0.02  # of measured distances, in bounds
_WATCHED = 0.9  # bounds from which on places are watched
_SPACING, _LEAST_SPACING = 2.0, 0.125  # bounds between samples of quads looked at closely: at first, at last
_REACH = 0.25  # longest edges of a quad between a place on it and the sample next to it
_ROOM = 2.0  # from what is outside to the wall behind it, over how far beyond t0 it is
_CURVE_BOUND = 0.2  # of feature curves and corners, as a share of the bound
_CURVE_ATTRACTION, _CURVE_ONSET = 0.1, 0.7


@dataclass
class _Samples:
    """Distances of some samples, and the parameters of their barrier."""

    nodes: Ints  # (k, j) nodes that move the sample
    weights: Field  # (k, j) share of each node in the sample
    residuals: Field  # (k, 3) from where the sample belongs to where it is
    distances: Field  # (k,)
    bound: float
    attraction: Field | float  # (k,) factor of t^2
    onset: float  # t0
    directions: Callable[[], Field]  # (k, 3, 3) projection onto the directions in which the distance grows


@dataclass
class DistanceBarrier:
    """A barrier on the distance between a boundary and its original, equation (14), to add to a corner energy.

    Attributes
    ----------
    original
        Where the boundary was: its points, and the quads.
    bound
        Distance that must not be exceeded.
    features
        Curves and corners to keep; None where there are none, or they may be soft.
    steepness
        k / (t1 - t0) of equation (14); raise it where the bound is not kept.
    reference
        Surface to return to, if it is not the original one; its nodes are the backward samples, and the
        features of the original are not kept.
    """

    original: SurfaceLocator | BilinearSurface
    bound: float
    features: Features | None = None
    steepness: float = _STEEPNESS
    reference: SurfaceLocator | None = None
    _nodes: Ints | None = field(default=None, repr=False)
    _local: Ints = field(default_factory=lambda: np.empty(0, np.int64), repr=False)

    def __post_init__(self) -> None:
        points, quads = self.original.points, self.original.faces
        self._full = points.copy()
        self._sample_faces, self._sample_weights = surface_samples(quads)
        self._at_node = self._sample_weights.max(axis=1) == 1.0
        places = np.einsum("sj,sji->si", self._sample_weights, points[quads[self._sample_faces]])
        if self.reference is None:
            self._target_samples = places
            self._forward_faces, self._backward_faces = self._sample_faces.copy(), self._sample_faces.copy()
            self._forward_distances, self._backward_distances = np.zeros(len(places)), np.zeros(len(places))
        else:
            nodes = self.reference.points[np.unique(self.reference.faces)]
            there, here = self.reference.closest(places), self.original.closest(nodes)
            self._target_samples, self._forward_faces, self._backward_faces = nodes, there.faces, here.faces
            self._forward_distances, self._backward_distances = there.distances, here.distances
        self._forward_active = np.ones(len(places), dtype=bool)
        self._backward_active = np.ones(len(self._target_samples), dtype=bool)
        self._measured_at = points.copy()
        self._wall, self._spacing, self._count = _WALL, _SPACING, len(self._sample_faces)
        self._curves, self._curve_edges = self._feature_samples()

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
        """The barrier at some points (n, 3); infinite beyond the wall."""
        return float(
            sum(self._penalty(samples)[0] for samples in self._near_samples(self._all_points(points), remember=False))
        )

    def assemble(self, points: Field, gradient: Field, matrix: BlockMatrix) -> float:
        """The barrier; adds its gradient and the Gauss-Newton part of its Hessian, and looks from here next time."""
        total = 0.0
        kinds = list(self._near_samples(self._all_points(points), remember=True))
        self._wall = max(
            _wall_beyond(float(samples.distances.max(initial=0.0)) / samples.bound, samples.onset) for samples in kinds
        )
        for samples in kinds:
            value, slopes, curvatures = self._penalty(samples)
            total += value
            force = slopes[:, None] * samples.residuals
            nodes = samples.nodes if self._nodes is None else self._local[samples.nodes]
            add_samples(
                nodes, samples.weights, force, curvatures[:, None, None] * samples.directions(),
                matrix.indptr, matrix.indices, matrix.data, gradient,
            )  # fmt: skip
        return float(total)

    def restricted(self, nodes: Ints, moving: Mask, points: Field) -> DistanceBarrier:
        """The barrier of a patch whose own nodes are numbered 0..; the others stay at the points (n, 3) given."""
        quads = self.original.faces
        movable = np.asarray(moving[quads].any(axis=1))
        patch = object.__new__(DistanceBarrier)
        patch.__dict__.update(self.__dict__)
        patch._forward_active = self._forward_active & movable[self._sample_faces]
        patch._backward_active = self._backward_active & movable[self._backward_faces]
        patch._full = points.copy()
        patch._nodes = nodes
        patch._local = np.full(len(points), -1)
        patch._local[nodes] = np.arange(len(nodes))
        for direction in ("forward", "backward"):
            for name in (f"_{direction}_faces", f"_{direction}_distances"):
                setattr(patch, name, getattr(self, name).copy())
        patch._measured_at = self._measured_at.copy()
        keep = moving[self._edge_nodes].any(axis=1)
        patch._edge_nodes, patch._edge_weights = self._edge_nodes[keep], self._edge_weights[keep]
        patch._curve_edges = self._curve_edges[keep]
        patch._corners = self._corners[moving[self._corners]]
        return patch

    def relative_distance(self, points: Field) -> float:
        """Largest distance of any sample, in both directions, in units of the bound."""
        ahead, _ = self._forward(points, np.arange(len(self._sample_faces)), everywhere=True)
        back, _ = self._backward(points, np.arange(len(self._target_samples)), everywhere=True)
        worst = max(ahead.distances.max(initial=0.0), back.distances.max(initial=0.0))
        return float(worst / self.bound)

    def farthest(self, points: Field) -> float:
        """Hausdorff distance of the bilinear surface from its original, in units of the bound."""
        x, quads = self.original.points, self.original.faces
        return hausdorff(points, x, quads, _TOLERANCE * self.bound) / self.bound

    def exceeded(self, points: Field) -> bool:
        """True where any place of the bilinear surface is farther from its original than the bound, or nearly so."""
        x, quads, least = self.original.points, self.original.faces, _WITHIN * self.bound
        return hausdorff(points, x, quads, _TOLERANCE * self.bound, least) > least

    def watch(self, points: Field) -> None:
        """Take in samples of quads, and of the original, that are nearly out of the bound; and follow warped quads."""
        original, quads = self.original.points, self.original.faces
        parts = np.maximum(*(needed_parts(x, quads, _TOLERANCE * self.bound) for x in (original, points)))
        if isinstance(self.original, BilinearSurface):
            parts = np.maximum(parts, self.original.parts)
        if parts.max() > 1:
            self.original = BilinearSurface(original, quads, parts)
        # Samples half-way to the corners lay on triangles.
        faces, weights = self._sample_faces[: self._count], self._sample_weights[: self._count]
        weights = bilinear_weights(weights @ [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        places = np.einsum("sj,sji->si", weights, original[quads[faces]])
        self._sample_weights = np.concatenate([weights, self._sample_weights[self._count :]])
        self._target_samples = np.concatenate([places, self._target_samples[self._count :]])
        there = faces, weights
        x = points[quads]
        reach = _REACH * np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2).max(axis=1)
        may_be = self._beyond(_WATCHED * self.bound - reach, points, there)
        which = np.unique(np.concatenate([faces for faces, _ in may_be]))
        dense = dense_samples(original, quads, which, self._spacing * self.bound)
        # Where that is not enough they are closer together next time.
        self._spacing = max(0.5 * self._spacing, _LEAST_SPACING)
        (ahead, ahead_weights), (behind, behind_weights) = self._beyond(
            np.full(len(quads), _WATCHED * self.bound), points, dense
        )
        places = np.einsum("sj,sji->si", behind_weights, original[quads[behind]])
        for name, new in (
            ("_sample_faces", ahead), ("_sample_weights", ahead_weights), ("_at_node", np.zeros(len(ahead), bool)),
            ("_target_samples", places), ("_forward_faces", ahead), ("_backward_faces", behind),
            ("_forward_distances", np.full(len(ahead), np.inf)), ("_backward_distances", np.full(len(behind), np.inf)),
            ("_forward_active", np.ones(len(ahead), bool)), ("_backward_active", np.ones(len(behind), bool)),
        ):  # fmt: skip
            setattr(self, name, np.concatenate([getattr(self, name), new]))

    def _beyond(self, least: Field, points: Field, samples: tuple[Ints, Field]) -> list[tuple[Ints, Field]]:
        """The samples, faces and weights, that are farther away than a distance (q,): forward, backward."""
        faces, weights = samples
        moved, found = self.original.with_points(points), []
        for this, that in ((moved, self.original), (self.original, moved)):
            places = np.einsum("sj,sji->si", weights, this.points[this.faces[faces]])
            far = that.closest(places, faces).distances > least[faces]
            found.append((faces[far], weights[far]))
        return found

    # ------------------------------------------------------------------------------------- measuring
    def _all_points(self, points: Field) -> Field:
        if self._nodes is None:
            return points
        self._full[self._nodes] = points
        return self._full

    def _near_samples(self, x: Field, remember: bool) -> Iterator[_Samples]:
        """The samples that may be beyond the onset, and all nodes: forward, backward, on curves, at corners."""
        shift = x - self._measured_at
        steps = np.sqrt(np.einsum("ni,ni->n", shift, shift))[self.original.faces]
        moved = np.maximum(np.maximum(steps[:, 0], steps[:, 1]), np.maximum(steps[:, -2], steps[:, -1]))
        onset = _ONSET * self.bound
        # A distance changes no faster than the nodes move: what was far from the bound need not be looked at.
        forward_most = self._forward_distances + moved[self._sample_faces]
        backward_most = self._backward_distances + moved[self._backward_faces]
        near = np.flatnonzero(self._forward_active & (self._at_node | (forward_most >= onset)))
        behind = np.flatnonzero(self._backward_active & (backward_most >= onset))
        ahead, faces = self._forward(x, near, everywhere=remember)
        back, back_faces = self._backward(x, behind, everywhere=remember)
        if remember:
            self._forward_distances, self._backward_distances = forward_most, backward_most
            self._forward_faces[near], self._forward_distances[near] = faces, ahead.distances
            self._backward_faces[behind], self._backward_distances[behind] = back_faces, back.distances
            self._measured_at = x.copy()
        yield ahead
        yield back
        bound = _CURVE_BOUND * self.bound
        if self._curves is not None and len(self._curve_edges):
            places = np.einsum("kj,kji->ki", self._edge_weights, x[self._edge_nodes])
            there = self._curves.closest_by_walk(places, self._curve_edges)
            if remember:
                self._curve_edges = there.faces
            ends = self._curves.points[self._curves.edges[there.faces]]
            yield _Samples(
                self._edge_nodes, self._edge_weights, places - there.positions, there.distances,
                bound, _CURVE_ATTRACTION, _CURVE_ONSET, partial(normal_projectors, ends, there.weights),
            )  # fmt: skip
        if len(self._corners):
            residuals = x[self._corners] - self.original.points[self._corners]
            nodes = np.column_stack([self._corners, self._corners])
            yield _Samples(
                nodes, np.tile([1.0, 0.0], (len(nodes), 1)), residuals, np.linalg.norm(residuals, axis=1),
                bound, _CURVE_ATTRACTION, _CURVE_ONSET, partial(identities, len(nodes)),
            )  # fmt: skip

    def _forward(self, x: Field, samples: Ints, everywhere: bool) -> tuple[_Samples, Ints]:
        """From samples of the moved surface to the original, or to the reference."""
        surface = self.original if self.reference is None else self.reference
        nodes, weights = self.original.faces[self._sample_faces[samples]], self._sample_weights[samples]
        places = np.einsum("kj,kji->ki", weights, x[nodes])
        there = self._closest(surface, places, self._forward_faces[samples], everywhere)
        residuals = places - there.positions
        return _Samples(
            nodes, weights, residuals, there.distances, self.bound, _ATTRACTION * self._at_node[samples], _ONSET,
            partial(distance_projectors, residuals, there.distances, self.bound, surface, there.faces),
        ), there.faces  # fmt: skip

    def _backward(self, x: Field, samples: Ints, everywhere: bool) -> tuple[_Samples, Ints]:
        """From samples of the original surface, or nodes of the reference, to the moved one."""
        moved = self.original if len(samples) == 0 else self.original.with_points(x)
        there = self._closest(moved, self._target_samples[samples], self._backward_faces[samples], everywhere)
        residuals = there.positions - self._target_samples[samples]
        return _Samples(
            moved.faces[there.faces], there.weights, residuals, there.distances, self.bound, 0.0, _ONSET,
            partial(distance_projectors, residuals, there.distances, self.bound, moved, there.faces),
        ), there.faces  # fmt: skip

    def _closest(
        self, surface: SurfaceLocator | BilinearSurface, places: Field, start: Ints, everywhere: bool
    ) -> ClosestPoints:
        """Closest points by walking; those too far away are looked for everywhere, as a walk may end in a dead end."""
        there = surface.closest_by_walk(places, start)
        if everywhere and (far := there.distances > _WALL * self.bound).any():
            start = there.faces.copy()
            start[far] = surface.closest(places[far], start[far]).faces
            there = surface.closest_by_walk(places, start)
        return there

    def _penalty(self, samples: _Samples) -> tuple[float, Field, Field]:
        """The terms of equation (14): their sum, each one's slope over the distance, and its second derivative."""
        t = samples.distances / samples.bound
        over, gap = np.maximum(t - samples.onset, 0.0), self._wall - t
        if gap.min(initial=1.0) <= 0.0:
            return np.inf, t, t
        k, r = self.steepness * (self._wall - samples.onset), 1.0 / gap
        value = k * (over**2 * r).sum() + (samples.attraction * t**2).sum()
        slopes = k * over * r * (2.0 + over * r) / np.maximum(t, 1e-300) + 2.0 * samples.attraction
        curvatures = 2.0 * (k * (over > 0) * r * (1.0 + over * r) ** 2 + samples.attraction)
        return float(value), slopes / samples.bound**2, curvatures / samples.bound**2


def _wall_beyond(worst: float, onset: float) -> float:
    """The wall t1: in its place with all samples inside it, else behind the worst, so that it comes in with that."""
    return _WALL if worst < _WALL else worst + _ROOM * (worst - onset)
