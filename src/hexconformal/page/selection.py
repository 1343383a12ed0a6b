"""The cells that pages of large meshes have: those at the boundary, the worst ones, and those around these."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .contents import Cells

__all__ = ["cells_to_show"]

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


def cells_to_show(cells: Cells, rankings: Sequence[Floats], worst: int) -> Mask:
    """(m,) cells with a face on the boundary, the worst ones by each ranking (m,), and those with a node of these.

    Parameters
    ----------
    cells
        All of them.
    rankings
        Values of the cells in each frame, the worst being the smallest.
    worst
        How many cells of each ranking.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal import HexMesh
    >>> from hexconformal.page.volume_cells import volume_cells
    >>> kept = cells_to_show(volume_cells(HexMesh(*box((7, 7, 7)))), [np.abs(np.arange(343) - 171)], 1)
    >>> kept.sum() - (7**3 - 5**3)  # the one in the middle, and the 26 around it
    np.int64(27)
    """
    chosen = np.zeros(cells.count, dtype=bool)
    for ranking in rankings:
        chosen[np.argsort(ranking, kind="stable")[:worst]] = True
    one, other = cells.sides.T
    nodes = np.zeros(int(cells.faces.max(initial=0)) + 1, dtype=bool)
    nodes[cells.faces[chosen[one] | ((other >= 0) & chosen[other])]] = True
    around = nodes[cells.faces].any(axis=1)
    kept = chosen
    kept[one[around]] = True
    kept[other[around & (other >= 0)]] = True
    kept[one[other < 0]] = True
    return kept
