"""Improve the cells that stay folded: raise the smallest scaled Jacobian among them.

Where no valid mesh exists the barrier has no say. Nodes of the folded cells move, and those of the cells around them:
the soft minimum of the scaled Jacobian over the corners of the folded cells is maximized, while the others keep theirs.
"""

from __future__ import annotations

from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..elements import corner_scaled_jacobian
from ..energy import Objective, SoftMinimumTerm, corner_jacobians
from ..formulation import Formulation, ValidCells, on_one_rank
from ..mesh import connected_regions, node_rings
from ..solver import lbfgs
from .untangle import folded_cells

__all__ = ["improve_folded"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]


def improve_folded(formulation: Formulation, points: Field, bad: Mask) -> Field:
    """Points at which the worst of some folded cells is better, no other cell is folded, and no valid one invalid.

    Only nodes inside the mesh move.
    """
    widths, space = formulation.schedules.folded.widths, formulation.space
    if space.is_shared:
        region = node_rings(formulation.cells, len(points), bad, max(widths), space)
        return on_one_rank(
            formulation,
            points,
            region,
            lambda whole, start, _: improve_folded(whole, start, folded_cells(whole, start)),
        )
    points, formulation = points.copy(), formulation.within(formulation.schedules.work.folded)
    for width in widths:
        for region in connected_regions(formulation.cells, node_rings(formulation.cells, len(points), bad, width)):
            patch, nodes = formulation.restricted(region & formulation.inner, points)
            if patch.free.any():
                points[nodes] = _improved(patch, points[nodes])
    return points


def _improved(patch: Formulation, points: Field) -> Field:
    """The best of the iterates that are admissible."""
    schedule = patch.schedules.folded
    first, valid = corner_scaled_jacobian(points, patch.cells), ValidCells(points, patch.cells)
    folded = first <= 0.0
    floor = np.minimum(schedule.floor, 0.5 * first[~folded])
    kept = corner_jacobians(points, patch.cells)[0][~folded]
    best, highest = points, float(first[folded].min(initial=1.0))
    for sharpness in schedule.sharpness:
        term = SoftMinimumTerm(patch.cells, folded, sharpness, kept, floor, schedule.floor_weight, schedule.loss_weight)
        at = patch.problem(Objective((term,))).at(points)
        for iterate in islice(lbfgs(at, np.copy, scaled=True), schedule.steps):
            if iterate.step == 0.0 or not patch.work.take(len(patch.cells)):
                break
            points = iterate.points
        now = corner_scaled_jacobian(points, patch.cells)
        if (now[~folded] > 0.0).all() and valid(points) and now.min() > highest:
            best, highest = points, float(now.min())
    return best
