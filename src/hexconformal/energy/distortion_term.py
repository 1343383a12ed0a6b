"""The distortion of a hexahedral mesh, equations (6) and (8), by finite elements with numerical quadrature."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from hexconformal.energy import quadrature_kernels as kernels

from ..common import OptionError
from ..elements import QUADRATURE_RULES, are_collapsed, edge_weights, rows_by_type, shape_gradients
from ..kernel import parallel_ranges
from ..mesh import corner_incidences, node_pattern, scalar_matrix
from .block_matrix import Assembly
from .corner_term import CornerTerm, CornerWeights
from .quadrature_blocks import convex_sums
from .target import inverses_of
from .term import Patch, Term

__all__ = ["DistortionTerm"]

Field = NDArray[np.float64]

_FOLDED = 1e60  # an energy beyond this is that of a folded point, which is huge rather than not a number


@dataclass(frozen=True, eq=False)
class DistortionTerm(Term):
    """Summed conformal distortion of the planes (e1, e2), (e1, e3), (e2, e3) over hexahedral cells.

    E = sum over cells and quadrature points of w * density(J), J = dX W^-1, with the density of
    :mod:`hexconformal.kernel.distortion` (Gruber & Aulisa, volumetric remeshing).

    Attributes
    ----------
    cells
        (m, 8) nodes, VTK order.
    count
        Number of nodes n.
    scales
        (m,) weight of each cell, its volume for instance; None where every cell counts the same.
    inverses
        (1 or m, 1 or q, 3, 3) inverse of the target frame W.
    eps
        None for the quaternionic energy (6), which does not see orientation; else the eps >= 0 of the barrier
        E / chi_eps(det)^(2/3).
    quadrature
        "gauss" (2 x 2 x 2) or "corners"; with eps only the latter where cells of other types are collapsed hexahedra.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((6, 6, 6), (1.0, 1.0, 2.0))
    >>> round(DistortionTerm(cells, len(points)).value_gradient(points)[0], 10)
    24.0
    """

    cells: NDArray[np.int64]
    count: int
    scales: Field | None = None
    inverses: Field | None = None
    eps: float | None = None
    quadrature: str = "gauss"

    def __post_init__(self) -> None:
        if self.quadrature not in QUADRATURE_RULES:
            raise OptionError(f"quadrature must be 'gauss' or 'corners', not {self.quadrature!r}")

    @cached_property
    def _of_types(self) -> CornerTerm | None:
        """What is eight times the same, and knows the corners of other types; None where there are none."""
        if not are_collapsed(self.cells).any():
            return None
        if self.eps is None or self.quadrature != "corners":
            raise OptionError("cells of other types than hexahedra are measured at corners, by the barrier alone")
        inverses = np.empty((0, 1, 3, 3)) if self.inverses is None else self.inverses
        scales = np.empty(0) if self.scales is None else self.scales * np.ones(len(self.cells))
        return CornerTerm(self.cells, inverses, CornerWeights(eps=self.eps), scales)

    @cached_property
    def _rule(self) -> tuple[Field, Field, Field, Field]:
        points, weights = QUADRATURE_RULES[self.quadrature]()
        scales = np.ones(1) if self.scales is None else self.scales
        inverses = np.empty((0, 1, 3, 3)) if self.inverses is None else np.ascontiguousarray(self.inverses)
        return edge_weights(points), weights, scales, inverses

    @property
    def _kind(self) -> float:
        """The eps of the compiled loops."""
        return kernels.QUATERNIONIC if self.eps is None else self.eps

    @cached_property
    def _incidences(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        return corner_incidences(self.cells, self.count)

    @cached_property
    def _forces(self) -> Field:
        return np.empty((len(self.cells), 8, 3))

    def _gathered(self) -> Field:
        out = np.empty((self.count, 3))
        parallel_ranges(kernels.gather, self.count, *self._incidences, self._forces.reshape(-1, 3), out)
        return out

    def cell_energies(self, points: Field) -> Field:
        """Energy (m,) of every cell at the points (n, 3)."""
        energies = np.empty(len(self.cells))
        parallel_ranges(
            kernels.energy_gradient,
            len(self.cells),
            points,
            self.cells,
            *self._rule,
            self._kind,
            energies,
            self._forces,
        )
        return energies

    def value(self, points: Field) -> float:
        """Energy at the points (n, 3); infinite where a quadrature point is folded and the energy is a barrier."""
        if self._of_types is not None:
            return self._of_types.value(points) / 8.0
        total = float(self.cell_energies(points).sum())
        return total if total < _FOLDED else float("inf")

    def value_gradient(self, points: Field) -> tuple[float, Field]:
        """Energy at the points (n, 3) and its gradient (n, 3)."""
        if self._of_types is not None:
            energy, gradient = self._of_types.value_gradient(points)
            return energy / 8.0, gradient / 8.0
        return self.value(points), self._gathered()

    def _second_product(self, points: Field, variation: Field, eps: float) -> Field:
        parallel_ranges(
            kernels.second_product, len(self.cells), points, variation, self.cells, *self._rule, eps, self._forces
        )
        return self._gathered()

    def second_product(self, points: Field, variation: Field) -> Field:
        """Exact Hessian at the points times a variation (n, 3), matrix-free."""
        return self._second_product(points, variation, self._kind)

    def frozen_product(self, points: Field, variation: Field) -> Field:
        """Majorizing Hessian of the quaternionic energy, normals frozen at the points, times a variation."""
        if self.eps is not None:
            return self.second_product(points, variation)
        return self._second_product(points, variation, kernels.FROZEN)

    def add_convex(self, points: Field, gradient: Field, assembly: Assembly) -> tuple[float, Term]:
        """Add gradient and convex blocks, equation (11); of the quaternionic energy the frozen ones, equation (5)."""
        _, weights, scales, inverses = self._rule
        shapes = shape_gradients(QUADRATURE_RULES[self.quadrature]()[0])
        value = assembly.chunks.total(
            convex_sums, points, self.cells, shapes, weights, scales, inverses, self._kind,
            gradient, assembly.matrix.data, assembly.places,
        )  # fmt: skip
        return value, self

    def scaled(self, factor: float) -> DistortionTerm:
        """The same with every cell counting more."""
        return replace(self, scales=factor * (np.ones(1) if self.scales is None else self.scales))

    def of_cells(self, cells: NDArray[np.int64]) -> DistortionTerm:
        """The same of some of the cells (ids)."""
        scales = self.scales if self.scales is None or len(self.scales) == 1 else self.scales[cells]
        inverses = self.inverses if self.inverses is None or len(self.inverses) == 1 else self.inverses[cells]
        return replace(self, cells=np.ascontiguousarray(self.cells[cells]), scales=scales, inverses=inverses)

    def restricted(self, patch: Patch) -> DistortionTerm:
        """The same of the cells of a patch."""
        part = self.of_cells(patch.cells)
        return replace(part, cells=patch.local[part.cells], count=len(patch.nodes))

    def laplacian(self, scales: Field | None = None) -> scipy.sparse.csr_matrix:
        """Scalar Laplacian L on the target shapes; 8 L is the frozen Hessian for constant normals.

        Parameters
        ----------
        scales
            (m,) extra factor of each cell.
        """
        types, count = rows_by_type(self.cells), len(self.cells)
        inverses = np.empty((0, 1, 3, 3)) if self.inverses is None else self.inverses
        each = len(inverses) == count  # every cell has a matrix of its own, not that of its type
        matrices, kinds = np.zeros((count if each else len(types), 8, 8)), np.arange(count)
        for number, one in enumerate(types):
            which = one.rows if each else slice(number, number + 1)
            if not each:
                kinds[one.rows] = number
            own = inverses_of(inverses, one, count)
            own = own if len(own) else np.eye(3)[None, None]
            for q, (gradients, weight) in enumerate(zip(*one.rule(self.quadrature), strict=True)):
                b = gradients @ own[:, q % own.shape[1]]
                matrices[which] += weight * (b @ b.transpose(0, 2, 1))
        cell_scales = np.ones(1) if self.scales is None else self.scales
        scales = cell_scales if scales is None else scales * cell_scales
        pattern = node_pattern(self.cells, *self._incidences)  # not kept: large, and asked for once in most runs
        return scalar_matrix(self.cells, matrices, kinds, scales, *self._incidences, pattern)
