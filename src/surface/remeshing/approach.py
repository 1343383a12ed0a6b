"""Bring a surface nearer to the input at the end of a run, by nodes that are free in all directions.

On the input lie the nodes, not the cells between them, which cut across what is curved. So the distance of all places
becomes a term of the energy, as stiff as what it may cost of the angles allows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from hexconformal.geometry import CURVE, SMOOTH

from ..constraint import ConstrainedSystem, Nearness, SmoothProjection, held_projectors
from ..energy import Barrier
from ..mesh import Floats, Ints
from .acceptance import AngleLimits
from .descent import Iterate
from .problem import RemeshingProblem
from .schedules import Schedules

__all__ = ["approach"]

_TINY = 1e-6  # degrees, or mean edges


@dataclass(frozen=True)
class _Step:
    """Points, the facets of the input below the nodes, the relative decrease of the energy, and how many were held."""

    points: Floats
    facets: Ints
    decrease: float
    held: int


class _Approach:
    """A surface on its way, with what its steps learn: which cells are emphasized, which nodes are damped.

    Parameters
    ----------
    problem, points, limits, schedules
        See :func:`approach`.
    projection
        The problem's.
    bound
        Its bound.
    """

    def __init__(
        self,
        problem: RemeshingProblem,
        points: Floats,
        limits: AngleLimits,
        schedules: Schedules,
        projection: SmoothProjection,
        bound: float,
    ) -> None:
        self.points, self._limits, self._projection, self._bound = points, limits, projection, bound
        self._margin = schedules.problem.bound_margin
        self._schedule, self._step = schedules.approach, schedules.step
        self._problem, energy = copy(problem), copy(problem.energy)
        if isinstance(energy, Barrier):
            # Angles are those of the cells themselves, however these are tilted.
            energy.cap, energy.continuation, energy.normals = schedules.continuation.final_cap, 1.0, None
        self._problem.energy, self._frames = energy, energy.frames
        self._emphasis, self._damping = np.ones(len(problem.cells)), np.full(len(points), self._step.min_damping)
        self.near = Nearness(problem.start, problem.cells, points, self._schedule.stiffness, self._schedule.knee)

    def step(self) -> _Step | None:
        """A step that lowers the sum of both energies and violates nothing, or None."""
        problem, energy, x = self._problem, self._problem.energy, self.points
        # Nothing goes farther away than what is farthest now.
        farthest = max(problem.input_surface.largest_distance, self._schedule.bound_share * self._bound)
        problem.bound = min(problem.bound or self._bound, self._margin * farthest)
        energy.frames = replace(self._frames, weights=self._frames.weights * self._emphasis[self._frames.owners])
        if isinstance(energy, Barrier):
            energy.adapt(x)
        pull, stiffness = self.near.derivatives(x)
        gradient = energy.gradient(x) + pull
        held = held_projectors(self._projection.foot_points(x)[1], x, problem.features)
        held[problem.features.kind == SMOOTH] = 0.0

        def direction(damping: Floats) -> Floats:
            problem.set_damping(np.minimum(damping, self._step.max_damping))
            hessian = (energy.hessian(x) + stiffness).tobsr((3, 3))
            system = ConstrainedSystem(hessian, held, None, problem.moving)
            return system.solve_iteratively(-gradient, problem.solver_tolerance, damping <= self._step.max_damping)

        return self._search(direction)

    def _search(self, direction: Callable[[Floats], Floats]) -> _Step | None:
        """Damp the nodes of cells that violate something, and hold them at last, or else shorten the step."""
        problem, energy, x = self._problem, self._problem.energy, self.points
        smooth, on_curve = (problem.features.kind == kind for kind in (SMOOTH, CURVE))
        before, angles = energy.densities(x), self._limits.angles(x)
        value = float(before.sum()) + self.near.value(x)
        damping, length = self._damping.copy(), 1.0
        way = direction(damping)
        for tries in range(self._step.max_tries):
            held = damping > self._step.max_damping
            y = x + length * way
            onto, facets, _ = self._projection.project(y)
            y[on_curve] = onto[on_curve]
            y = problem.restored(y, smooth & ~held)
            after, now = energy.densities(y), self._limits.angles(y)
            thin = (now < self._limits.least) & (now < angles)
            if tries == 0:
                growth = np.where(thin, self._schedule.emphasis, self._schedule.emphasis**-0.5)
                self._emphasis = np.clip(growth * self._emphasis, 1.0, self._schedule.max_emphasis)
            violating = problem.violating_nodes(y, before, after, held)
            violating[problem.cells.corners_of(thin)] = True
            new = float(after.sum()) + self.near.value(y)
            area_kept = abs(problem.area_excess(y)) <= self._step.area_rounding
            if new < value and area_kept and not violating.any():
                self._damping = np.maximum(self._step.damping_decay * damping, self._step.min_damping)
                return _Step(y, facets, 1 - new / value, int(held[problem.moving].sum()))
            to_damp = (violating | problem.with_neighbours(violating & held)) & ~held
            if 0 < to_damp.sum() <= self._step.max_damped * (~held).sum():
                damping[to_damp] *= self._step.damping_growth
                way = direction(damping)
            else:
                length *= 0.5
        return None

    def accept(self, step: _Step) -> float:
        """Go on from there; returns the largest displacement."""
        largest = float(np.linalg.norm(step.points - self.points, axis=1).max())
        self.points, self._projection.node_facets = step.points, step.facets
        self._problem.input_surface.accept()
        return largest


def approach(problem: RemeshingProblem, points: Floats, limits: AngleLimits, schedules: Schedules) -> Iterator[Iterate]:
    """Lower the distance from the input; yields surfaces ever nearer to it whose angles are within their limits.

    How much the distance counts against the angles is found on the way: more as long as some of the price is left,
    less once the mean angle has fallen too far. No cell becomes thinner than allowed.

    Parameters
    ----------
    problem
        With the facets on which a descent has left the nodes; without a bound there is no input to be near to.
    points
        (n, 3) where the descent has ended.
    limits
        What the angles may fall to.
    schedules
        The tuned numbers.
    """
    schedule = schedules.approach
    if problem.projection is None or problem.bound is None:
        return
    problem.input_surface.forbid_turning = True
    problem.input_surface.cells_out_of_bounds(points, problem.bound, np.zeros(len(problem.cells), dtype=bool))
    problem.input_surface.accept()
    # Centres are what is farthest from where a surface bends.
    if problem.input_surface.centre_distance < schedule.near_enough:
        return
    on_its_way = _Approach(problem, points, limits, schedules, problem.projection, problem.bound)
    near, price = on_its_way.near, max(float(limits.angles(points).mean()) - limits.mean, _TINY)
    first = near.mean_square(points)
    nearest = (1 - schedule.least_gain) ** 2 * first
    last, slow = first, 0
    for _ in range(schedule.max_steps):
        step = on_its_way.step() if last > schedule.near_enough**2 and slow < schedule.patience else None
        if step is None:
            return
        largest, distance = on_its_way.accept(step), near.mean_square(step.points)
        left = (float(limits.angles(step.points).mean()) - limits.mean) / price
        # With an overdrawn price the distance gives way to the angles.
        slow = slow + 1 if left >= 0 and distance > (1 - schedule.slow) ** 2 * last else 0
        last = distance
        if left >= 0 and distance < nearest:
            nearest = distance
            yield Iterate(step.points, step.decrease, largest, step.held)
            if left <= schedule.spent and step.decrease < schedule.least_decrease:
                return
        change = schedule.largest_change
        near.stiffness *= float(np.clip(np.exp(schedule.gain * left), 1 / change, change))
