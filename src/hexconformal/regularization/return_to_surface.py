"""Bring a boundary back that has come out of its bound between the samples that the barrier watches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice, product

import numpy as np
from numpy.typing import NDArray

from ..elements import is_valid
from ..energy import CornerWeights
from ..formulation import Formulation, ReturnSchedule, convex_newton
from ..geometry import DistanceBarrier
from ..mesh import SERIAL, Space, node_rings
from .worst_cells import stiffened

__all__ = ["return_to_surface", "towards"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def return_to_surface(
    formulation: Formulation, points: Field, keeps_worst: bool
) -> Iterator[tuple[Field, Formulation]]:
    """Watch more samples, or with a steeper barrier, until all of the bilinear surface is within its bound.

    Parameters
    ----------
    formulation
        What resists, with a barrier.
    points
        (n, 3) where to begin.
    keeps_worst
        True where no cell may get much worse than the worst one is: there are fewer rounds then.

    Yields
    ------
    (n, 3) points after each step, and the formulation with the barrier as it is there; nothing where the surface is
    within its bound.
    """
    schedule, barrier, watched = formulation.schedules.returning, formulation.barrier, 0
    watches = schedule.keeping if keeps_worst else schedule.watches
    formulation = formulation.within(formulation.schedules.work.returning)
    if barrier is None:
        return
    bound = barrier.bound
    for _ in range(schedule.rounds):
        if barrier.relative_distance(points) > 1.0:
            barrier = replace(barrier, steepness=schedule.steeper * barrier.steepness)
        elif watched == watches or not replace(barrier, bound=bound).exceeded(points):
            return
        else:
            # What the samples see comes back by itself; only then others are looked for.
            barrier, watched = barrier.watching(points), watched + 1
            if watched > schedule.untightened:
                barrier = replace(barrier, bound=schedule.tighter * barrier.bound)
        formulation = formulation.with_barrier(barrier)
        weights = stiffened(formulation, points) if keeps_worst and watched else CornerWeights()
        distance, slow = barrier.relative_distance(points), 0
        for iterate in islice(convex_newton(formulation, points, weights), schedule.steps):
            points = iterate.points
            yield points, formulation.with_barrier(replace(barrier, bound=bound))
            before, distance = distance, barrier.relative_distance(points)
            slow = slow + 1 if distance > (1.0 - schedule.slow) * before else 0
            # Steeper, or with other samples, it gets on again.
            if distance < 1.0 or slow == schedule.patience:
                break


def towards(
    barrier: DistanceBarrier, points: Field, back: Field, cells: Ints, schedule: ReturnSchedule, space: Space = SERIAL
) -> Field:
    """Points on the way back to others that are within the bound: the first that are so, without spoiling a cell.

    At first only those around places out of the bound go back, the less the farther they are; then all of them.
    """
    beyond, valid = barrier.nodes_beyond(points), is_valid(points, cells)
    if not space.anywhere(bool(beyond.any())):
        return points

    def spoils(trial: Field) -> bool:
        return space.anywhere(not is_valid(trial, cells)[valid].all())

    for share, rings in product(schedule.parts_back, schedule.rings_back):
        left = beyond
        # The first of the tries are the points themselves.
        for _ in range(1, schedule.tries_back):
            trial = points + share * _falling(cells, left, rings, space)[:, None] * (back - points)
            if spoils(trial):
                break
            still = barrier.nodes_beyond(trial)
            if not space.anywhere(bool(still.any())):
                return trial
            left = left | still
    for share in schedule.shares_back:
        trial = points + share * (back - points)
        if not barrier.exceeded(trial) and not spoils(trial):
            return trial
    return back


def _falling(cells: Ints, nodes: Mask, rings: int, space: Space) -> Field:
    """(n,) one at some nodes and half of the rings around them, falling to zero at the last."""
    shares, reached = np.zeros(len(nodes)), nodes
    for ring in range(rings):
        shares[reached & (shares == 0.0)] = min(1.0, 2.0 * (1.0 - ring / rings))
        reached = node_rings(cells, len(nodes), np.asarray(reached[cells].any(axis=1)), 0, space)
    return shares
