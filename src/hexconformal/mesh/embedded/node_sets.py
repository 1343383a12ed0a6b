"""What sets of nodes say about the geometry of a mesh."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...elements import EDGES, FACES
from ..adjacency import corner_incidences
from ..edges import face_edges
from .row_matching import parts_within, same_rows

__all__ = ["NodeSetParts", "NodeSets", "most_single_nodes"]

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def most_single_nodes(count: int) -> int:
    """How many nodes of so many may count as single ones, that are held: a layer of a cube, or the corners of a cell.

    >>> most_single_nodes(12), most_single_nodes(1000)
    (8, 100)
    """
    return max(round(count ** (2 / 3)), 8)


def _none(width: int) -> Ints:
    return np.empty((0, width), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class NodeSetParts:
    """What a set of nodes is made of.

    Attributes
    ----------
    faces
        (k, 4) faces, on the boundary and inside, whose four nodes are in the set.
    edges
        (e, 2) edges on the boundary that join other nodes of the set to curves.
    held
        (h,) single nodes.
    scattered
        Number of nodes that are too many to be single ones.
    """

    faces: Ints = field(default_factory=lambda: _none(4))
    edges: Ints = field(default_factory=lambda: _none(2))
    held: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    scattered: int = 0


class NodeSets:
    """Finds what sets of nodes are made of, each in time that goes with its size.

    Parameters
    ----------
    cells
        (m, 8) hexahedra.
    skin
        (q, 4) boundary quads.
    count
        Number of nodes n.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh import boundary_quads
    >>> points, cells = box((2, 2, 2))
    >>> sets = NodeSets(cells, boundary_quads(cells)[0], len(points))
    >>> floor, centre = points[:, 2] == 0, (points == 0.5).all(axis=1)
    >>> len(sets.parts(floor).faces), sets.parts(centre).held
    (4, array([13]))
    """

    def __init__(self, cells: Ints, skin: Ints, count: int) -> None:
        self._cells, self._skin = cells, skin
        self._around_cells = corner_incidences(cells, count)
        self._around_skin = corner_incidences(skin, count)
        self._used = np.diff(self._around_cells[0]) > 0
        self._most = most_single_nodes(int(np.count_nonzero(self._used)))

    def parts(self, members: Mask) -> NodeSetParts:
        """What a set (n,) is made of.

        A set of all nodes says nothing. One that holds whole cells is a region, or a choice of nodes by a box: what it
        says are its faces on the boundary, and so does one with too many scattered nodes. Otherwise faces
        and, of the nodes that no face has, edges on the boundary and single nodes count; nodes that an edge joins to
        a face of the set are the fringe of a choice, and say nothing.
        """
        inside = members & self._used
        ids = np.flatnonzero(inside)
        if len(ids) == np.count_nonzero(self._used):
            return NodeSetParts()
        near, counts = _around(self._around_cells, ids, 8)
        quads, corners = _around(self._around_skin, ids, 4)
        on_skin = self._skin[quads[corners == 4]]
        if (counts == 8).any():
            return NodeSetParts(on_skin)
        faces = parts_within(self._cells[near], FACES, inside)
        loose = inside.copy()
        loose[faces] = False
        if not loose.any():
            return NodeSetParts(faces)
        fringe = np.zeros(len(loose), dtype=bool)
        joined = parts_within(self._cells[near], EDGES, inside)
        fringe[joined[loose[joined].any(axis=1) & ~loose[joined].all(axis=1)]] = True
        edges = np.sort(face_edges(self._skin[quads]), axis=1)
        edges = edges[loose[edges].all(axis=1) & ~fringe[edges].all(axis=1)]
        edges = edges[same_rows(edges) == np.arange(len(edges))]
        single = loose & ~fringe
        single[edges] = False
        held = np.flatnonzero(single)
        if len(held) > self._most:
            return NodeSetParts(on_skin, scattered=len(held))
        return NodeSetParts(faces, edges, held)


def _around(incidences: tuple[Ints, Ints], ids: Ints, width: int) -> tuple[Ints, Ints]:
    """Cells, of so many corners, at some nodes, and how many of their corners these are."""
    offsets, corners = incidences
    starts, sizes = offsets[ids], np.diff(offsets)[ids]
    places = np.repeat(starts - np.cumsum(sizes) + sizes, sizes) + np.arange(int(sizes.sum()))
    return np.unique(corners[places] // width, return_counts=True)
