"""Every edge of a surface once, with the cells on both sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import Cells, Ints

__all__ = ["EdgeTable", "edge_table"]


@dataclass(frozen=True, eq=False)
class EdgeTable:
    """Every edge once.

    Attributes
    ----------
    nodes
        (e, 2) the lower id first.
    cells
        (e, 2) the cell that runs from the lower to the higher id and the one that runs back; -1 where there is none.
    uses
        (e,) number of cells that share it: 1 on a boundary, 2 inside, more where the surface is no manifold.
    """

    nodes: Ints
    cells: Ints
    uses: Ints


def edge_table(cells: Cells) -> EdgeTable:
    """Edges of a surface, with the cells beside them."""
    tails, heads, owners, start = [], [], [], 0
    for table in (cells.triangles, cells.quads):
        tails.append(table.ravel())
        heads.append(np.roll(table, -1, axis=1).ravel())
        owners.append(start + np.repeat(np.arange(len(table)), table.shape[1]))
        start += len(table)
    tail, head, owner = (np.concatenate(parts) for parts in (tails, heads, owners))
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    key = low * (int(high.max(initial=0)) + 1) + high
    _, first, inverse, uses = np.unique(key, return_index=True, return_inverse=True, return_counts=True)
    sides = np.full((len(first), 2), -1)
    forward = tail < head
    sides[inverse[forward], 0] = owner[forward]
    sides[inverse[~forward], 1] = owner[~forward]
    return EdgeTable(np.stack([low[first], high[first]], axis=1), sides, uses)
