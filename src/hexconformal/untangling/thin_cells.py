"""Give volume to cells that have next to none: the regularized barrier, with every cell kept valid.

Where a cell is thin the barrier of equation (8) is steep: it outweighs all other cells, pushes the surface to its bound
and holds what is around. chi_eps of equation (9) is bounded, so that thin cells open together, eps following them; that
no cell folds is seen to by the line search.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..energy import CornerWeights
from ..formulation import Formulation, Iteration, ValidCells, steps_on_one_rank
from ..mesh import node_rings
from ..solver import Equation, newton_step

__all__ = ["thicken"]

Field = NDArray[np.float64]


def thicken(formulation: Formulation, points: Field) -> Iterator[Iteration]:
    """Thicken the thin cells of a valid mesh and what is around them, as far as that makes the thinnest thicker."""
    schedule, cells = formulation.schedules.thin, formulation.cells
    fullness, space = formulation.fullness(points), formulation.space
    if not 0.0 < space.smallest(fullness) < schedule.thin:
        return
    region = node_rings(cells, len(points), fullness < schedule.thin, schedule.rings, space)
    if space.is_shared:
        yield from steps_on_one_rank(formulation, points, region, lambda whole, start, _: thicken(whole, start))
        return
    patch, nodes = formulation.seen_from(points).restricted(region, points)
    if not patch.free.any():
        return
    thinnest, since = patch.fullness(points[nodes]).min(), 0
    for local in _thickened(patch, points[nodes]):
        now = patch.fullness(local).min()
        since += 1
        if now > thinnest:
            points, thinnest, since = points.copy(), now, 0
            points[nodes] = local
            yield Iteration("thicken", points)
        if since == schedule.patience:
            return


def _thickened(patch: Formulation, points: Field) -> Iterator[Field]:
    """Newton steps with eps some times as large as the determinants of the thin corners, until there are none."""
    schedule, volume = patch.schedules.thin, patch.schedules.minimization.volume_weight
    valid = ValidCells(points, patch.cells)
    equation: Equation = patch.equation
    for _ in range(schedule.steps):
        measures = patch.measures(points)
        thin = measures.fullness < schedule.thin
        if not thin.any():
            return
        eps = schedule.eps * float(np.median(measures.determinant[thin]))
        problem = patch.problem(patch.objective(CornerWeights(eps=eps), volume), valid, patch.spoiled(valid))
        after, equation = newton_step(problem.start(points), equation)
        if after.step == 0.0:
            return
        points = after.points
        yield points
