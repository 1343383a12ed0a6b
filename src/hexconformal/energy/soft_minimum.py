"""The soft minimum of the scaled Jacobian over some cells, while others keep theirs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..elements import rows_by_type
from .term import Patch, Term

__all__ = ["SoftMinimumTerm", "corner_jacobians"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class SoftMinimumTerm(Term):
    """Minus the soft minimum of the scaled Jacobian over the corners of some cells, and what the others lose.

    The soft minimum is -log(sum exp(-sharpness J)) / sharpness, at most the smallest J; it is smooth where cells are
    folded, too.

    Attributes
    ----------
    cells
        (m, 8) nodes, VTK order.
    raised
        (m,) cells whose minimum is raised.
    sharpness
        How close it is to the minimum.
    kept
        (k, 8) scaled Jacobians that the others have at first.
    floor
        (k,) what they must not fall below.
    floor_weight, loss_weight
        Of the squares of what they lack of it, and of what they lose at all.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((1, 1, 1))
    >>> term = SoftMinimumTerm(cells, np.array([True]), 64.0, np.empty((0, 8)), np.empty(0), 0.0, 0.0)
    >>> round(term.value(points), 3)  # eight corners of 1
    -0.968
    """

    cells: Ints
    raised: Mask
    sharpness: float
    kept: Field
    floor: Field
    floor_weight: float
    loss_weight: float

    def value(self, points: Field) -> float:
        """Value at the points (n, 3)."""
        return self.value_gradient(points)[0]

    def value_gradient(self, points: Field) -> tuple[float, Field]:
        """Value and gradient (n, 3)."""
        jacobians, derivatives = corner_jacobians(points, self.cells)
        raised = jacobians[self.raised]
        lowest = raised.min(initial=1.0)
        shares = np.exp(self.sharpness * (lowest - raised))
        missing = np.maximum(self.floor[:, None] - jacobians[~self.raised], 0.0)
        lost = np.maximum(self.kept - jacobians[~self.raised], 0.0)
        slopes = np.empty_like(jacobians)
        slopes[self.raised] = -shares / shares.sum()
        slopes[~self.raised] = -2.0 * (self.floor_weight * missing + self.loss_weight * lost)
        forces = np.zeros_like(points)
        pulls = slopes[..., None, None] * derivatives
        corners, neighbours, _ = _corners(self.cells)
        np.add.at(forces, neighbours, pulls)
        np.add.at(forces, corners, -pulls.sum(axis=2))
        losses = self.floor_weight * (missing**2).sum() + self.loss_weight * (lost**2).sum()
        # A patch may have none of the cells that are raised.
        least = np.log(shares.sum()) / self.sharpness - lowest if shares.size else 0.0
        return float(least + losses), forces

    def restricted(self, patch: Patch) -> SoftMinimumTerm:
        """The same of the cells of a patch."""
        others = (np.cumsum(~self.raised) - 1)[patch.cells][~self.raised[patch.cells]]
        return replace(
            self,
            cells=patch.local[self.cells[patch.cells]],
            raised=self.raised[patch.cells],
            kept=self.kept[others],
            floor=self.floor[others],
        )


def corner_jacobians(points: Field, cells: Ints) -> tuple[Field, Field]:
    """(m, 8) scaled Jacobians, and their derivatives (m, 8, 3, 3) with respect to the three edges at each corner.

    Types with fewer corners have some of them several times.
    """
    corners, neighbours, ideal = _corners(cells)
    edges = points[neighbours] - points[corners][:, :, None]
    lengths = np.maximum(np.linalg.norm(edges, axis=3), 1e-300)
    u = edges / lengths[..., None]
    cofactors = np.cross(np.roll(u, -1, axis=2), np.roll(u, -2, axis=2))
    jacobians = (u[:, :, 0] * cofactors[:, :, 0]).sum(axis=2)
    derivatives = (cofactors - jacobians[..., None, None] * u) / lengths[..., None]
    return jacobians / ideal[:, None], derivatives / ideal[:, None, None, None]


def _corners(cells: Ints) -> tuple[Ints, Ints, Field]:
    """(m, 8) nodes at corners, (m, 8, 3) their neighbours, and the (m,) determinant of unit edges of the ideal."""
    corners, neighbours = np.empty((len(cells), 8), np.int64), np.empty((len(cells), 8, 3), np.int64)
    ideal = np.empty(len(cells))
    for one in rows_by_type(cells):
        table, own = one.cell_type.neighbours, one.own_nodes(cells)
        which = np.arange(8) % len(table)
        corners[one.rows], neighbours[one.rows] = own[:, which], own[:, table[which]]
        ideal[one.rows] = one.cell_type.corner_volume
    return corners, neighbours, ideal
