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

from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ..energy import Assembly, BlockMatrix, Patch, Term
from ..kernel import parallel_ranges
from .barrier_schedule import BarrierSchedule, Steep
from .bilinear_surface import BilinearSurface, bilinear_weights, needed_parts
from .closest_point import CurveLocator, SurfaceLocator
from .distance_samples import Curves, Distances, Samples, moved_by, part_of_skin
from .features import Features
from .hausdorff import faces_beyond, hausdorff, peaks_between, surface_samples
from .sample_sums import add_samples

__all__ = ["DistanceBarrier"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Look = tuple[Ints, Distances, Field]  # which samples are looked at, what is found, how far all may be at most

_NO_BLOCKS = np.empty((0, 3, 3)), BlockMatrix(np.zeros(1, np.int64), np.empty(0, np.int32))


@dataclass(frozen=True, eq=False)
class DistanceBarrier(Term):
    """A barrier on the distance between a boundary and its original, equation (14): a term of an objective.

    Closest points are looked for around those that were closest when it was last renewed, and samples that were far
    from the bound then, and have not moved enough since, are not looked at.

    Attributes
    ----------
    original
        Where the boundary was: its points, and the faces.
    skin
        The surface that is kept near it, by the nodes of the points that the barrier is a function of: of the mesh, or
        of a patch, around what moves there; None where nothing does.
    beside
        (k, 3) points of nodes of the skin beyond these, which stay.
    bound
        Distance that must not be exceeded.
    steepness
        k / (t1 - t0) of equation (14); larger where the bound is not kept.
    reference
        Surface to return to, if it is not the original one; its nodes are the backward samples.
    forward, backward, curves
        Samples of the moved surface, of the original or reference, and of features.
    measured_at
        (n, 3) points at which the samples were last looked at.
    wall
        t1 of equation (14).
    spacing
        Bounds between places that are compared on a quad.
    schedule
        The numbers of equation (14).
    """

    original: SurfaceLocator | BilinearSurface
    skin: SurfaceLocator | BilinearSurface | None
    bound: float
    steepness: float
    reference: SurfaceLocator | None
    forward: Samples
    backward: Samples
    curves: Curves
    measured_at: Field
    wall: float
    spacing: float
    schedule: BarrierSchedule
    beside: Field = field(default_factory=lambda: np.empty((0, 3)))

    @classmethod
    def around(
        cls,
        original: SurfaceLocator,
        bound: float,
        features: Features | None = None,
        reference: SurfaceLocator | None = None,
        schedule: BarrierSchedule | None = None,
        there: CurveLocator | None = None,
        depths: Field | None = None,
    ) -> DistanceBarrier:
        """The barrier of a boundary that is still where it was.

        Parameters
        ----------
        original, bound, reference
            See the attributes.
        features
            Curves and corners to keep; None where there are none, or they may be soft.
        schedule
            The numbers of equation (14).
        there
            Curves that those of the features belong to, by their numbers, if these are not the curves themselves; with
            another surface no features are kept without.
        depths
            (f,) thickness of what lies behind each face: where it is less than the bound, the surface is drawn back the
            more strongly, so that thin walls do not swell.

        Examples
        --------
        >>> from hexconformal.generate import box
        >>> from hexconformal.mesh import boundary_quads
        >>> points, cells = box((2, 2, 2))
        >>> barrier = DistanceBarrier.around(SurfaceLocator(points, boundary_quads(cells)[0]), 0.1)
        >>> barrier.value(points), round(barrier.relative_distance(1.02 * points), 4)
        (0.0, 0.3464)
        """
        points, quads = original.points, original.faces
        faces, weights = surface_samples(original.nodes_of_sheets)
        places, zeros = np.einsum("sj,sji->si", weights, points[quads[faces]]), np.zeros(len(faces))
        schedule = BarrierSchedule() if schedule is None else schedule
        attraction = np.ones(len(faces)) if depths is None else schedule.attraction_of(depths / bound)[faces]
        if reference is None:
            forward = Samples.forward(faces, weights, faces, zeros, attraction)
            backward = Samples.backward(places, faces, zeros)
            curves = Curves.of(points, features)
        else:
            _, first = np.unique(reference.nodes_of_sheets, return_index=True)
            nodes, of = reference.points[reference.faces.ravel()[first]], first // reference.faces.shape[1]
            ahead = reference.closest(places, reference.any_of_sheet(original, faces))
            here = original.closest(nodes, original.any_of_sheet(reference, of))
            forward = Samples.forward(faces, weights, ahead.faces, ahead.distances, attraction)
            backward = Samples.backward(nodes, here.faces, here.distances)
            curves = Curves.of(points, None if there is None else features, there)
        return cls(
            original, original, bound, schedule.steepness, reference, forward, backward, curves, points, schedule.wall,
            schedule.spacing, schedule,
        )  # fmt: skip

    @property
    def nodes(self) -> Ints:
        """Nodes that are kept near where they were."""
        nodes = np.empty(0, np.int64) if self.skin is None else np.unique(self.skin.faces)
        return nodes[nodes < len(self.measured_at) - len(self.beside)]

    # ------------------------------------------------------------------------------------------ the term
    def value(self, points: Field) -> float:
        """The barrier at some points (n, 3); infinite beyond the wall."""
        steep, *_ = self._looked(points, everywhere=False)
        return float(sum(kind.penalty(self.steepness, self.wall)[0] for kind in steep))

    def value_gradient(self, points: Field) -> tuple[float, Field]:
        """The barrier, and its gradient (n, 3)."""
        steep, *_ = self._looked(points, everywhere=False)
        gradient = np.zeros_like(points)
        return self._add(steep, gradient, None), gradient

    def add_convex(self, points: Field, gradient: Field, assembly: Assembly) -> tuple[float, Term]:
        """Add gradient and Gauss-Newton part of the Hessian; returns the barrier as it is seen from here, too."""
        steep, seen = self._seen(points)
        return seen._add(steep, gradient, assembly), seen

    def renewed(self, points: Field) -> DistanceBarrier:
        """The barrier with all samples looked at from these points, and the wall behind them."""
        return self._seen(points)[1]

    def restricted(self, patch: Patch) -> DistanceBarrier:
        """The barrier of a patch: of what moves there, with what is beside that."""
        none = replace(self, skin=None, beside=self.beside[:0], measured_at=self.measured_at[patch.nodes])
        part = None if self.skin is None else part_of_skin(self.skin, patch, self._with_beside(patch.points))
        if part is None:
            return none
        return replace(
            none,
            skin=part.skin,
            beside=part.skin.points[len(patch.nodes) :],
            measured_at=self.measured_at[part.nodes],
            forward=self.forward.among(part.movable, part.numbers),
            backward=self.backward.among(part.movable, part.numbers),
            curves=self.curves.restricted(patch),
        )

    def with_slack(self, nodes: Mask) -> tuple[DistanceBarrier, int]:
        """The barrier with curves and corners at some nodes (n,) as free as the surface; how many curves are so now."""
        curves, count = self.curves.with_slack(nodes)
        return replace(self, curves=curves), count

    def loosened(self, share: float) -> DistanceBarrier:
        """The barrier with a share of the attraction; the wall stays where it is."""
        return replace(self, schedule=replace(self.schedule, attraction=share * self.schedule.attraction))

    # ---------------------------------------------------------------------------------------- the distance
    def relative_distance(self, points: Field) -> float:
        """Largest distance of any sample, in both directions, in units of the bound."""
        if self.skin is None:
            return 0.0
        moved, other = self._surfaces(self.skin, self._with_beside(points))
        worst = 0.0
        for samples in (self.forward, self.backward):
            found = samples.measured(np.arange(len(samples)), moved, other, self.schedule.wall * self.bound)
            worst = max(worst, float(found.distances.max(initial=0.0)))
        return worst / self.bound

    def farthest(self, points: Field) -> float:
        """Hausdorff distance of the bilinear surface from its original, in units of the bound."""
        return self._hausdorff(points) / self.bound

    def exceeded(self, points: Field) -> bool:
        """True where any place of the bilinear surface is farther from its original than the bound, or nearly so."""
        least = self.schedule.within * self.bound
        return self._hausdorff(points, least) > least

    def nodes_beyond(self, points: Field) -> Mask:
        """(n,) nodes of the faces for which the bound is exceeded, or nearly so."""
        x, quads, sheets = self.original.points, self.original.faces, self.original.sheets
        near, nodes = np.arange(len(quads)), np.zeros(len(points), dtype=bool)
        one, other = (SurfaceLocator(y, quads, sheets) for y in (points, x))
        bound, tolerance = self.schedule.within * self.bound, self.schedule.measuring * self.bound
        nodes[quads[faces_beyond(one, other, bound, (near, near), tolerance)]] = True
        return nodes

    def _hausdorff(self, points: Field, least: float = 0.0) -> float:
        at, measuring = self.original, self.schedule.measuring
        return hausdorff(points, at.points, at.faces, measuring * self.bound, least, measuring, at.sheets)

    def watching(self, points: Field) -> DistanceBarrier:
        """The barrier with samples where quads, or the original, are nearly out of the bound; warped ones followed."""
        x, quads = self.original.points, self.original.faces
        parts = np.maximum(*(needed_parts(y, quads, self.schedule.tolerance * self.bound) for y in (x, points)))
        original = self.original
        if isinstance(original, BilinearSurface):
            parts = np.maximum(parts, original.parts)
        if parts.max() > 1:
            original = BilinearSurface(x, quads, parts, original.sheets)
        # Samples half-way to the corners lay on triangles.
        faces, weights = surface_samples(self.original.nodes_of_sheets)
        weights = bilinear_weights(weights @ [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        places, count = np.einsum("sj,sji->si", weights, x[quads[faces]]), len(faces)
        forward = replace(self.forward, weights=np.concatenate([weights, self.forward.weights[count:]]))
        backward = replace(self.backward, places=np.concatenate([places, self.backward.places[count:]]))
        moved = original.with_points(points)
        least = self.schedule.watched * self.bound
        looked = faces, weights, self.spacing * self.bound, least, self.schedule.reach
        (ahead, ahead_weights), (behind, behind_weights) = peaks_between(moved, original, *looked)
        places = np.einsum("sj,sji->si", behind_weights, x[quads[behind]])
        return replace(
            self,
            original=original,
            skin=original,
            forward=forward.joined(Samples.forward(ahead, ahead_weights, ahead, np.full(len(ahead), np.inf))),
            backward=backward.joined(Samples.backward(places, behind, np.full(len(behind), np.inf))),
            # Where that is not enough places closer together are compared next time.
            spacing=max(0.5 * self.spacing, self.schedule.least_spacing),
        )

    # ------------------------------------------------------------------------------------------ measuring
    def _surfaces(
        self, skin: SurfaceLocator | BilinearSurface, x: Field
    ) -> tuple[SurfaceLocator | BilinearSurface, SurfaceLocator | BilinearSurface]:
        """The moved surface, and the one it should be near to."""
        return skin.with_points(x), self.original if self.reference is None else self.reference

    def _with_beside(self, points: Field) -> Field:
        return np.concatenate([points, self.beside]) if len(self.beside) else points

    def _seen(self, points: Field) -> tuple[list[Steep], DistanceBarrier]:
        """The distances from points (n, 3), and the barrier as it is seen from there."""
        if self.skin is None:
            return [], self
        steep, looks, curves = self._looked(points, everywhere=True)
        forward, backward = (
            samples.seen(*look) for samples, look in zip((self.forward, self.backward), looks, strict=True)
        )
        wall = max((kind.wall_beyond(self.schedule) for kind in steep), default=self.schedule.wall)
        x = self._with_beside(points)
        return steep, replace(self, measured_at=x, wall=wall, forward=forward, backward=backward, curves=curves)

    def _looked(self, points: Field, everywhere: bool) -> tuple[list[Steep], list[Look], Curves]:
        """Distances of samples that may be beyond the onset, or are drawn back; what that tells of them."""
        if self.skin is None:
            return [], [], self.curves
        x, far = self._with_beside(points), self.schedule.wall * self.bound
        steep, looks, walked = [], [], self._walked(self.skin, points)
        for samples, (which, found, most) in zip((self.forward, self.backward), walked, strict=True):
            if everywhere and (found.distances > far).any():
                found = samples.measured(which, *self._surfaces(self.skin, x), far)
            steep.append(self._steep(found, self.schedule.attraction * samples.attraction[which]))
            looks.append((which, found, most))
        of_curves, curves = self.curves.measured(x, self.bound, self.schedule)
        return [*steep, *of_curves], looks, curves

    def _walked(self, skin: SurfaceLocator | BilinearSurface, points: Field) -> list[Look]:
        """What a walk finds, forward and backward; kept, as a step is taken to where the line search has looked."""
        if (last := self._last) and np.array_equal(last[0][0], points):
            return last[0][1]
        x, onset = self._with_beside(points), self.schedule.onset * self.bound
        moved, surfaces = moved_by(x - self.measured_at, skin.faces), self._surfaces(skin, x)
        looks = []
        for samples in (self.forward, self.backward):
            # A distance changes no faster than the nodes move: what was far from the bound need not be looked at.
            most = samples.most(moved)
            which = np.flatnonzero((samples.attraction > 0.0) | (most >= onset))
            looks.append((which, samples.measured(which, *surfaces), most))
        last[:] = [(points.copy(), looks)]
        return looks

    @cached_property
    def _last(self) -> list[tuple[Field, list[Look]]]:
        return []

    def _steep(self, found: Distances, attraction: Field) -> Steep:
        growing = partial(found.directions, self.bound)
        t, onset = found.distances / self.bound, self.schedule.onset
        return Steep(found.nodes, found.weights, found.residuals, t, self.bound, attraction, onset, growing)

    def _add(self, steep: list[Steep], gradient: Field, assembly: Assembly | None) -> float:
        """Add gradients, and curvatures where there is an assembly; returns the sum."""
        total = 0.0
        for kind in steep:
            value, slopes, curvatures = kind.penalty(self.steepness, self.wall)
            total += value
            directions, matrix = _NO_BLOCKS if assembly is None else (kind.directions(), assembly.matrix)
            penalties = slopes, kind.residuals, curvatures, directions
            blocks = matrix.indptr, matrix.indices, matrix.data
            parallel_ranges(add_samples, len(gradient), kind.nodes, kind.weights, *penalties, *blocks, gradient)
        return float(total)
