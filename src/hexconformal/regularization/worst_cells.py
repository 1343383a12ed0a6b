"""Raise the worst cells: angles first, then a stiffening barrier that follows the worst corner.

The scaled Jacobian of a corner depends on its angles alone, so the distortion of the unit columns is what
counts, with a part of the whole distortion to keep edge lengths in order. phi(e) = e / (1 - t e) with t just
below one over the worst density forbids any corner to get worse and pushes hardest where it is needed
(quasi-isometric stiffening, Garanzha et al. 2021). Equation (12) of docs/mathematics.md.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import replace
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..elements import corner_scaled_jacobian, rows_by_type
from ..energy import CornerWeights
from ..formulation import Formulation, Iteration, ValidCells, convex_newton, on_one_rank, steps_on_one_rank
from ..geometry import DistanceBarrier
from ..mesh import node_rings
from ..quality import attainable_scaled_jacobians
from ..untangling import untangle, untangle_interior

__all__ = [
    "Softened",
    "next_to_flat",
    "raise_worst",
    "raise_worst_patches",
    "reopen_worst",
    "soften_curves",
    "stiffened",
]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Softened(NamedTuple):
    """A barrier with curves let go, the points that it comes to, and a note on what that wins."""

    barrier: DistanceBarrier
    points: Field
    note: str


def stiffened(formulation: Formulation, points: Field) -> CornerWeights:
    """Weights of a barrier that no corner worse than the worst of its type, at the points, can pass."""
    schedule, angles = formulation.schedules.worst_cells, formulation.measures(points).angle
    stiffness = {
        one.cell_type.name: schedule.stiffness / max(formulation.space.largest(angles[one.rows]), 1e-3)
        for one in rows_by_type(formulation.cells)
    }
    return CornerWeights(schedule.distortion_share, 1.0, stiffness)


def raise_worst(formulation: Formulation, points: Field, opens: bool = False) -> Iterator[Iteration]:
    """Raise the worst cells of a whole valid mesh, then its worst patches, until the worst cell stalls.

    Where such cells are opened afterwards, nothing is done for others beside one that stalls next to flat.
    """
    if formulation.space.is_shared:
        everywhere = np.ones(len(points), dtype=bool)
        yield from steps_on_one_rank(
            formulation, points, everywhere, lambda whole, start, _: raise_worst(whole, start, opens)
        )
        return
    schedule = formulation.schedules.worst_cells
    weights = CornerWeights(schedule.distortion_share, 1.0)
    angles = convex_newton(formulation, points, weights, decrease=schedule.angle_decrease)
    for iterate in islice(angles, schedule.angle_steps):
        points = iterate.points
        yield Iteration("angles", points)
    stiff = convex_newton(formulation, points, stiffened(formulation, points))
    for iterate in islice(stiff, schedule.stiff_steps):
        points = iterate.points
        yield Iteration("stiffen", points)
    yield from raise_worst_patches(formulation, points, opens)


def raise_worst_patches(formulation: Formulation, points: Field, opens: bool = False) -> Iterator[Iteration]:
    """Raise the patches around the worst cells only, until all are good enough or stall, or the work is done.

    A worst cell that stalls is set aside, and those that come after it are raised, as long as they are poor; not beside
    one that stalls next to flat, where that is opened afterwards.
    """
    schedule, cells, space = formulation.schedules.worst_cells, formulation.cells, formulation.space
    limits = _limits(formulation, points)
    attainable = (1.0 - schedule.least_gain) * space.smallest(formulation.attainable)
    quality = formulation.quality(points)
    aside, stalled = quality >= limits, False
    for _ in range(schedule.patch_rounds):
        # Once the worst of all cannot get better, the others matter as long as they are poor.
        stalled |= space.at_smallest(quality, aside) or space.smallest(quality) >= attainable
        worst = min(space.smallest(quality[~aside]), 1.0)
        if worst >= (schedule.poor if stalled else schedule.good):
            return
        # What is better than the worst can get stands in nobody's way.
        most = worst + schedule.margin
        if worst < attainable:
            most = min(most, attainable + schedule.spared)
        seeds = ~aside & (quality < most)
        region = node_rings(cells, len(points), seeds, schedule.rings, space)
        seen = formulation.seen_from(points)
        trial = _raised(seen, points, region)
        after = formulation.quality(trial)
        # A patch watches the surface around itself only.
        finite = bool(np.isfinite(seen.objective(CornerWeights()).value(trial)))
        spoiled = space.smallest(after) < space.smallest(quality) or not space.everywhere(finite)
        if not spoiled and trial is not points:
            points, quality = trial, after
            yield Iteration("worst cells", points)
        if formulation.work.is_done:
            return
        if spoiled or space.smallest(quality[~aside]) < worst + min(schedule.least_gain, 0.1 * worst):
            if opens and worst < schedule.reopened:
                return
            stalled = True
            aside |= quality < worst + schedule.alike
        aside |= quality >= limits


def reopen_worst(formulation: Formulation, points: Field) -> Generator[Iteration, None, Field]:
    """Open the worst cells as folded ones are, where they stall next to flat; returns the points that gives.

    The barrier of equation (12) keeps a cell on the way it is on. chi_eps of equation (9) lets it go, and finds others
    from harmonic positions, too. Meanwhile the points are seen as they were, and these come back where nothing opens.
    """
    cells, space, opened = formulation.cells, formulation.space, next_to_flat(formulation, points)
    if not space.anywhere(bool(opened.any())):
        return points
    trial = points
    if space.is_shared:
        region = node_rings(cells, len(points), opened, formulation.schedules.untangling.rounds, space)
        for iteration in steps_on_one_rank(formulation, points, region, lambda whole, start, _: _opened(whole, start)):
            trial = iteration.points
            yield Iteration("reopen worst cells", points)
        return trial
    for iteration in _opened(formulation, points):
        trial = iteration.points
        yield Iteration("reopen worst cells", points)
    return trial


def next_to_flat(formulation: Formulation, points: Field) -> Mask:
    """(m,) cells that are next to flat, though held corners let them be better."""
    most = np.minimum(_limits(formulation, points), formulation.schedules.worst_cells.reopened)
    return np.asarray(formulation.quality(points) < most)


def _limits(formulation: Formulation, points: Field) -> Field:
    """(m,) scaled Jacobians from which on held corners leave nothing to gain."""
    attainable = attainable_scaled_jacobians(points, formulation.cells, ~formulation.free)
    return (1.0 - formulation.schedules.worst_cells.least_gain) * attainable


def _opened(formulation: Formulation, points: Field) -> Iterator[Iteration]:
    """Untangle what is next to flat, in patches alone, as the mesh as a whole is in order; valid ones are yielded."""
    schedule = formulation.schedules.worst_cells
    untangling = replace(formulation.schedules.untangling, flat=schedule.opened, many_folded=1.0)
    schedules, valid = replace(formulation.schedules, untangling=untangling), ValidCells(points, formulation.cells)
    trial = points
    for iteration in untangle(replace(formulation, schedules=schedules), points, schedule.patience):
        trial = iteration.points
        yield Iteration("reopen worst cells", points)
    # Opened corners may leave cells that are folded inside.
    if trial is not points and valid(trial := untangle_interior(formulation, trial)):
        yield Iteration("reopen worst cells", trial)


def soften_curves(formulation: Formulation, points: Field) -> Generator[Iteration, None, Softened | None]:
    """Let go of the curves at which cells are poor; returns what comes of it if it is worth it.

    Curves are kept within a share of what the surface may move. What that costs shows where the worst cells stall.
    Meanwhile the points are seen as they were.
    """
    schedule, barrier = formulation.schedules.worst_cells, formulation.barrier
    quality = corner_scaled_jacobian(points, formulation.cells)
    poor = quality < schedule.poor
    space = formulation.space
    if barrier is None or not space.anywhere(bool(poor.any())):
        return None
    touched = np.zeros(len(points), dtype=bool)
    touched[formulation.cells[poor]] = True
    softer, count = barrier.with_slack(space.joined(touched))
    if count == 0:
        return None
    soft, before, best = formulation.with_barrier(softer), space.smallest(quality), points
    after = before
    for iteration in raise_worst_patches(soft, points):
        yield Iteration("soften curves", points)
        best, after = iteration.points, space.smallest(corner_scaled_jacobian(iteration.points, formulation.cells))
        if after >= max(schedule.poor, before + schedule.worth):
            break
    if after < before + schedule.worth:
        return None
    what = "a curve" if count == 1 else f"{count} curves"
    note = f"features: {what} may go as far as the surface: kept, the worst cells there stall at {before:.3f}"
    return Softened(softer, best, f"{note}, and come to {after:.3f} so")


def _raised(formulation: Formulation, points: Field, region: Mask) -> Field:
    """The points with the nodes of a region moved so that its worst corners get better."""
    if formulation.space.is_shared:
        return on_one_rank(formulation, points, region, _raised)
    schedule = formulation.schedules.worst_cells
    patch, nodes = formulation.restricted(region, points)
    if not patch.free.any():
        return points
    local = points[nodes]
    worst = float(corner_scaled_jacobian(local, patch.cells).min())
    for number in range(schedule.patch_passes):
        steps = convex_newton(patch, local, stiffened(patch, local))
        for iterate in islice(steps, schedule.patch_steps):
            local = iterate.points
        before, worst = worst, float(corner_scaled_jacobian(local, patch.cells).min())
        # The first may lose something to begin with.
        if number > 0 and worst < before + schedule.least_gain / schedule.patch_passes:
            break
    moved = points.copy()
    moved[nodes] = local
    return moved
