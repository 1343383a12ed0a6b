"""Improve the cells that cannot be unfolded: raise the smallest scaled Jacobian among them.

Where no valid mesh exists the barrier has no say. Nodes of the folded cells move, and those of the cells around them:
the soft minimum of the scaled Jacobian over the corners of the folded cells is maximized, while the others keep theirs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..elements import CORNER_NEIGHBOURS, corner_scaled_jacobian, is_valid
from ..mesh import connected_regions, node_rings
from .formulation import Formulation

__all__ = ["improve_folded"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_WIDTHS = 0, 1  # rings of cells around the folded ones that move with them
_SHARPNESS = 8.0, 16.0, 32.0, 64.0  # of the soft minimum
_STEPS = 100  # at each
_FLOOR, _FLOOR_WEIGHT = 0.2, 100.0  # scaled Jacobian that the others keep, where they have it
_LOSS_WEIGHT = 0.05  # of what they lose above that


def improve_folded(formulation: Formulation, points: Field, bad: Mask) -> Field:
    """Points at which the worst of some folded cells is better, no other cell is folded, and no valid one invalid.

    Only nodes inside the mesh move.
    """
    points = points.copy()
    for width in _WIDTHS:
        for region in connected_regions(formulation.cells, node_rings(formulation.cells, len(points), bad, width)):
            patch, nodes = formulation.restricted(region & formulation.inner, points)
            if patch.free.any():
                points[nodes] = _improved(patch, points[nodes])
    return points


def _improved(patch: Formulation, points: Field) -> Field:
    """The best of the iterates that are admissible."""
    from scipy.optimize import minimize

    free = patch.free
    first, valid = corner_scaled_jacobian(points, patch.cells), is_valid(points, patch.cells)
    folded = first <= 0.0
    floor = np.minimum(_FLOOR, 0.5 * first[~folded])[:, None]
    corners = _scaled_jacobians(points, patch.cells)[0][~folded]
    best, highest = points, float(first[folded].min(initial=1.0))
    moved, unknowns = points.copy(), np.zeros(3 * int(free.sum()))

    def moved_by(unknowns: Field) -> Field:
        moved[free] = points[free] + unknowns.reshape(-1, 3)
        return moved

    for sharpness in _SHARPNESS:

        def value_gradient(unknowns: Field, sharpness: float = sharpness) -> tuple[float, Field]:
            jacobians, derivatives = _scaled_jacobians(moved_by(unknowns), patch.cells)
            lowest = jacobians[folded].min()
            shares = np.exp(sharpness * (lowest - jacobians[folded]))
            missing = np.maximum(floor - jacobians[~folded], 0.0)
            lost = np.maximum(corners - jacobians[~folded], 0.0)
            slopes = np.empty_like(jacobians)
            slopes[folded] = -shares / shares.sum()
            slopes[~folded] = -2.0 * (_FLOOR_WEIGHT * missing + _LOSS_WEIGHT * lost)
            forces = np.zeros_like(points)
            pulls = slopes[..., None, None] * derivatives
            np.add.at(forces, patch.cells[:, CORNER_NEIGHBOURS], pulls)
            np.add.at(forces, patch.cells, -pulls.sum(axis=2))
            kept = _FLOOR_WEIGHT * (missing**2).sum() + _LOSS_WEIGHT * (lost**2).sum()
            return float(np.log(shares.sum()) / sharpness - lowest + kept), forces[free].ravel()

        unknowns = minimize(value_gradient, unknowns, jac=True, method="L-BFGS-B", options={"maxiter": _STEPS}).x
        now = corner_scaled_jacobian(moved_by(unknowns), patch.cells)
        admissible = (now[~folded] > 0.0).all() and is_valid(moved, patch.cells)[valid].all()
        if admissible and now.min() > highest:
            best, highest = moved.copy(), float(now.min())
    return best


def _scaled_jacobians(points: Field, cells: Ints) -> tuple[Field, Field]:
    """(m, 8) at the corners, and their derivatives (m, 8, 3, 3) with respect to the three edges there."""
    edges = points[cells[:, CORNER_NEIGHBOURS]] - points[cells][:, :, None]
    lengths = np.maximum(np.linalg.norm(edges, axis=3), 1e-300)
    u = edges / lengths[..., None]
    cofactors = np.cross(np.roll(u, -1, axis=2), np.roll(u, -2, axis=2))
    jacobians = (u[:, :, 0] * cofactors[:, :, 0]).sum(axis=2)
    return jacobians, (cofactors - jacobians[..., None, None] * u) / lengths[..., None]
