"""Take a surface back towards its input, where it ended farther away than it may.

While a run goes on distances are measured at nodes and centres, at its end at more places. Nodes of the cells that are
too far away go back step by step; if that spoils cells, so do those around them, at last all.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from ..mesh import Floats
from .problem import RemeshingProblem

__all__ = ["nearer"]

_PART, _PARTS = 0.95, 60  # of its way that a node keeps each time, and how often
_RINGS = 0, 1, 3  # of nodes around those that go back with them
_SHARES = (0.95, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2, 0.1)  # of the way that all keep


def nearer(surface: RemeshingProblem, points: Floats, bound: float) -> Iterator[tuple[Floats, float]]:
    """Surfaces between the input and some points that are within the bound, the best first, and their distances."""
    everybody = np.ones((len(points), 1))
    local = (_cut(surface, points, bound, rings) for rings in _RINGS)
    for shares in chain(local, (share * everybody for share in _SHARES)):
        trial = _between(surface, points, shares)
        distance = surface.shape.hausdorff(trial)
        if distance <= bound and surface.area_excess(trial) == 0.0:
            yield trial, distance


def _cut(surface: RemeshingProblem, points: Floats, bound: float, rings: int) -> Floats:
    """(n, 1) share of its way that each node keeps so that no cell is out of bounds."""
    shares = np.ones((len(points), 1))
    for _ in range(_PARTS):
        beyond = surface.shape.nodes_out_of_bounds(_between(surface, points, shares), bound)
        if not beyond.any():
            break
        for _ in range(rings):
            beyond = surface.around(beyond)
        shares[beyond] *= _PART
    return shares


def _between(surface: RemeshingProblem, points: Floats, shares: Floats) -> Floats:
    """A part of the way from the input to some points, with the input's volume."""
    trial = surface.start + shares * (points - surface.start)
    for _ in range(2):
        trial = surface.with_volume(trial)
    return trial
