"""Damped Newton descent on a surface, free of files and reports, in units of the mean edge length."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..constraint import ConstrainedSystem, constrained_system, held_projectors
from ..energy import Barrier
from ..mesh import Floats, Ints
from .problem import RemeshingProblem
from .schedules import ContinuationSchedule, StepSchedule
from .stopping import Continuation, StallTest

__all__ = ["Iterate", "Termination", "descend"]


@dataclass(frozen=True)
class Iterate:
    """One accepted surface, and the step that led to it.

    Attributes
    ----------
    points
        (n, 3) positions.
    decrease
        Relative decrease of the energy.
    step
        Largest displacement.
    held
        Number of nodes that were held.
    """

    points: Floats
    decrease: float
    step: float
    held: int


@dataclass
class Termination:
    """The reason why the descent ended, and whether it converged."""

    reason: str = "interrupted"
    converged: bool = False


@dataclass(frozen=True)
class _StepControl:
    """The limits of a step: the (n,) damping of the nodes, and whether a step of all nodes alike is tried first."""

    damping: Floats
    uniform_first: bool


@dataclass(frozen=True)
class _Step:
    """A step that lowers the energy.

    Attributes
    ----------
    points, base
        The new surface, and the points of the input below it.
    facets
        The facets of the input on which those lie; None without projection.
    energy
        Of the new surface.
    held
        (n,) nodes that did not step.
    control
        Its limits.
    """

    points: Floats
    base: Floats
    facets: Ints | None
    energy: float
    held: NDArray[np.bool_]
    control: _StepControl


def descend(
    problem: RemeshingProblem,
    tolerance: float,
    termination: Termination,
    postponed: NDArray[np.bool_],
    schedule: StepSchedule | None = None,
    path: ContinuationSchedule | None = None,
) -> Iterator[Iterate]:
    """Lower the energy until a step would gain less than `tolerance` of it; yields every surface that is accepted.

    Newton steps along the surface, followed by a retraction onto it. Nodes of cells that would be spoiled, or leave the
    input, are damped as in the Levenberg-Marquardt method, so that the steps of the others follow from how far these
    can go; the damping decays. The whole step is shortened first. The barrier is measured against the normals of the
    input, which are taken anew in every iteration: late in a run only as far as that takes back no more than half of
    what the last step gained, so that the energy falls for good. Before the continuation is complete cells may turn
    over; from then on none does. Postponed nodes are held until then.
    """
    energy, projection = problem.energy, problem.projection
    x = base = problem.start
    control = _StepControl(np.where(postponed, np.inf, 1.0), True)
    schedule = StepSchedule() if schedule is None else schedule
    path = ContinuationSchedule() if path is None else path
    continuation, stall = Continuation.of(path), StallTest(energy, tolerance, path)
    problem.input_surface.forbid_turning = False
    value, decrease, step, held = np.inf, 0.0, 0.0, 0
    while True:
        normals = None if projection is None else projection.foot_points(base)[1]
        if isinstance(energy, Barrier):
            energy.cap, energy.continuation = continuation.cap, continuation.factor
            largest_rise = path.normals_rise * decrease * value if stall.late else np.inf
            energy.update_normals(x, problem.frame_normals(x, normals), largest_rise)
            energy.adapt(x)
        value = energy.value(x)
        yield Iterate(x, decrease, step, held)
        gradient, direction = _newton_direction(problem, x, normals, control.damping, schedule)
        promising = -(gradient * direction).sum() > tolerance * value
        if not promising and isinstance(energy, Barrier) and continuation.factor > 1:
            continuation, decrease, step = continuation.with_final_energy(), 0.0, 0.0
            continue
        found = _search(problem, x, base, direction, normals, control, schedule) if promising else None
        if found is None and postponed.any():
            # The other nodes have arrived.
            control = _StepControl(np.minimum(control.damping, schedule.max_damping), True)
            postponed = np.zeros_like(postponed)
            continuation, decrease, step = continuation.completed(), 0.0, 0.0
            problem.input_surface.forbid_turning = True
            continue
        if found is None:
            # Where steps hardly gained any more nothing is lost by a failed search.
            termination.reason, termination.converged = "no step lowers the energy further", True
            if promising:
                termination.reason = "every step that lowers the energy spoils a cell or the shape"
                termination.converged = stall.late
            return
        decrease = (value - found.energy) / value
        step = float(np.linalg.norm(found.points - x, axis=1).max())
        x, base = found.points, found.base
        held = int(found.held[problem.moving].sum())
        continuation = continuation.after(decrease)
        problem.input_surface.accept()
        if projection is not None and found.facets is not None:
            projection.node_facets = found.facets
        problem.input_surface.forbid_turning = continuation.complete
        postponed = postponed & (not continuation.complete)
        damping = schedule.damping_decay * found.control.damping
        damping = np.clip(damping, schedule.min_damping, schedule.max_damping)
        damping[postponed] = np.inf
        control = _StepControl(damping, found.control.uniform_first)
        stall.update(x, decrease, continuation)
        if stall.stalled:
            termination.reason, termination.converged = "iterations hardly lower the energy any more", True
            if held:
                termination.reason += f"; {held} nodes are held at the limits of the shape"
            return


def _newton_direction(
    problem: RemeshingProblem, x: Floats, normals: Floats | None, damping: Floats, schedule: StepSchedule
) -> tuple[Floats, Floats]:
    """The gradient, and the damped Newton direction along the surface; nodes beyond the largest damping are held."""
    problem.set_damping(np.minimum(damping, schedule.max_damping))
    gradient, system = _newton_system(problem, x, normals)
    return gradient, system.solve_iteratively(-gradient, problem.solver_tolerance, damping <= schedule.max_damping)


def _newton_system(problem: RemeshingProblem, x: Floats, normals: Floats | None) -> tuple[Floats, ConstrainedSystem]:
    """The gradient of the energy, and the linear system of a Newton step along the surface."""
    energy = problem.energy
    hessian = energy.hessian(x)
    if normals is not None:
        # Nodes are put back onto the surface: the limit eps = 0, and the normal is that of where they are.
        projectors = held_projectors(normals, x, problem.features)
        return problem.constrained_gradient(x), ConstrainedSystem(hessian, projectors, None, problem.moving)
    gradient = energy.gradient(x)

    def linearized_at(v: Floats) -> ConstrainedSystem:
        return constrained_system(
            hessian, x, v, problem.cells, problem.features, problem.eps, problem.normal, problem.moving
        )

    system = linearized_at(np.zeros_like(x))
    for _ in range(0 if problem.normal == "linear" else 3):
        system = linearized_at(system.solve_iteratively(-gradient, problem.solver_tolerance))
    return gradient, system


def _search(
    problem: RemeshingProblem,
    x: Floats,
    base: Floats,
    direction: Floats,
    normals: Floats | None,
    control: _StepControl,
    schedule: StepSchedule,
) -> _Step | None:
    """A step that lowers the energy and violates nothing, or None.

    Nodes of cells that violate something are damped, and held at last; where these are most, or none that could be
    damped, the step is shortened for all.
    """
    energy = problem.energy
    before = energy.densities(x)
    value = float(before.sum())
    damping, length, uniform, rises = control.damping.copy(), 1.0, control.uniform_first, 0
    frozen = np.isinf(damping)
    for tries in range(schedule.max_tries):
        held = damping > schedule.max_damping
        y, new_base, facets = problem.retract(x, base, (length * ~held)[:, None] * direction, frozen)
        after = energy.densities(y)
        new = float(after.sum())
        violating = problem.violating_nodes(y, before, after, held)
        if not violating.any():
            if new < value and abs(problem.area_excess(y)) <= schedule.area_rounding:
                return _Step(y, new_base, facets, new, held, _StepControl(damping, uniform or tries == 0))
            rises += 1
            if not new < value and rises <= schedule.max_rises:
                # The fewest cells without whose rise the energy would fall: where the surface is too rough to follow.
                rise = after - before
                order = np.argsort(-rise)
                violating = problem.nodes_of_frames(order[np.cumsum(rise[order]) - rise[order] < new - value])
        if uniform:
            length, uniform = (0.5 * length, True) if tries + 1 < schedule.uniform_tries else (1.0, False)
            rises = 0
            continue
        # A held node violates nothing by itself: its neighbours do, or the retraction, which moves all a little.
        frozen |= violating & held & problem.input_surface.forbid_sheet_change
        to_damp = (violating | problem.with_neighbours(violating & held)) & ~held
        if not 0 < to_damp.sum() <= schedule.max_damped * (~held).sum():
            length *= 0.5
            continue
        damping[to_damp] *= schedule.damping_growth
        _, direction = _newton_direction(problem, x, normals, damping, schedule)
    return None
