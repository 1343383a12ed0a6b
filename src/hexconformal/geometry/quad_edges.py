"""Edges of a quadrilateral surface, with the quads on both sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mesh import face_edges, unique_edges

__all__ = ["QuadEdges", "quad_edges"]

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class QuadEdges:
    """Every edge of a quadrilateral surface once.

    Attributes
    ----------
    nodes
        (e, 2) its nodes, ascending.
    of_quads
        (k, 4) the edge from node i to node i + 1 of each quad.
    manifold
        (s,) the edges with exactly two quads.
    quads
        (s, 2) those two quads.
    nonmanifold
        The other edges: borders, and edges where more than two quads meet.
    """

    nodes: Ints
    of_quads: Ints
    manifold: Ints
    quads: Ints
    nonmanifold: Ints


def quad_edges(quads: Ints) -> QuadEdges:
    """Find the edges of a quadrilateral surface and the quads on both sides.

    Parameters
    ----------
    quads
        (k, 4) nodes in cyclic order.

    Examples
    --------
    >>> edges = quad_edges(np.array([[0, 1, 2, 3], [1, 4, 5, 2]]))
    >>> edges.nodes[edges.manifold].tolist(), edges.quads.tolist(), len(edges.nonmanifold)
    ([[1, 2]], [[0, 1]], 6)
    """
    table = unique_edges(face_edges(quads))
    order = np.argsort(table.of_pairs, kind="stable")
    first = np.cumsum(table.counts) - table.counts
    manifold = np.flatnonzero(table.counts == 2)
    sides = np.stack([order[first[manifold]], order[first[manifold] + 1]], axis=1) // 4
    return QuadEdges(table.nodes, table.of_pairs.reshape(-1, 4), manifold, sides, np.flatnonzero(table.counts != 2))
