"""The distortion of a mesh of quadratic cells of one type, equation (10a)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from ...elements import CellType, edge_derivatives, quadratic_rule
from ...kernel import parallel_ranges
from ...mesh import corner_incidences, node_pattern, scalar_matrix
from ..corner_term import CornerWeights
from ..quadrature_kernels import gather
from ..term import Patch, Term
from .kernel import largest_angles, quadratic_sums

__all__ = ["QuadraticTerm"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_ALONE = CornerWeights()  # the distortion
_FOLDED = 1e60  # an energy beyond this is that of a folded point, which is huge rather than not a number


@dataclass(frozen=True, eq=False)
class QuadraticTerm(Term):
    """Mean of the density (8) over the points of a quadrature, of hexahedra 27 nodes, and how uneven det J is.

    J is measured against the ideal of the type, as at corners of linear cells, and a cell counts by the volume of that.
    To raise the worst cells their angles count as well, equation (12).

    Attributes
    ----------
    cells
        (m, k) nodes, VTK order.
    cell_type
        Their type, quadratic, or linear ones beside quadratic ones.
    count
        Number of nodes n.
    boxes
        (m, 3) edge lengths, with the product one, along the axes of the ideal; None where all should be ideal.
    weights
        Of the distortion and of the angles, the stiffness of these, and eps of the barrier, as at corners of linear
        cells; angles count with eps = 0 alone.
    evenness
        Weight of (mean of d) (mean of 1 / d) - 1, d = chi_eps(det J): without it three quadratic fields that are
        conformal at the points cost nothing, beside the similarities.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON27
    >>> term = QuadraticTerm(np.arange(27)[None], HEXAHEDRON27, 27)
    >>> bool(abs(term.value(HEXAHEDRON27.ideal)) < 1e-25)
    True
    >>> round(term.value(HEXAHEDRON27.ideal * [1.0, 1.0, 2.0]), 6)
    2.519842
    """

    cells: Ints
    cell_type: CellType
    count: int
    boxes: Field | None = None
    weights: CornerWeights = _ALONE
    evenness: float = 1.0

    @cached_property
    def _incidences(self) -> tuple[Ints, Ints]:
        return corner_incidences(self.cells, self.count)

    def _sums(self, points: Field) -> tuple[float, Field]:
        energies, forces = np.empty(len(self.cells)), np.empty((*self.cells.shape, 3))
        weights, size = self.weights, self.cell_type.volume
        shares = size * self.evenness, size * weights.distortion, size * weights.angle
        numbers = weights.eps, *shares, weights.stiffness_of(self.cell_type)
        arguments = *_rule(self.cell_type), self._boxes, *numbers, energies, forces
        parallel_ranges(quadratic_sums, len(self.cells), points, self.cells, *arguments, smallest=64)
        total = float(energies.sum())
        return (total if total < _FOLDED else float("inf")), forces

    def value(self, points: Field) -> float:
        """The sum over all cells at points (n, 3); infinite where a point is folded and eps is 0."""
        return self._sums(points)[0]

    def value_gradient(self, points: Field) -> tuple[float, Field]:
        """The sum, and its gradient (n, 3)."""
        total, forces = self._sums(points)
        out = np.empty((self.count, 3))
        parallel_ranges(gather, self.count, *self._incidences, forces.reshape(-1, 3), out)
        return total, out

    def determinants(self, points: Field) -> Field:
        """(m, q) det J at the points."""
        return np.asarray(np.linalg.det(self._frames(points, _rule(self.cell_type)[0])))

    def scaled_jacobians(self, points: Field) -> Field:
        """(m,) smallest scaled Jacobian at the points."""
        edges = self._frames(points, _edges(self.cell_type))
        sizes = self.cell_type.corner_volume * np.maximum(np.linalg.norm(edges, axis=3).prod(axis=2), 1e-300)
        return np.clip((np.linalg.det(edges) / sizes).min(axis=1), -1.0, 1.0)

    def laplacian(self, points: Field) -> scipy.sparse.csr_matrix:
        """Scalar Laplacian L (n, n): 8 L is the frozen Hessian for constant normals, of ideals as large as cells."""
        table, weights = _rule(self.cell_type)
        boxes = np.ones((1, 3)) if self.boxes is None else self.boxes
        matrices = np.einsum("iaq,ibq,q,ci->cab", table, table, weights, boxes**-2.0, optimize=True)
        matrices *= self.cell_type.volume
        ends = points[self.cells[:, self.cell_type.edges]]
        squares = ((ends[:, :, 1] - ends[:, :, 0]) ** 2).sum(axis=2).mean(axis=1)
        incidences, scales = corner_incidences(self.cells, self.count), 1.0 / np.maximum(squares, 1e-300)
        kinds = np.arange(len(self.cells)) % len(matrices)
        return scalar_matrix(self.cells, matrices, kinds, scales, *incidences, node_pattern(self.cells, *incidences))

    def largest_angles(self, points: Field) -> Field:
        """(m,) largest e(u) at the points of each cell, u the unit columns of J; infinite where one is folded."""
        out = np.empty(len(self.cells))
        arguments = points, self.cells, _rule(self.cell_type)[0], self._boxes, out
        parallel_ranges(largest_angles, len(out), *arguments, smallest=64)
        return out

    @property
    def _boxes(self) -> Field:
        return np.empty((0, 3)) if self.boxes is None else self.boxes

    def restricted(self, patch: Patch) -> QuadraticTerm:
        """The same of the cells of a patch."""
        boxes = None if self.boxes is None else self.boxes[patch.cells]
        return replace(self, cells=patch.local[self.cells[patch.cells]], count=len(patch.nodes), boxes=boxes)

    def _frames(self, points: Field, table: Field) -> Field:
        """(m, q, 3, 3) what a table (3, k, q) makes of the nodes, a column in each row."""
        corners = points[self.cells] - points[self.cells[:, :1]]
        return np.einsum("iaq,mak->mqik", table, corners, optimize=True)


@cache
def _edges(cell_type: CellType) -> Field:
    """(3, k, q) what takes the nodes to the edges of the corner as which each point is measured."""
    places, corners, _ = quadratic_rule(cell_type)
    return edge_derivatives(cell_type, places, corners)


@cache
def _rule(cell_type: CellType) -> tuple[Field, Field]:
    """(3, k, q) what takes the nodes to the columns of J at the points, and (q,) weights."""
    table = np.einsum("iaq,ij->jaq", _edges(cell_type), cell_type.inverse_target)
    return np.ascontiguousarray(table), quadratic_rule(cell_type)[2]
