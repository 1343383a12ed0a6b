"""Where to begin to unfold: straight cells unfolded first, the bends of what stays going on inside.

Corners of quadratic cells alone are a mesh of linear ones, which is unfolded sooner, equation (9). What the faces
and edges that stay are away from its straight ones, is extended to the nodes inside as a harmonic field.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...elements import means_of_corners
from ...energy import CornerWeights
from ...formulation import Formulation, convex_newton
from ...solver import AdmissibleDirections
from ...untangling import extended, folded_cells, untangle
from .setting import QuadraticSetting

__all__ = ["straight_start"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]


def straight_start(setting: QuadraticSetting, points: Field) -> Field:
    """The points (n, 3), in edges, with the inner nodes of the cells that count at other places; all others stay."""
    inner = setting.inner(points)
    placed = _with_corners_unfolded(setting, points, inner)
    straight = placed.copy()
    for block in setting.blocks:
        shares = means_of_corners(block.cell_type)
        straight[block.cells] = np.einsum("ka,cad->ckd", shares, placed[block.cells[:, : shares.shape[1]]])
    bends = extended(setting.laplacian(straight), np.where(inner[:, None], 0.0, placed - straight), inner)
    return np.where(inner[:, None], straight + bends, points)


def _with_corners_unfolded(setting: QuadraticSetting, points: Field, inner: Mask) -> Field:
    """The points with corners, as far as they are inner nodes, where straight cells are unfolded and regular."""
    formulation = _straight_cells(setting)
    moving = np.zeros(len(points), dtype=bool)
    moving[formulation.cells] = True
    moving &= inner
    if not moving.any():
        return points
    whole, nodes = formulation.restricted(moving, points)
    patch, local = whole.within(setting.schedule.straight_steps), points[nodes]
    for iteration in untangle(patch, local):
        local = iteration.points
    patch = patch.without(folded_cells(patch, local))
    for iterate in convex_newton(patch, local, CornerWeights()):
        local = iterate.points
    placed = points.copy()
    placed[nodes] = local
    return placed


def _straight_cells(setting: QuadraticSetting) -> Formulation:
    """What objectives of the straight cells are made of, of those that count; no node is held."""
    counting, count = ~setting.left_out, len(setting.start)
    inverses = np.empty((len(counting), 1, 3, 3))
    for block, boxes in zip(setting.blocks, setting.boxes, strict=True):
        inverses[block.places, 0] = block.cell_type.inverse_target
        if boxes is not None:
            inverses[block.places, 0] /= boxes[:, None]
    free = AdmissibleDirections(np.empty(0, dtype=np.int64), np.empty((0, 3, 3)))
    cells = np.ascontiguousarray(setting.corners.cells[counting])
    return Formulation(cells, count, np.ascontiguousarray(inverses[counting]), free)
