"""The corner energy of a mesh, or of a patch of it: equations (8) and (10) to (12).

It serves where the quaternionic energy (6) is not enough: tangled cells, cells that are barely valid, and the worst
cells of an otherwise good mesh. Everything is measured at the corners, where the scaled Jacobian is.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..elements import CORNERS
from ..kernel import parallel_ranges
from ..mesh import boundary_quads
from .block_matrix import BlockMatrix, block_places
from .corner_kernels import corner_densities, corner_sums
from .volume_term import volume_sums

__all__ = ["PATCH_ROUNDING", "VOLUME_WEIGHT", "CornerEnergy", "CornerMeasures", "SurfacePenalty", "Weights"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

PATCH_ROUNDING = 2.0**-12  # of directions on a patch, in shortest edges at a node
VOLUME_WEIGHT = 6.0  # weight of the volumes of cells beside their angles, or their whole distortion


def _corner_table() -> Ints:
    """(8, 6): at each corner the neighbours along e1, e2, e3, and the signs that turn edges into derivatives."""
    neighbours = [[int(np.flatnonzero((CORNERS ^ CORNERS[q] == axis).all(axis=1))[0]) for axis in np.eye(3, dtype=int)]
                  for q in range(8)]  # fmt: skip
    return np.ascontiguousarray(np.hstack([neighbours, 1 - 2 * CORNERS]), dtype=np.int64)


_TABLE = _corner_table()
_NOTHING = np.empty((0, 3)), np.empty((0, 3, 3)), np.empty((0, 36), np.int64)


@dataclass(frozen=True)
class Weights:
    """Weights of the terms: distortion * e(f) + angle * phi(e(u)) summed over the corners, and volume over the cells.

    Equations (8), (12) and (10).

    Attributes
    ----------
    distortion
        Weight of the whole distortion, edge lengths and angles against the target.
    angle
        Weight of the angles alone: the distortion of the unit columns, edge lengths free.
    stiffness
        phi(e) = e / (1 - stiffness e): no corner gets worse than 1 / stiffness.
    eps
        Of the barrier chi_eps; 0 once nothing is folded.
    volume
        Weight of what cells pay for losing or gaining volume, equation (10).
    """

    distortion: float = 1.0
    angle: float = 0.0
    stiffness: float = 0.0
    eps: float = 0.0
    volume: float = 0.0


@dataclass(frozen=True)
class CornerMeasures:
    """Per cell: smallest corner determinant, largest densities e(f) and e(u); infinite where folded."""

    determinant: Field
    distortion: Field
    angle: Field


class SurfacePenalty(Protocol):
    """A penalty that keeps nodes of the boundary near the surface, with a limit that is never crossed."""

    def value(self, points: Field) -> float: ...
    def relative_distance(self, points: Field) -> float: ...
    def assemble(self, points: Field, gradient: Field, matrix: BlockMatrix) -> float: ...
    def restricted(self, nodes: Ints, moving: Mask, points: Field) -> SurfacePenalty: ...


@dataclass
class CornerEnergy:
    """The corner energy of cells whose nodes move in admissible directions.

    Attributes
    ----------
    cells
        (m, 8) nodes.
    inverses
        Inverse target frames as in :class:`hexconformal.energy.distortion_energy.DistortionEnergy`, empty for cubes.
    projectors
        (n, 3, 3) orthogonal projections onto the admissible displacements; 0 holds a node.
    surface_penalty
        Keeps nodes of the boundary near the surface; or None.
    target_volumes
        (m,) volumes that cells should have, 0 for those without; empty for none at all.
    volume_factor
        Factor of the weight of volumes.
    rounding
        Of directions, in shortest edges at a node (see :mod:`hexconformal.solver.step_rounding`); 0 for none.
        Patches have a finer one.
    """

    cells: Ints
    inverses: Field
    projectors: Field
    surface_penalty: SurfacePenalty | None = None
    target_volumes: Field = field(default_factory=lambda: np.empty(0))
    volume_factor: float = 1.0
    rounding: float = 0.0

    @cached_property
    def _matrix(self) -> BlockMatrix:
        return BlockMatrix.of_cells(self.cells, self.free)

    @cached_property
    def _places(self) -> Ints:
        return block_places(self.cells, self.free, self._matrix)

    def value(self, points: Field, weights: Weights) -> float:
        """Energy at the points; infinite where a corner is folded, too bad, or too far from the surface."""
        total = self._sums(points, weights, None)
        if self.surface_penalty is not None and np.isfinite(total):
            total += self.surface_penalty.value(points)
        return total

    def relative_distance(self, points: Field) -> float:
        """Largest distance of the boundary from the surface, in units of its bound."""
        return 0.0 if self.surface_penalty is None else self.surface_penalty.relative_distance(points)

    def value_gradient_hessian(self, points: Field, weights: Weights) -> tuple[float, Field, BlockMatrix]:
        """Energy, gradient (n, 3), and the convex part of the Hessian; the matrix is reused by the next call."""
        gradient, matrix = np.zeros_like(points), self._matrix
        matrix.data[:] = 0.0
        total = self._sums(points, weights, gradient)
        if self.surface_penalty is not None:
            total += self.surface_penalty.assemble(points, gradient, matrix)
        return total, gradient, matrix

    def _sums(self, points: Field, weights: Weights, gradient: Field | None) -> float:
        derivatives = gradient is not None
        where = (derivatives, *((gradient, self._matrix.data, self._places) if derivatives else _NOTHING))
        settings = weights.eps, weights.distortion, weights.angle, weights.stiffness
        total = float(corner_sums(points, self.cells, _TABLE, self.inverses, *settings, *where))
        if weights.volume > 0.0 and len(self.target_volumes):
            weight = weights.volume * self.volume_factor
            total += float(volume_sums(points, self.cells, self.target_volumes, weight, *where))
        return total

    def surface_force(self, points: Field) -> tuple[float, Field]:
        """The surface penalty alone: its energy and gradient (n, 3)."""
        gradient = np.zeros_like(points)
        if self.surface_penalty is None:
            return 0.0, gradient
        return self.surface_penalty.assemble(points, gradient, self._matrix), gradient

    def measures(self, points: Field) -> CornerMeasures:
        """Figures of every cell, as the energy sees it."""
        columns = np.empty((3, len(self.cells)))
        parallel_ranges(corner_densities, len(self.cells), points, self.cells, _TABLE, self.inverses, *columns)
        return CornerMeasures(*columns)

    @cached_property
    def free(self) -> Mask:
        """(n,) nodes that can move at all."""
        return np.asarray(self.projectors.any(axis=(1, 2)))

    @cached_property
    def inner(self) -> Mask:
        """(n,) nodes inside the mesh that can move in all directions."""
        inner = (self.projectors == np.eye(3)).all(axis=(1, 2))
        inner[boundary_quads(self.cells)[0]] = False
        return np.asarray(inner)

    def restricted(self, moving: Mask, points: Field) -> tuple[CornerEnergy, Ints]:
        """The same energy with only some nodes moving: the patch's own problem, and its nodes' ids here."""
        moving = moving & self.free
        around = np.flatnonzero(moving[self.cells].any(axis=1))
        nodes = np.unique(self.cells[around])
        local = np.full(len(moving), -1)
        local[nodes] = np.arange(len(nodes))
        patch = CornerEnergy(
            local[self.cells[around]],
            self.inverses[around] if len(self.inverses) > 1 else self.inverses,
            np.where(moving[nodes, None, None], self.projectors[nodes], 0.0),
            None if self.surface_penalty is None else self.surface_penalty.restricted(nodes, moving, points),
            self.target_volumes[around] if len(self.target_volumes) else self.target_volumes,
            self.volume_factor,
            min(self.rounding, PATCH_ROUNDING),
        )
        return patch, nodes
