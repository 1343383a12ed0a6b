"""Take back, place by place, what unfolding has made worse."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..elements import corner_scaled_jacobian, is_valid
from ..formulation import UntanglingSchedule
from ..mesh import node_rings
from ..solver import UNCOUPLED, CoupledNodes

__all__ = ["go_back", "pull_back"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def pull_back(
    points: Field,
    start: Field,
    cells: Ints,
    beyond: Callable[[Field], Mask],
    schedule: UntanglingSchedule | None = None,
    coupled: CoupledNodes = UNCOUPLED,
) -> Field:
    """Points at which cells are valid that were so at the start, the worst is no worse, and the boundary near enough.

    Of what stays folded the worst may have been made worse for the sake of the others, and valid cells invalid: nodes
    of these go back, and nodes (n,) that are beyond what is allowed. Nodes that are coupled go back together.
    """
    schedule = UntanglingSchedule() if schedule is None else schedule
    first, valid = corner_scaled_jacobian(start, cells), is_valid(start, cells)

    def left(trial: Field) -> Mask:
        nodes = beyond(trial)
        nodes[cells[(corner_scaled_jacobian(trial, cells) < first.min()) | (valid & ~is_valid(trial, cells))]] = True
        return coupled.closed(nodes)

    def around(nodes: Mask, rings: int) -> Mask:
        return coupled.closed(node_rings(cells, len(nodes), np.asarray(nodes[cells].any(axis=1)), rings))

    def inverted(trial: Field) -> int:
        return int((corner_scaled_jacobian(trial, cells) <= 0.0).sum())

    return go_back(points, start, left, around, inverted, schedule.shares_back, schedule.tries_back)


def go_back(
    points: Field,
    start: Field,
    left: Callable[[Field], Mask],
    around: Callable[[Mask, int], Mask],
    folded: Callable[[Field], int],
    shares: tuple[float, ...],
    tries: int,
) -> Field:
    """Points with nodes taken back by a share of their way to the start, until none is left that has to.

    In the first half of the tries these alone go, then those around them too, all the way. Of several shares that with
    the fewest folded cells counts, where they are no more than at the start.

    Parameters
    ----------
    points, start
        (n, 3) points, and where they were.
    left
        Nodes (n,) that have to go back from some points.
    around
        Nodes of the cells at some nodes, and of so many rings of cells around these.
    folded
        The number of cells that are folded at some points.
    shares, tries
        Shares of the way, and how often nodes go back by one.
    """
    if not (worse := left(points)).any():
        return points
    best, fewest = start, folded(start)
    for share in shares:
        trial, nodes = points, worse
        for attempt in range(tries):
            rings = attempt - tries // 2
            if rings >= 0:
                share, nodes = 1.0, around(nodes, rings)
            trial = np.where(nodes[:, None], start if share == 1.0 else trial + share * (start - trial), trial)
            if not (nodes := left(trial)).any():
                found = folded(trial)
                if found < fewest or (found == fewest and best is start):
                    best, fewest = trial, found
                break
    return best
