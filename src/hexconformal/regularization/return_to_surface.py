"""Bring a boundary back that has come out of its bound between the samples that the barrier watches."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..energy import VOLUME_WEIGHT, CornerEnergy, Weights
from ..geometry import DistanceBarrier
from ..solver import projected_newton
from .worst_cells import stiffened

__all__ = ["return_to_surface"]

Field = NDArray[np.float64]

_ROUNDS, _STEPS = 24, 8  # with other samples or another steepness, and of Newton's method in each
_WATCHES, _KEEPING = 8, 4  # of the rounds take in samples; the first of them spoil no cell
_STEEPER = 4.0


def return_to_surface(
    corner_energy: CornerEnergy, barrier: DistanceBarrier, points: Field, keeps_worst: bool
) -> Iterator[Field]:
    """Watch more samples with a steeper barrier each time, until all of the bilinear surface is within its bound.

    Parameters
    ----------
    corner_energy
        Corner energy of which the barrier is a part.
    barrier
        Gets the samples, and is steeper afterwards.
    points
        (n, 3) where to begin.
    keeps_worst
        True where no cell may get much worse than the worst one is, if that can be.

    Yields
    ------
    (n, 3) points after each step; none where the surface is within its bound.
    """
    watched = 0
    for _ in range(_ROUNDS):
        if barrier.relative_distance(points) > 1.0:
            barrier.steepness *= _STEEPER
        elif watched == _WATCHES or not barrier.exceeded(points):
            return
        else:
            # What the samples see comes back by itself; only then others are looked for.
            barrier.watch(points)
            watched += 1
        kept = keeps_worst and 0 < watched <= _KEEPING
        weights = stiffened(corner_energy, points) if kept else Weights(volume=VOLUME_WEIGHT)
        for points, _ in islice(projected_newton(corner_energy, points, weights), _STEPS):
            yield points
            if watched and barrier.relative_distance(points) < 1.0:
                break
