"""Pull a surface back towards its input until it is within its bound.

While a run goes on distances are measured at nodes and centres, at its end between all places. Nodes of the cells that
are too far away go back step by step; if that spoils cells, their neighbours do so too, and at last all nodes.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from ..mesh import Floats
from .problem import RemeshingProblem

__all__ = ["pull_back"]

_SHRINKAGE, _MAX_ROUNDS = 0.95, 60  # factor of the displacement of a node each time, and how often at most
_NEIGHBOURHOODS = 0, 1, 3  # rings of nodes that go back with those that are too far away
_FRACTIONS = (0.95, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2, 0.1)  # of the displacements of all nodes


def pull_back(problem: RemeshingProblem, points: Floats, bound: float) -> Iterator[tuple[Floats, float]]:
    """Surfaces within the bound on the way from given points to the input, the best first, and their distances."""
    all_nodes = np.ones((len(points), 1))
    local = (_local_fractions(problem, points, bound, rings) for rings in _NEIGHBOURHOODS)
    for fractions in chain(local, (fraction * all_nodes for fraction in _FRACTIONS)):
        trial = _interpolated(problem, points, fractions)
        distance = problem.input_surface.hausdorff(trial)
        if distance <= bound and problem.area_excess(trial) == 0.0:
            yield trial, distance


def _local_fractions(problem: RemeshingProblem, points: Floats, bound: float, rings: int) -> Floats:
    """(n, 1) fraction of its displacement that each node keeps so that no cell is out of bounds."""
    fractions = np.ones((len(points), 1))
    for _ in range(_MAX_ROUNDS):
        cells = problem.input_surface.cells_beyond(_interpolated(problem, points, fractions), bound)
        if not cells.any():
            break
        too_far = np.zeros(len(points), dtype=bool)
        too_far[problem.cells.corners_of(cells)] = True
        for _ in range(rings):
            too_far = problem.with_neighbours(too_far)
        fractions[too_far] *= _SHRINKAGE
    return fractions


def _interpolated(problem: RemeshingProblem, points: Floats, fractions: Floats) -> Floats:
    """Points between the input and others, at given fractions of the way, with the input's volume."""
    trial = problem.start + fractions * (points - problem.start)
    for _ in range(2):
        trial = problem.restore_volume(trial)
    return trial
