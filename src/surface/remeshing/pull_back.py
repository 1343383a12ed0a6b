"""Pull a surface back towards its input until it is within its bound.

While a run goes on distances are measured at nodes and centres, at its end between all places. Nodes of the cells that
are too far away go back step by step, and of those that this turns over; if that spoils cells, their neighbours do so
too, and at last all nodes.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from ..mesh import Floats
from .problem import RemeshingProblem
from .schedules import PullBackSchedule

__all__ = ["pull_back"]


def pull_back(
    problem: RemeshingProblem, points: Floats, bound: float, schedule: PullBackSchedule
) -> Iterator[tuple[Floats, float]]:
    """Surfaces within the bound on the way from given points to the input, the best first, and their distances."""
    all_nodes = np.ones((len(points), 1))
    local = (_local_fractions(problem, points, bound, rings, schedule) for rings in schedule.rings)
    for fractions in chain(local, (share * all_nodes for share in schedule.shares)):
        trial = _interpolated(problem, points, fractions)
        distance = problem.input_surface.hausdorff(trial)
        if distance <= bound and problem.area_excess(trial) == 0.0:
            yield trial, distance


def _local_fractions(
    problem: RemeshingProblem, points: Floats, bound: float, rings: int, schedule: PullBackSchedule
) -> Floats:
    """(n, 1) fraction of its displacement that each node keeps so that no cell is out of bounds.

    Cells that this would turn over go back, too.
    """
    fractions, surface = np.ones((len(points), 1)), problem.input_surface
    turned_before = surface.turned_over(problem.start) | surface.turned_over(points)
    for _ in range(schedule.rounds):
        trial = _interpolated(problem, points, fractions)
        cells = surface.cells_beyond(trial, bound) | (surface.turned_over(trial) & ~turned_before)
        if not cells.any():
            break
        too_far = np.zeros(len(points), dtype=bool)
        too_far[problem.cells.corners_of(cells)] = True
        for _ in range(rings):
            too_far = problem.with_neighbours(too_far)
        fractions[too_far] *= schedule.shrinkage
    return fractions


def _interpolated(problem: RemeshingProblem, points: Floats, fractions: Floats) -> Floats:
    """Points between the input and others, at given fractions of the way, with the input's volume."""
    trial = problem.start + fractions * (points - problem.start)
    for _ in range(2):
        trial = problem.restore_volume(trial)
    return trial
