"""The distortion energy of a hexahedral mesh, equations (6) and (8), by finite elements with numerical quadrature."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from hexconformal.energy import quadrature_kernels as kernels

from ..common import OptionError
from ..elements import QUADRATURE_RULES, edge_weights, shape_gradients
from ..kernel import parallel_ranges
from ..mesh import corner_incidences, node_pattern, scalar_matrix

__all__ = ["DistortionEnergy"]

Field = NDArray[np.float64]


@dataclass(frozen=True)
class DistortionEnergy:
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
        "gauss" (2 x 2 x 2) or "corners".

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((6, 6, 6), (1.0, 1.0, 2.0))
    >>> round(DistortionEnergy(cells, len(points)).value_gradient(points)[0], 10)
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
    def _rule(self) -> tuple[Field, Field, Field, Field]:
        points, weights = QUADRATURE_RULES[self.quadrature]()
        scales = np.ones(1) if self.scales is None else self.scales
        inverses = np.empty((0, 1, 3, 3)) if self.inverses is None else np.ascontiguousarray(self.inverses)
        return edge_weights(points), weights, scales, inverses

    @cached_property
    def _incidences(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        return corner_incidences(self.cells, self.count)

    @cached_property
    def _pattern(self) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
        return node_pattern(self.cells, *self._incidences)

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
        eps = kernels.QUATERNIONIC if self.eps is None else self.eps
        parallel_ranges(
            kernels.energy_gradient,
            len(self.cells),
            points,
            self.cells,
            *self._rule,
            eps,
            energies,
            self._forces,
        )
        return energies

    def value_gradient(self, points: Field) -> tuple[float, Field]:
        """Energy at the points (n, 3) and its gradient (n, 3)."""
        energy = float(self.cell_energies(points).sum())
        return energy, self._gathered()

    def _second_product(self, points: Field, variation: Field, eps: float) -> Field:
        parallel_ranges(
            kernels.second_product, len(self.cells), points, variation, self.cells, *self._rule, eps, self._forces
        )
        return self._gathered()

    def second_product(self, points: Field, variation: Field) -> Field:
        """Exact Hessian at the points times a variation (n, 3), matrix-free."""
        return self._second_product(points, variation, kernels.QUATERNIONIC if self.eps is None else self.eps)

    def frozen_product(self, points: Field, variation: Field) -> Field:
        """Majorizing Hessian of the quaternionic energy, normals frozen at the points, times a variation."""
        return self._second_product(points, variation, kernels.FROZEN)

    def laplacian(self, scales: Field | None = None) -> sparse.csr_matrix:
        """Scalar Laplacian L on the target shapes; 8 L is the frozen Hessian for constant normals.

        Parameters
        ----------
        scales
            (m,) extra factor of each cell.
        """
        points, weights = QUADRATURE_RULES[self.quadrature]()
        inverses = np.eye(3)[None, None] if self.inverses is None else self.inverses
        matrices = np.zeros((len(inverses), 8, 8))
        for q, gradients in enumerate(shape_gradients(points)):
            b = gradients @ inverses[:, q % inverses.shape[1]]
            matrices += weights[q] * (b @ b.transpose(0, 2, 1))
        cell_scales = np.ones(1) if self.scales is None else self.scales
        scales = cell_scales if scales is None else scales * cell_scales
        return scalar_matrix(self.cells, matrices, scales, *self._incidences, self._pattern)
