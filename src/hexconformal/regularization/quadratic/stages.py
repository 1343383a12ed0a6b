"""Stages of a run on quadratic cells once they are unfolded: lowering the distortion, raising the worst cells."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ...energy import CornerWeights
from ...formulation import Iteration
from .descent import descent
from .setting import QuadraticSetting

__all__ = ["minimize_distortion", "raise_worst"]

Field = NDArray[np.float64]


def minimize_distortion(setting: QuadraticSetting, points: Field, limit: int, tolerance: float) -> Iterator[Iteration]:
    """Lower the distortion of what is not folded, in so many iterations at most, until the gradient is small enough."""
    kept, first, taken = setting.valid(points), 0.0, 0
    settled = setting.schedule.stall if setting.options.raises_worst else setting.schedule.settled
    while taken < limit:
        current = setting.problem(CornerWeights(), points, kept).at(points)
        first, before = first or current.gradient_norm, taken
        if current.gradient_norm <= tolerance * first:
            return
        # Without a barrier nothing is looked for anew.
        most = setting.schedule.renewal if setting.boundary.term is not None else limit
        for iterate in islice(descent(setting, current, settled), min(most, limit - taken)):
            points, taken = iterate.points, taken + 1
            relative = iterate.gradient_norm / first
            yield Iteration("lbfgs", points, iterate.energy, relative, iterate.step)
            if relative <= tolerance:
                return
        if taken - before < most:
            return


def raise_worst(setting: QuadraticSetting, points: Field) -> Iterator[Iteration]:
    """Raise the worst angles with a barrier that stiffens, equation (12): first alone, then round by round."""
    schedule = setting.schedule
    kept, angles, slow = setting.valid(points), setting.worst_angles(points), 0
    worst = max(angles.values())
    if not np.isfinite(worst):
        return
    for number in range(schedule.stiff_rounds):
        if worst <= schedule.negligible:
            return
        # No corner can pass the worst of its type.
        stiffness = {name: schedule.stiffness / max(angle, schedule.negligible) for name, angle in angles.items()}
        weights = CornerWeights(schedule.distortion_share, 1.0, stiffness if number > 0 else 0.0)
        current = setting.problem(weights, points, kept).at(points)
        for iterate in islice(descent(setting, current), schedule.stiff_steps):
            points = iterate.points
            yield Iteration("angles" if number == 0 else "stiffen", points, step=iterate.step)
        angles = setting.worst_angles(points)
        before, worst = worst, max(angles.values())
        # Without stiffness the worst may lose something to begin with.
        slow = slow + 1 if number > 0 and worst > (1.0 - schedule.least_gain) * before else 0
        if slow == 2:
            return
