"""The faces between regions of a mesh, the surface of every region, the curves where three regions meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .edges import face_edges, unique_edges
from .face_rows import turned_over
from .topology import boundary_quads, connected_components, face_table

__all__ = ["Interfaces", "curves_of", "find_interfaces", "region_surfaces", "surfaces_around"]

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Interfaces:
    """The faces between every two regions.

    Attributes
    ----------
    pairs
        (p, 2) regions that meet, the one with the smaller label first, in ascending order.
    quads
        (k, 4) faces between them, seen from outside the first region, one interface after the other.
    counts
        (p,) number of faces of each.
    """

    pairs: Ints
    quads: Ints
    counts: Ints

    @classmethod
    def of(cls, quads: Ints, one: Ints, other: Ints) -> Interfaces:
        """Those of faces (k, 4), seen from outside one region (k,), with another one (k,) behind them."""
        quads = _turned(quads, one > other)
        low, high = np.minimum(one, other), np.maximum(one, other)
        order = np.lexsort([quads[:, 2] != quads[:, 3], high, low])  # triangles first
        pairs, counts = np.unique(np.stack([low, high], axis=1), axis=0, return_counts=True)
        return cls(pairs, np.ascontiguousarray(quads[order]), counts)

    @property
    def sides(self) -> Ints:
        """(k, 2) regions on both sides of each face."""
        return np.repeat(self.pairs, self.counts, axis=0)

    @property
    def owners(self) -> Ints:
        """(k,) interface that each face belongs to."""
        return np.repeat(np.arange(len(self.pairs)), self.counts)

    def parts(self) -> list[Ints]:
        """The faces of each interface."""
        return np.split(self.quads, np.cumsum(self.counts)[:-1]) if len(self.pairs) else []

    def junction_edges(self) -> Ints:
        """(e, 2) edges on which more than one interface lies: three or more regions meet there.

        Examples
        --------
        >>> from hexconformal.generate import box
        >>> _, cells = box((2, 2, 1))
        >>> find_interfaces(cells, np.array([0, 1, 2, 2])).junction_edges()
        array([[ 4, 13]])
        """
        edges = unique_edges(face_edges(self.quads))
        owners = np.repeat(self.owners, 4)
        low, high = np.full(len(edges.nodes), len(self.pairs)), np.full(len(edges.nodes), -1)
        np.minimum.at(low, edges.of_pairs, owners)
        np.maximum.at(high, edges.of_pairs, owners)
        return edges.nodes[low != high]


def find_interfaces(cells: Ints, labels: Ints) -> Interfaces:
    """The interfaces between regions.

    Parameters
    ----------
    cells
        (m, 8) hexahedra.
    labels
        (m,) region of each, 0 or more.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> _, cells = box((3, 1, 1))
    >>> found = find_interfaces(cells, np.array([1, 0, 2]))
    >>> found.pairs.tolist(), found.quads.tolist()
    ([[0, 1], [0, 2]], [[1, 9, 13, 5], [2, 6, 14, 10]])
    """
    table = face_table(cells)
    one, other = labels[table.cells[:, 0]], labels[table.cells[:, 1]]
    between = (table.cells[:, 1] >= 0) & (one != other)
    return Interfaces.of(table.quads[between], one[between], other[between])


def curves_of(edges: Ints) -> tuple[int, Ints]:
    """Number of curves that edges make up, and the nodes where these end: where not two edges meet.

    Parameters
    ----------
    edges
        (e, 2) nodes.

    Examples
    --------
    >>> curves_of(np.array([[0, 1], [1, 2], [2, 3], [2, 4]]))
    (3, array([0, 2, 3, 4]))
    """
    ends = edges.ravel()
    order = np.argsort(ends, kind="stable")
    nodes, first, degree = np.unique(ends[order], return_index=True, return_counts=True)
    links = order[first[degree == 2][:, None] + np.arange(2)] // 2
    count = int(connected_components(links, len(edges)).max(initial=-1)) + 1 if len(edges) else 0
    return count, nodes[degree != 2]


def region_surfaces(cells: Ints, labels: Ints) -> list[Ints]:
    """The closed surface of every region: its part of the skin and its interfaces, seen from outside of it.

    Parameters
    ----------
    cells
        (m, 8) hexahedra.
    labels
        (m,) region of each, 0 to k - 1.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> _, cells = box((3, 1, 1))
    >>> [len(quads) for quads in region_surfaces(cells, np.array([0, 0, 1]))]
    [10, 6]
    """
    skin, owners = boundary_quads(cells)
    return surfaces_around(skin, labels[owners], find_interfaces(cells, labels), int(labels.max()) + 1)


def surfaces_around(skin: Ints, labels: Ints, interfaces: Interfaces, count: int) -> list[Ints]:
    """The surfaces of so many regions, from the skin (q, 4), the region (q,) of each quad, and the interfaces."""
    quads = np.concatenate([skin, interfaces.quads, turned_over(interfaces.quads)])
    owners = np.concatenate([labels, *interfaces.sides.T])
    order = np.lexsort([quads[:, 2] != quads[:, 3], owners])  # triangles first
    return np.split(quads[order], np.cumsum(np.bincount(owners, minlength=count))[:-1])


def _turned(quads: Ints, which: NDArray[np.bool_]) -> Ints:
    """Quads, some of them seen from the other side."""
    return np.where(which[:, None], turned_over(quads), quads)
