"""Minimize the distortion step by step under the compatible constraint of Gruber & Aulisa."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..energy import DistortionTerm
from ..formulation import CompatibleConstraint, Formulation, Iteration
from ..geometry import DistanceBarrier
from .minimize import Minimization
from .options import Options

__all__ = ["CompatibleSteps"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


class CompatibleSteps:
    """Steps f -> f + v that each minimize the distortion with v orthogonal to the middle normal; iterate to take them.

    Steps add up, so that the surface drifts away a little: the last one ends where its distance from the input would
    exceed the bound of the barrier.

    Parameters
    ----------
    distortion, formulation, options, points, referenced
        As of a :class:`hexconformal.regularization.minimize.Minimization`.
    barrier
        Knows the bound.
    quads, patches
        (q, 4) boundary quads, and the smooth patch of each.

    Attributes
    ----------
    reason
        Reason of its end, in words.
    converged
        True where further steps would lower the distortion no more.
    """

    def __init__(
        self,
        distortion: DistortionTerm,
        formulation: Formulation,
        options: Options,
        points: Field,
        referenced: NDArray[np.bool_],
        barrier: DistanceBarrier,
        quads: Ints,
        patches: Ints,
    ) -> None:
        self.reason, self.converged = "interrupted", False
        self._distortion, self._formulation, self._options = distortion, formulation, options
        self._barrier = barrier
        self._points, self._referenced, self._quads, self._patches = points, referenced, quads, patches

    def __iter__(self) -> Iterator[Iteration]:
        schedule, barrier, points = self._formulation.schedules.compatible, self._barrier, self._points
        energy = self._distortion.value(points)
        for _ in range(schedule.steps):
            # The mesh is normalized: the mean edge is 1, and eps = eps_hat.
            constraint = CompatibleConstraint.at(points, self._quads, self._patches, self._options.eps)
            formulation = replace(self._formulation.with_barrier(None), constraint=constraint)
            step = Minimization(
                self._distortion, formulation, self._options, points, self._referenced, alone=False,
                acceptable=lambda trial: not barrier.exceeded(trial),
            )  # fmt: skip
            for iteration in step:
                points = iteration.points
                yield iteration
            after = self._distortion.value(points)
            if after >= (1.0 - schedule.stall) * energy:
                within = barrier.farthest(points) < schedule.nearly
                self.reason = "the energy stalls" if within else "the surface has come to its bound"
                self.converged = within
                return
            energy = after
        self.reason = f"took {schedule.steps} steps under the compatible constraint"
