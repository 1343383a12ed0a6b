"""The volume term: what cells pay for losing or gaining volume, equation (10)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .block_matrix import Assembly
from .term import Patch, Term
from .volume_kernel import volume_sums

__all__ = ["VolumeTerm"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_NO_BLOCKS = np.empty((0, 3, 3)), np.empty((0, 36), np.int64)


@dataclass(frozen=True, eq=False)
class VolumeTerm(Term):
    """Sum of V / W + W / V - 2 over the cells that should have a volume W; infinite where one of them has none.

    Attributes
    ----------
    cells
        (m, 8) nodes, VTK order.
    targets
        (m,) volumes W, 0 for cells without.
    weight
        Factor of the sum.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((1, 1, 1), (1.0, 1.0, 2.0))
    >>> VolumeTerm(cells, np.array([1.0])).value(points)
    0.5
    """

    cells: Ints
    targets: Field
    weight: float = 1.0

    def value(self, points: Field) -> float:
        """Value at the points (n, 3)."""
        return self._sums(points, 0, np.empty((0, 3)), *_NO_BLOCKS)

    def value_gradient(self, points: Field) -> tuple[float, Field]:
        """Value and gradient (n, 3)."""
        gradient = np.zeros_like(points)
        return self._sums(points, 1, gradient, *_NO_BLOCKS), gradient

    def add_convex(self, points: Field, gradient: Field, assembly: Assembly) -> tuple[float, Term]:
        """Add gradient and convex blocks."""
        return self._sums(points, 2, gradient, assembly.matrix.data, assembly.places), self

    def _sums(self, points: Field, order: int, *where: Field | Ints) -> float:
        return float(volume_sums(points, self.cells, self.targets, self.weight, order, *where))

    def restricted(self, patch: Patch) -> VolumeTerm:
        """The same of the cells of a patch."""
        return replace(self, cells=patch.local[self.cells[patch.cells]], targets=self.targets[patch.cells])
