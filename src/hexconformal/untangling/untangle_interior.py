"""Make cells valid that are folded inside although no corner of them is.

The determinant of a trilinear cell can be negative inside where it is positive at all corners. Cut into eight, its
parts have corners there too, so the barrier of :mod:`hexconformal.regularization.untangle` on the corners of the parts
sees the fold; wedges are cut in two. The parts' nodes depend linearly on the cell's, x = S X, and so do the forces,
S^T f.
"""

from __future__ import annotations

from functools import cache
from itertools import islice, product

import numpy as np
import scipy
from numpy.typing import NDArray

from ..elements import CORNERS, HEXAHEDRON, WEDGE, CellType, collapsed_cells, is_valid, minimum_jacobian, rows_by_type
from ..energy import ComposedTerm, DistortionTerm
from ..formulation import Formulation, on_one_rank
from ..mesh import connected_regions, node_rings
from ..solver import Iterate, lbfgs

__all__ = ["untangle_interior"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def untangle_interior(formulation: Formulation, points: Field) -> Field:
    """Points at which cells are valid that were invalid though none of their corners is folded, as far as possible.

    Inner nodes move, those of the boundary where that is not enough. No corner becomes folded, no valid cell becomes
    invalid, and the boundary stays as near to the surface as it has to be.
    """
    schedule, space = formulation.schedules.interior, formulation.space
    if space.is_shared:
        bad = _invalid_inside(formulation, points)
        region = node_rings(formulation.cells, len(points), bad, max(schedule.widths), space)
        return on_one_rank(formulation, points, region, lambda whole, start, _: untangle_interior(whole, start))
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
    moved, last, stalled = points, 0.0, 0
    for k in range(schedule.rounds):
        worst = max(0.0, -float(minimum_jacobian(weights @ moved, parts)[0].min()))
        stalled = stalled + 1 if abs(worst - last) < schedule.alike * last else 0
        if stalled == schedule.patience:
            break
        last, eps = worst, max(schedule.least_eps, schedule.first_eps * worst) * schedule.shrink**k
        inside = ComposedTerm(DistortionTerm(parts, weights.shape[0], eps=eps, quadrature="corners"), weights)
        moved = _lowered(patch.problem(patch.with_distortion(inside, 0.0)).at(moved), patch)
        now = is_valid(moved, patch.cells)
        unfolded = (patch.measures(moved).determinant > 0.0) | folded
        if now.sum() > valid.sum() and now[valid].all() and unfolded.all():
            return moved
    return points


def _lowered(at: Iterate, patch: Formulation) -> Field:
    """Points with less energy, by L-BFGS until that hardly falls any more."""
    schedule, points, slow = patch.schedules.interior, at.points, 0
    for iterate in islice(lbfgs(at, np.copy, scaled=True), schedule.steps):
        slow = slow + 1 if iterate.decrease < schedule.slow * abs(iterate.energy) else 0
        if iterate.step == 0.0 or slow == schedule.patience or not patch.work.take(len(patch.cells)):
            break
        points = iterate.points
    return points


def _parts(cells: Ints, count: int) -> tuple[scipy.sparse.csr_array, Ints]:
    """S, (g, n), that takes nodes to those of the parts, and the parts, (p, 8); nodes are not shared by cells."""
    rows, columns, shares, parts, first = [], [], [], [], 0
    for one in rows_by_type(cells):
        weights, pieces = _cut(one.cell_type)
        own, size = one.own_nodes(cells), len(weights)
        starts = first + size * np.arange(len(own))
        rows.append(np.repeat(starts[:, None] + np.arange(size), weights.shape[1], axis=1).ravel())
        columns.append(np.repeat(own[:, None], size, axis=1).ravel())
        shares.append(np.tile(weights.ravel(), len(own)))
        parts.append((pieces[None] + starts[:, None, None]).reshape(-1, 8))
        first += size * len(own)
    matrix = (np.concatenate(shares), (np.concatenate(rows), np.concatenate(columns)))
    return scipy.sparse.csr_array(matrix, shape=(first, count)), np.concatenate(parts).astype(np.int64)


@cache
def _cut(cell_type: CellType) -> tuple[Field, Ints]:
    """Weights (g, j) of the nodes of the parts of a cell in its own, and the parts (p, 8) in numbers of these nodes."""
    if cell_type is HEXAHEDRON:
        grid = np.array([[i, j, k] for k in range(3) for j in range(3) for i in range(3)])
        weights = np.where(CORNERS[None] == 1, grid[:, None] / 2, 1 - grid[:, None] / 2).prod(axis=2)
        firsts = grid[(grid < 2).all(axis=1)]
        return weights, ((firsts[:, None] + CORNERS[None]) * [1, 3, 9]).sum(axis=2)
    if cell_type is WEDGE:
        # Along its vertical edges alone the determinant is no linear function.
        below, above = np.eye(6)[:3], np.eye(6)[3:]
        pieces = collapsed_cells(np.array([np.arange(6), np.arange(3, 9)]), WEDGE)
        return np.concatenate([below, 0.5 * (below + above), above]), pieces
    nodes = np.arange(len(cell_type.nodes))
    return np.eye(len(nodes)), collapsed_cells(nodes[None], cell_type)
