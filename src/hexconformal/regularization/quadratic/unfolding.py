"""Unfold what is folded: the whole mesh where that is much, then the cells that are left."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ...energy import CornerWeights
from ...formulation import Iteration
from ...mesh import connected_regions
from ...untangling import go_back
from .descent import descent
from .setting import QuadraticSetting
from .straight_start import straight_start

__all__ = ["pulled_back", "unfold"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]


def unfold(setting: QuadraticSetting, points: Field) -> Iterator[Iteration]:
    """Points at which less is folded, until nothing is or all has been tried; the last are the best.

    Where many cells are folded all nodes move first, then those of folded cells, with those that are coupled to them.
    Each time it is begun where the mesh is, then with straight cells unfolded. What is valid may be folded on the way:
    the iterates are not for the user to have.
    """
    folded, coupled = setting.folded_cells(points), setting.boundary.admissible.coupled
    for all_move in (True, False) if folded.mean() > setting.schedule.many_folded else (False,):
        moving = coupled.closed(setting.nodes_of(folded | all_move))
        part = setting.within(moving)
        for begin in (lambda _, there: there, straight_start):
            if not folded.any() or not part.free.any():
                return
            reached = begin(part, points)
            yield Iteration("untangle", reached)
            for reached in _unfolded(part, reached):
                yield Iteration("untangle", reached)
            points = _better_places(part, points, reached, moving)
            folded = setting.folded_cells(points)
            yield Iteration("untangle", points)


def _unfolded(setting: QuadraticSetting, points: Field) -> Iterator[Field]:
    """Points after each eps of equation (9), until no determinant at a point is folded; the last are the best."""
    schedule, smallest = setting.schedule, setting.smallest_determinant(points)
    if smallest > 0.0:
        return
    eps = float(np.hypot(schedule.least_eps, schedule.first_eps * smallest))
    best, fewest, since = points, setting.count_folded(points), 0
    for _ in range(schedule.rounds):
        first = setting.problem(CornerWeights(eps=eps), points).at(points)
        *_, last = first, *islice(descent(setting, first), schedule.steps)
        points, smallest = last.points, setting.smallest_determinant(last.points)
        yield points
        since, folded = since + 1, setting.count_folded(points)
        if folded < fewest:
            best, fewest, since = points, folded, 0
        if smallest > 0.0:
            return
        if since == schedule.patience:
            break
        # Flat cells alone may have no energy at all.
        won = 1.0 - last.energy / first.energy if first.energy > 0.0 else 0.0
        progress = max(won, schedule.progress)
        # Equation (9); chi without cancellation where the determinant is negative.
        chi = 0.25 * eps * eps / (0.5 * (abs(smallest) + np.hypot(eps, smallest)))
        aim = (1.0 - progress) * chi
        # What is flat at first has infinite energy, so that all progress there can be seems to have been made.
        eps = max(min(2.0 * float(np.sqrt(aim * (aim - smallest))), eps), schedule.least_eps**2)
    yield best


def _better_places(setting: QuadraticSetting, points: Field, others: Field, moving: Mask) -> Field:
    """The points, and in each region of nodes that move the others where fewer cells are folded there, or less so."""
    corners, coupled = setting.corners.cells, setting.boundary.admissible.coupled
    regions = [moving] if len(coupled.nodes) else connected_regions(corners, moving)
    (now, depths), (then, their_depths) = (setting.folds(places) for places in (points, others))
    for region in regions:
        own = np.asarray(region[corners].any(axis=1))
        if (then[own].sum(), their_depths[own].sum()) < (now[own].sum(), depths[own].sum()):
            points = np.where(setting.nodes_of(own)[:, None], others, points)
    return points


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
