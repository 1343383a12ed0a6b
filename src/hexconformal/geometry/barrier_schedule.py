"""The numbers of the distance barrier, and what it makes of distances: equation (14)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..common import Schedule, tuned

__all__ = ["BarrierSchedule", "Steep"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class BarrierSchedule(Schedule):
    """The terms of equation (14), in distances t = r / bound.

    Attributes
    ----------
    attraction
        Factor of t^2, at all samples of the moved surface: without it thin bodies inflate; at nodes alone the surface
        drifts between them, and edges that no one has detected go.
    thin, most
        Share of the thickness of what lies behind that the surface may as well move as far as the bound, and the
        largest factor of the attraction where that is less.
    steepness
        k / (t1 - t0).
    onset, wall
        t0, and t1, which is never crossed from inside.
    room
        From what is outside to the wall behind it, over how far beyond t0 it is.
    curve_bound
        Of feature curves and corners, as a share of the bound: they are what one sees.
    curve_attraction, curve_onset
        As of the surface.
    within, measuring
        Share of the bound that the whole surface is kept in, and how far below the distance the one measured then may
        be, in bounds: the former leaves room for the latter twice.
    tolerance
        How near warped quads are followed where samples are taken, in bounds.
    watched
        Bounds from which on places between the samples are watched.
    spacing, least_spacing
        Bounds between places that are compared on a quad: at first, at last.
    reach
        Longest edges of a quad between a place on it and the sample next to it.
    flat
        Distance from its plane, in bounds, up to which a patch is flat, and kept in the plane without a barrier.
    copied_rings
        Rings of faces of others that a rank has copies of: a sample goes no farther in a step.
    """

    attraction: float = tuned(30.0)
    thin: float = tuned(1.5)
    most: float = tuned(100.0, 1.0)
    steepness: float = tuned(200.0)
    onset: float = tuned(0.8, 0.0, 1.0)
    wall: float = tuned(0.98, 0.0, 1.0)
    room: float = tuned(2.0)
    curve_bound: float = tuned(0.2, 0.0, 1.0)
    curve_attraction: float = tuned(0.1)
    curve_onset: float = tuned(0.7, 0.0, 1.0)
    within: float = tuned(0.99, 0.0, 1.0)
    measuring: float = tuned(5e-3, 0.0, 1.0)
    tolerance: float = tuned(0.02, 0.0, 1.0)
    watched: float = tuned(0.9, 0.0, 1.0)
    spacing: float = tuned(2.0)
    least_spacing: float = tuned(0.125)
    reach: float = tuned(0.25)
    flat: float = tuned(1e-3, 0.0, 1.0)
    copied_rings: int = tuned(4)

    def attraction_of(self, depths: Field) -> Field:
        """Factors of the attraction where there are so many bounds (k,) of thickness behind the surface."""
        return np.clip(1.0 / np.maximum(self.thin * depths, 1e-300) ** 2, 1.0, self.most)

    def steep_of_curves(
        self, nodes: Ints, weights: Field, residuals: Field, distances: Field, bound: float,
        slack: NDArray[np.bool_], directions: Callable[[], Field],
    ) -> Steep:  # fmt: skip
        """What the barrier makes of distances (k,) of curves and corners, of which slack ones may go farther."""
        bounds = np.where(slack, 1.0, self.curve_bound) * bound
        others = bounds, self.curve_attraction, self.curve_onset, directions
        return Steep(nodes, weights, residuals, distances / bounds, *others)


@dataclass(frozen=True, eq=False)
class Steep:
    """What the barrier makes of some distances."""

    nodes: Ints
    weights: Field
    residuals: Field
    t: Field  # distances in bounds
    bound: Field | float  # (k,) in units of length
    attraction: Field | float  # (k,) factor of t^2
    onset: float  # t0
    directions: Callable[[], Field]  # (k, 3, 3) projection onto the directions in which the distance grows

    def penalty(self, steepness: float, wall: float) -> tuple[float, Field, Field]:
        """The terms of equation (14): their sum, each one's slope over the distance, and its second derivative."""
        t = self.t
        over, gap = np.maximum(t - self.onset, 0.0), wall - t
        if gap.min(initial=1.0) <= 0.0:
            return np.inf, t, t
        k, r = steepness * (wall - self.onset), 1.0 / gap
        value = k * (over**2 * r).sum() + (self.attraction * t**2).sum()
        slopes = k * over * r * (2.0 + over * r) / np.maximum(t, 1e-300) + 2.0 * self.attraction
        curvatures = 2.0 * (k * (over > 0) * r * (1.0 + over * r) ** 2 + self.attraction)
        return float(value), slopes / self.bound**2, curvatures / self.bound**2

    def wall_beyond(self, schedule: BarrierSchedule) -> float:
        """The wall t1: in its place with all samples inside it, else behind the worst, with which it comes in."""
        worst = float(self.t.max(initial=0.0))
        return schedule.wall if worst < schedule.wall else worst + schedule.room * (worst - self.onset)
