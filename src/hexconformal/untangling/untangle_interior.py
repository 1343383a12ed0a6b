"""Make cells valid that are folded inside although no corner of them is.

The determinant of a trilinear cell can be negative inside where it is positive at all corners. Cut into eight, its
parts have corners there too, so the barrier of :mod:`hexconformal.regularization.untangle` on the corners of the parts
sees the fold. The parts' nodes depend linearly on the cell's, x = S X, and so do the forces, S^T f.
"""

from __future__ import annotations

from itertools import islice, product

import numpy as np
import scipy
from numpy.typing import NDArray

from ..elements import CORNERS, is_valid, minimum_jacobian
from ..energy import ComposedTerm, DistortionTerm
from ..formulation import Formulation
from ..mesh import connected_regions, node_rings
from ..solver import lbfgs

__all__ = ["untangle_interior"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def untangle_interior(formulation: Formulation, points: Field) -> Field:
    """Points at which cells are valid that were invalid though none of their corners is folded, as far as possible.

    Inner nodes move, those of the boundary where that is not enough. No corner becomes folded, no valid cell becomes
    invalid, and the boundary stays as near to the surface as it has to be.
    """
    schedule = formulation.schedules.interior
    formulation = formulation.within(formulation.schedules.work.interior)
    for movable, width in product((formulation.inner, formulation.free), schedule.widths):
        regions = _invalid_inside(formulation, points)
        if not regions.any():
            break
        formulation = formulation.seen_from(points)
        for region in connected_regions(formulation.cells, node_rings(formulation.cells, len(points), regions, width)):
            patch, nodes = formulation.restricted(region & movable, points)
            if patch.free.any():
                trial = points.copy()
                trial[nodes] = _unfold(patch, points[nodes])
                reached = formulation.relative_distance(trial)
                points = trial if reached <= max(1.0, formulation.relative_distance(points)) else points
    return points


def _invalid_inside(formulation: Formulation, points: Field) -> Mask:
    """(m,) cells that are invalid with all their corners positive."""
    return np.asarray((formulation.measures(points).determinant > 0.0) & ~is_valid(points, formulation.cells))


def _unfold(patch: Formulation, points: Field) -> Field:
    """The first iterate at which fewer cells of the patch are invalid and none is newly so; the points if none is."""
    schedule = patch.schedules.interior
    valid, folded = is_valid(points, patch.cells), patch.measures(points).determinant <= 0.0
    weights, parts = _parts(patch.cells[~folded], len(points))
    moved = points
    for k in range(schedule.rounds):
        worst = max(0.0, -float(minimum_jacobian(weights @ moved, parts)[0].min()))
        eps = max(schedule.least_eps, schedule.first_eps * worst) * schedule.shrink**k
        inside = ComposedTerm(DistortionTerm(parts, weights.shape[0], eps=eps, quadrature="corners"), weights)
        at = patch.problem(patch.with_distortion(inside, 0.0)).at(moved)
        for iterate in islice(lbfgs(at, np.copy, scaled=True), schedule.steps):
            if iterate.step == 0.0 or not patch.work.take(len(patch.cells)):
                break
            moved = iterate.points
        now = is_valid(moved, patch.cells)
        unfolded = (patch.measures(moved).determinant > 0.0) | folded
        if now.sum() > valid.sum() and now[valid].all() and unfolded.all():
            return moved
    return points


def _parts(cells: Ints, count: int) -> tuple[scipy.sparse.csr_array, Ints]:
    """S, (27 m, n), that takes nodes to those of the parts, and the parts, (8 m, 8); nodes are not shared by cells."""
    grid = np.array([[i, j, k] for k in range(3) for j in range(3) for i in range(3)])
    shares = np.where(CORNERS[None] == 1, grid[:, None] / 2, 1 - grid[:, None] / 2).prod(axis=2)
    rows = np.repeat(np.arange(27 * len(cells)), 8)
    columns = np.repeat(cells[:, None], 27, axis=1).ravel()
    weights = scipy.sparse.csr_array(
        (np.tile(shares.ravel(), len(cells)), (rows, columns)), shape=(27 * len(cells), count)
    )
    firsts = grid[(grid < 2).all(axis=1)]
    parts = ((firsts[:, None] + CORNERS[None]) * [1, 3, 9]).sum(axis=2)
    return weights, (parts[None] + 27 * np.arange(len(cells))[:, None, None]).reshape(-1, 8).astype(np.int64)
