"""Every edge of a surface once, with the cells on both sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hexconformal.mesh import face_edges, unique_edges

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
    counts
        (e,) number of cells that share it: 1 on a boundary, 2 inside, more where the surface is no manifold.
    """

    nodes: Ints
    cells: Ints
    counts: Ints


def edge_table(cells: Cells) -> EdgeTable:
    """Edges of a surface, with the cells beside them."""
    pairs = np.concatenate([face_edges(cells.triangles), face_edges(cells.quads)])
    owners = np.repeat(np.arange(len(cells)), np.repeat([3, 4], [len(cells.triangles), len(cells.quads)]))
    edges = unique_edges(pairs)
    sides = np.full((len(edges.nodes), 2), -1)
    forward = pairs[:, 0] < pairs[:, 1]
    sides[edges.of_pairs[forward], 0] = owners[forward]
    sides[edges.of_pairs[~forward], 1] = owners[~forward]
    return EdgeTable(edges.nodes, sides, edges.counts)
