"""Bring a boundary back that has come out of its bound between the samples that the barrier watches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..energy import CornerWeights
from ..formulation import Formulation, convex_newton
from .worst_cells import stiffened

__all__ = ["return_to_surface"]

Field = NDArray[np.float64]


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
        True where no cell may get much worse than the worst one is, if that can be.

    Yields
    ------
    (n, 3) points after each step, and the formulation with the barrier as it is there; nothing where the surface is
    within its bound.
    """
    schedule, barrier, watched = formulation.schedules.returning, formulation.barrier, 0
    formulation = formulation.within(formulation.schedules.work.returning)
    for _ in range(schedule.rounds):
        if barrier is None:
            return
        if barrier.relative_distance(points) > 1.0:
            barrier = replace(barrier, steepness=schedule.steeper * barrier.steepness)
        elif watched == schedule.watches or not barrier.exceeded(points):
            return
        else:
            # What the samples see comes back by itself; only then others are looked for.
            barrier, watched = barrier.watching(points), watched + 1
        formulation = formulation.with_barrier(barrier)
        kept = keeps_worst and 0 < watched <= schedule.keeping
        weights = stiffened(formulation, points) if kept else CornerWeights()
        for iterate in islice(convex_newton(formulation, points, weights), schedule.steps):
            points = iterate.points
            yield points, formulation
            if watched and barrier.relative_distance(points) < 1.0:
                break
