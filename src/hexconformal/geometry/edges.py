"""Every edge of a surface once, with the faces beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mesh import unique_edges
from .faces import Faces

__all__ = ["EdgeTable", "edge_table"]

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class EdgeTable:
    """Every edge of a surface once.

    Attributes
    ----------
    nodes
        (e, 2) the lower id first, ascending.
    counts
        (e,) number of faces that share it: 1 on a border, 2 inside, more where the surface is no manifold.
    of_corners
        (c,) the edge from each corner of each face to the next, as :attr:`Faces.corners` has them.
    manifold
        (s,) the edges with exactly two faces.
    sides
        (s, 2) those two faces.
    opposed
        (s,) True where the two run along it in opposite directions, as faces with the same side out do.
    """

    nodes: Ints
    counts: Ints
    of_corners: Ints
    manifold: Ints
    sides: Ints
    opposed: Mask

    def of_faces(self, faces: Faces) -> tuple[Ints, Ints]:
        """(t, 3) and (q, 4) edges of the triangles and quadrilaterals of the same faces."""
        size = faces.triangles.size
        return self.of_corners[:size].reshape(-1, 3), self.of_corners[size:].reshape(-1, 4)

    @property
    def nonmanifold(self) -> Ints:
        """The other edges: borders, and edges where more than two faces meet."""
        return np.flatnonzero(self.counts != 2)


def edge_table(faces: Faces | Ints) -> EdgeTable:
    """Find the edges of a surface and the faces beside them.

    Parameters
    ----------
    faces
        Triangles and quadrilaterals, or a table of nodes in cyclic order (f, 3) or (f, 4).

    Examples
    --------
    >>> edges = edge_table(np.array([[0, 1, 2, 3], [1, 4, 5, 2]]))
    >>> edges.nodes[edges.manifold].tolist(), edges.sides.tolist(), len(edges.nonmanifold)
    ([[1, 2]], [[0, 1]], 6)
    """
    faces = Faces.of(faces)
    corners = faces.corners
    pairs = np.stack([corners, corners[faces.around(1)]], axis=1)
    table = unique_edges(pairs)
    order = np.argsort(table.of_pairs, kind="stable")
    first = np.cumsum(table.counts) - table.counts
    manifold = np.flatnonzero(table.counts == 2)
    beside = np.stack([order[first[manifold]], order[first[manifold] + 1]], axis=1)
    opposed = pairs[beside[:, 0], 0] != pairs[beside[:, 1], 0]
    return EdgeTable(table.nodes, table.counts, table.of_pairs, manifold, faces.owners[beside], opposed)
