"""Edges of a quadrilateral surface, with the quads on both sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mesh import face_edges, unique_edges

__all__ = ["SurfaceEdges", "surface_edges"]

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class SurfaceEdges:
    """Every edge of a quadrilateral surface once.

    Attributes
    ----------
    nodes
        (e, 2) its nodes, ascending.
    of_quads
        (k, 4) the edge from node i to node i + 1 of each quad.
    smooth
        (s,) the edges with exactly two quads.
    quads
        (s, 2) those two quads.
    odd
        The other edges: borders, and edges where more than two quads meet.
    """

    nodes: Ints
    of_quads: Ints
    smooth: Ints
    quads: Ints
    odd: Ints


def surface_edges(quads: Ints) -> SurfaceEdges:
    """Find the edges of a quadrilateral surface and the quads on both sides.

    Parameters
    ----------
    quads
        (k, 4) nodes in cyclic order.

    Examples
    --------
    >>> edges = surface_edges(np.array([[0, 1, 2, 3], [1, 4, 5, 2]]))
    >>> edges.nodes[edges.smooth].tolist(), edges.quads.tolist(), len(edges.odd)
    ([[1, 2]], [[0, 1]], 6)
    """
    edges = unique_edges(face_edges(quads))
    order = np.argsort(edges.of_pairs, kind="stable")
    first = np.cumsum(edges.uses) - edges.uses
    smooth = np.flatnonzero(edges.uses == 2)
    sides = np.stack([order[first[smooth]], order[first[smooth] + 1]], axis=1) // 4
    return SurfaceEdges(edges.nodes, edges.of_pairs.reshape(-1, 4), smooth, sides, np.flatnonzero(edges.uses != 2))
