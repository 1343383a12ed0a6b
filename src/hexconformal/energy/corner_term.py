"""The distortion at the corners of cells: equations (8), (11) and (12).

It serves where the quaternionic energy (6) is not enough: tangled cells, cells that are barely valid, and the worst
cells of an otherwise good mesh. Everything is measured at the corners, where the scaled Jacobian is.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..elements import CORNERS
from ..kernel import CellChunks, parallel_ranges
from .block_matrix import Places
from .corner_kernels import corner_densities, corner_fullness, corner_sums
from .term import Patch, SummedTerm

__all__ = ["CornerMeasures", "CornerTerm", "CornerWeights"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


def _corner_table() -> Ints:
    """(8, 6): at each corner the neighbours along e1, e2, e3, and the signs that turn edges into order."""
    neighbours = [[int(np.flatnonzero((CORNERS ^ CORNERS[q] == axis).all(axis=1))[0]) for axis in np.eye(3, dtype=int)]
                  for q in range(8)]  # fmt: skip
    return np.ascontiguousarray(np.hstack([neighbours, 1 - 2 * CORNERS]), dtype=np.int64)


_TABLE = _corner_table()


@dataclass(frozen=True)
class CornerWeights:
    """Weights of what is summed over the corners, equations (8), (12) and (12a).

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
    proportion
        Weight of the proportions of edges that meet.
    """

    distortion: float = 1.0
    angle: float = 0.0
    stiffness: float = 0.0
    eps: float = 0.0
    proportion: float = 0.0


@dataclass(frozen=True)
class CornerMeasures:
    """Per cell: what its corners have.

    Attributes
    ----------
    determinant
        (m,) smallest det f.
    fullness
        (m,) smallest det f / (|f|^2 / 3)^(3/2), 1 for a cube, next to nothing for what has next to no volume.
    slenderness
        (m,) largest ratio of the lengths of two columns of f; infinite where one has no length.
    distortion, angle
        (m,) largest densities e(f) and e(u); infinite where folded.
    """

    determinant: Field
    fullness: Field
    slenderness: Field
    distortion: Field
    angle: Field


@dataclass(frozen=True, eq=False)
class CornerTerm(SummedTerm):
    """Distortion and angles at the corners of cells; infinite where one is folded, or worse than the stiffness allows.

    Attributes
    ----------
    cells
        (m, 8) nodes, VTK order.
    inverses
        Inverse target frames as in :class:`hexconformal.energy.distortion_term.DistortionTerm`, empty for cubes.
    weights
        Weights of the two.
    scales
        (m,) weight of each cell; empty where every cell counts the same.
    slender
        (m,) slenderness of each cell up to which its proportions cost nothing; empty where they never cost anything.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((6, 6, 6), (1.0, 1.0, 2.0))
    >>> round(CornerTerm(cells, np.empty((0, 1, 3, 3))).value(points) / 8, 10)  # every corner counts 1
    544.2858935546
    """

    cells: Ints
    inverses: Field
    weights: CornerWeights = CornerWeights()
    scales: Field = field(default_factory=lambda: np.empty(0))
    slender: Field = field(default_factory=lambda: np.empty(0))

    def _sums(
        self, chunks: CellChunks, points: Field, order: int, gradient: Field, data: Field, places: Places
    ) -> float:
        w = self.weights
        settings = self.scales, w.eps, w.distortion, w.angle, w.stiffness, w.proportion, self.slender, order
        where = gradient, data, places
        return chunks.total(corner_sums, points, self.cells, _TABLE, self.inverses, *settings, *where)

    def restricted(self, patch: Patch) -> CornerTerm:
        """The same of the cells of a patch."""
        inverses = self.inverses[patch.cells] if len(self.inverses) > 1 else self.inverses
        scales = self.scales[patch.cells] if len(self.scales) else self.scales
        slender = self.slender[patch.cells] if len(self.slender) else self.slender
        cells = patch.local[self.cells[patch.cells]]
        return replace(self, cells=cells, inverses=inverses, scales=scales, slender=slender)

    def measures(self, points: Field) -> CornerMeasures:
        """Figures of every cell, weights aside."""
        columns = np.empty((5, len(self.cells)))
        parallel_ranges(corner_densities, len(self.cells), points, self.cells, _TABLE, self.inverses, *columns)
        return CornerMeasures(*columns)

    def fullness(self, points: Field) -> Field:
        """(m,) that of :class:`CornerMeasures` alone, in less than half of the time."""
        out = np.empty(len(self.cells))
        parallel_ranges(corner_fullness, len(out), points, self.cells, _TABLE, self.inverses, out)
        return out
