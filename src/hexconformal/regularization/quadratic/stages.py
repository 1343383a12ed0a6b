"""Stages of a run on quadratic hexahedra: unfolding, lowering the distortion, raising the worst cells."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ...energy import CornerWeights
from ...formulation import Iteration
from ...solver import Iterate, lbfgs
from ...untangling import go_back
from .setting import QuadraticSetting

__all__ = ["minimize_distortion", "pulled_back", "raise_worst", "unfold"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]


def unfold(setting: QuadraticSetting, points: Field) -> Iterator[Iteration]:
    """Points after each eps of equation (9), until no determinant at a point is folded.

    What is valid may be folded on the way: the iterates are not for the user to have.
    """
    schedule, smallest = setting.schedule, setting.smallest_determinant(points)
    if smallest > 0.0:
        return
    eps = float(np.hypot(schedule.least_eps, schedule.first_eps * smallest))
    fewest, since = np.inf, 0
    for _ in range(schedule.rounds):
        first = setting.problem(CornerWeights(eps=eps), points).at(points)
        *_, last = first, *islice(_descent(setting, first), schedule.steps)
        points, smallest = last.points, setting.smallest_determinant(last.points)
        yield Iteration("untangle", points)
        folded = setting.count_folded(points)
        fewest, since = min(fewest, folded), 0 if folded < fewest else since + 1
        if smallest > 0.0 or since == schedule.patience:
            return
        progress = max(1.0 - last.energy / first.energy, schedule.progress)
        # Equation (9); chi without cancellation where the determinant is negative.
        chi = 0.25 * eps * eps / (0.5 * (abs(smallest) + np.hypot(eps, smallest)))
        aim = (1.0 - progress) * chi
        # What is flat at first has infinite energy, so that all progress there can be seems to have been made.
        eps = max(min(2.0 * float(np.sqrt(aim * (aim - smallest))), eps), schedule.least_eps**2)


def pulled_back(setting: QuadraticSetting, points: Field) -> Field:
    """The points with nodes of cells that have become invalid taken back, and of those that stay so if that costs none.

    Nodes that slide are on their surface at the start, and nowhere on the way there.
    """
    start, coupled = setting.start, setting.boundary.admissible.coupled
    first = setting.valid(start)

    def folded(trial: Field) -> int:
        return int((~setting.valid(trial)).sum())

    def back(cells: Mask) -> Field:
        def left(trial: Field) -> Mask:
            nodes = setting.nodes_of(cells & ~setting.valid(trial))
            return coupled.closed(nodes & (trial != start).any(axis=1))

        return go_back(points, start, left, setting.around, folded, (1.0,), setting.schedule.tries_back)

    fewest, unmoved = back(first), back(np.ones_like(first))
    return unmoved if folded(unmoved) <= folded(fewest) else fewest


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
        for iterate in islice(_descent(setting, current, settled), min(most, limit - taken)):
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
        for iterate in islice(_descent(setting, current), schedule.stiff_steps):
            points = iterate.points
            yield Iteration("angles" if number == 0 else "stiffen", points, step=iterate.step)
        angles = setting.worst_angles(points)
        before, worst = worst, max(angles.values())
        # Without stiffness the worst may lose something to begin with.
        slow = slow + 1 if number > 0 and worst > (1.0 - schedule.least_gain) * before else 0
        if slow == 2:
            return


def _descent(setting: QuadraticSetting, current: Iterate, settled: float | None = None) -> Iterator[Iterate]:
    """Iterates of L-BFGS, until none is lower or two in a row win less than a share of the energy."""
    settled, slow = setting.schedule.settled if settled is None else settled, 0
    for iterate in lbfgs(current, setting.preconditioner(current.points), scaled=True):
        if iterate.step == 0.0:
            return
        yield iterate
        slow = slow + 1 if iterate.decrease <= settled * abs(iterate.energy) else 0
        if slow == 2:
            return
