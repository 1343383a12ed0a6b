"""The volume term: what cells pay for losing or gaining volume, equation (10)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..kernel import CellChunks
from .block_matrix import Places
from .term import Patch, SummedTerm
from .volume_kernel import volume_sums

__all__ = ["VolumeTerm"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class VolumeTerm(SummedTerm):
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

    def _sums(
        self, chunks: CellChunks, points: Field, order: int, gradient: Field, data: Field, places: Places
    ) -> float:
        return chunks.total(volume_sums, points, self.cells, self.targets, self.weight, order, gradient, data, places)

    def restricted(self, patch: Patch) -> VolumeTerm:
        """The same of the cells of a patch."""
        return replace(self, cells=patch.local[self.cells[patch.cells]], targets=self.targets[patch.cells])
