"""Edges of faces and cells, each of them once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["UniqueEdges", "face_edges", "unique_edges"]

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class UniqueEdges:
    """The different edges among some pairs of nodes, in ascending order.

    Attributes
    ----------
    nodes
        (e, 2) the lower id first.
    first
        (e,) the first pair that is this edge.
    of_pairs
        (k,) the edge that each pair is.
    counts
        (e,) number of pairs that are this edge.
    """

    nodes: Ints
    first: Ints
    of_pairs: Ints
    counts: Ints


def face_edges(faces: Ints) -> Ints:
    """(f k, 2) edges of faces (f, k) from each node to the next, face by face.

    Examples
    --------
    >>> face_edges(np.array([[0, 1, 2]])).tolist()
    [[0, 1], [1, 2], [2, 0]]
    """
    return np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)


def unique_edges(pairs: Ints) -> UniqueEdges:
    """Find the different edges among pairs of nodes (k, 2), whichever way they run.

    Examples
    --------
    >>> edges = unique_edges(face_edges(np.array([[0, 1, 2, 3], [1, 4, 5, 2]])))
    >>> len(edges.nodes), edges.nodes[edges.counts == 2].tolist(), edges.of_pairs[[1, 7]].tolist()
    (7, [[1, 2]], [2, 2])
    """
    low, high = np.minimum(*pairs.T), np.maximum(*pairs.T)
    width = int(high.max(initial=0)) + 1
    keys, first, inverse, counts = np.unique(
        low * width + high, return_index=True, return_inverse=True, return_counts=True
    )
    return UniqueEdges(np.stack(np.divmod(keys, width), axis=1), first, inverse, counts)
