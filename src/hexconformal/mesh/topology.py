"""Topology of meshes: shared faces, boundary, connected pieces, rings of cells.

Cells of other types are collapsed hexahedra (:mod:`hexconformal.elements.collapsed`). A triangle is a face whose last
two nodes are one; with fewer different nodes a face is none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..elements import CORNER_NEIGHBOURS, FACES, are_collapsed, cell_volumes
from ..kernel import algebra, loop
from .face_rows import triangles_first, with_last_twice
from .space import SERIAL, Space

__all__ = [
    "FaceTable",
    "boundary_quads",
    "by_first_appearance",
    "components",
    "connected_components",
    "connected_regions",
    "face_table",
    "node_rings",
]


@dataclass(frozen=True)
class FaceTable:
    """Every face of a hexahedral mesh once.

    Attributes
    ----------
    quads
        (f, 4) nodes, counter-clockwise seen from outside the first cell; triangles have their last node twice.
    cells
        (f, 2) the first cell and its neighbour across the face, -1 where there is none.
    counts
        (f,) number of cells that own the face: 1 on the boundary, 2 inside, more is non-manifold.
    orientation
        (f,) 1 where the neighbour runs round the face the other way (as it should), -1 where it runs the same
        way (one of the two cells is mirrored), 0 on the boundary or where the two disagree on the face's edges.
    """

    quads: NDArray[np.int64]
    cells: NDArray[np.int64]
    counts: NDArray[np.int64]
    orientation: NDArray[np.int8]


def boundary_quads(cells: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Faces that belong to one cell only.

    Parameters
    ----------
    cells
        (m, 8) hexahedra in VTK order, ids >= 0.

    Returns
    -------
    quads
        (k, 4) nodes, counter-clockwise seen from outside, ordered by their cell; triangles, which have their last node
        twice, come first.
    owners
        (k,) the cell each quad belongs to.

    Examples
    --------
    >>> quads, owners = boundary_quads(np.arange(8)[None])
    >>> quads[0], len(quads), owners.max()
    (array([0, 4, 7, 3]), 6, np.int64(0))
    """
    first = _first_occurrences(cells)
    faces = np.flatnonzero(np.bincount(first[first >= 0]) == 1)
    quads = _quads(cells, faces)
    order = triangles_first(quads)
    return quads[order], faces[order] // 6


def boundary_depths(
    points: NDArray[np.float64], cells: NDArray[np.int64], quads: NDArray[np.int64], owners: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(k,) mean length of the edges of its cell (k,) that lead inside from each boundary quad (k, 4).

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((1, 1, 1), (1.0, 2.0, 3.0))
    >>> boundary_depths(points, cells, *boundary_quads(cells))
    array([1., 1., 2., 2., 3., 3.])
    """
    if are_collapsed(cells[owners]).any():
        return _depths_by_volume(points, cells, quads, owners)
    around = cells[owners]
    corners = (quads[:, :, None] == around[:, None]).argmax(axis=2)
    neighbours = np.take_along_axis(around[:, None], CORNER_NEIGHBOURS[corners].reshape(len(quads), 1, 12), axis=2)
    neighbours = neighbours.reshape(len(quads), 4, 3)
    inside = ~(neighbours[..., None] == quads[:, None, None]).any(axis=3)
    nodes = np.take_along_axis(neighbours, inside.argmax(axis=2)[..., None], axis=2)[..., 0]
    return np.asarray(np.linalg.norm(points[nodes] - points[quads], axis=2).mean(axis=1))


def _depths_by_volume(
    points: NDArray[np.float64], cells: NDArray[np.int64], quads: NDArray[np.int64], owners: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(k,) depths of cells of any type behind their faces: volume over area, times what cells narrow by."""
    x, cells = points[quads], cells[owners]
    areas = np.linalg.norm(np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]), axis=1) / 2.0
    triangles, pointed, others = quads[:, 2] == quads[:, 3], cells[:, 4] == cells[:, 5], are_collapsed(cells)
    factors = np.select(
        [pointed & (cells[:, 2] == cells[:, 3]), pointed & triangles, pointed, others & ~triangles],
        [3.0, 1.5, 3.0, 2.0],  # tetrahedra, sides and bases of pyramids, sides of wedges
        1.0,
    )
    return np.asarray(factors * np.abs(cell_volumes(points, cells)) / np.maximum(areas, 1e-300))


def face_table(cells: NDArray[np.int64]) -> FaceTable:
    """All faces, each with the cells on its two sides.

    Parameters
    ----------
    cells
        (m, 8) hexahedra in VTK order, ids >= 0.

    Examples
    --------
    >>> two = np.array([[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10, 11]])
    >>> table = face_table(two)
    >>> len(table.quads), table.cells[table.counts == 2], table.orientation.max()
    (11, array([[0, 1]]), np.int8(1))
    """
    first = _first_occurrences(cells)
    counts = np.bincount(first[first >= 0])
    faces = np.flatnonzero(counts)
    repeats = np.flatnonzero((first != np.arange(len(first))) & (first >= 0))
    # Written backwards, so that the second owner of a crowded face stays.
    across = np.full(len(first), -1)
    across[first[repeats[::-1]]] = repeats[::-1]
    across = across[faces]
    counts = counts[faces]
    del first, repeats
    quads = _quads(cells, faces)
    inside = across >= 0
    owners = np.stack([faces // 6, np.where(inside, across // 6, -1)], axis=1)
    orientation = np.zeros(len(faces), dtype=np.int8)
    orientation[inside] = _orientations(quads[inside], _quads(cells, across[inside]))
    return FaceTable(quads, owners, counts, orientation)


def components(cells: NDArray[np.int64]) -> tuple[int, NDArray[np.int64]]:
    """Pieces of the mesh that share no node.

    Parameters
    ----------
    cells
        (m, 8) hexahedra, ids >= 0.

    Returns
    -------
    count
        Number of pieces.
    labels
        (m,) piece of each cell, numbered by first appearance.

    Examples
    --------
    >>> components(np.array([np.arange(8), np.arange(8, 16)]))
    (2, array([0, 1]))
    """
    # A star at the first node of each cell connects its eight nodes.
    star = np.stack([np.repeat(cells[:, 0], 7), cells[:, 1:].ravel()]).T
    labels = connected_components(star, int(cells.max()) + 1)
    return by_first_appearance(labels[cells[:, 0]])


def connected_components(pairs: NDArray[np.integer], count: int) -> NDArray[np.int64]:
    """The connected pieces of a graph.

    Parameters
    ----------
    pairs
        (k, 2) vertices that an edge connects.
    count
        Number of vertices.

    Returns
    -------
    (count,) piece of each vertex, numbered by first appearance.

    Examples
    --------
    >>> connected_components(np.array([[3, 1], [4, 0]]), 5)
    array([0, 1, 2, 1, 0])
    """
    from scipy.sparse import csgraph, csr_array

    # 32 bits are what the graph routines work in.
    rows, columns = pairs.T.astype(np.int32 if count < 2**31 else np.int64, copy=False)
    graph = csr_array((np.ones(len(pairs)), (rows, columns)), shape=(count, count))
    return csgraph.connected_components(graph, directed=False)[1].astype(np.int64)


def by_first_appearance(labels: NDArray[np.integer]) -> tuple[int, NDArray[np.int64]]:
    """Number of different labels, and the labels numbered in the order in which they come first.

    Examples
    --------
    >>> by_first_appearance(np.array([7, 3, 7, 5]))
    (3, array([0, 1, 0, 2]))
    """
    names, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(names), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(names))
    return len(names), rank[inverse]


def connected_regions(cells: NDArray[np.int64], nodes: NDArray[np.bool_]) -> list[NDArray[np.bool_]]:
    """Connected parts of a set of nodes; two nodes of one cell are connected.

    Parameters
    ----------
    cells
        (m, 8) hexahedra.
    nodes
        (n,) nodes of the set.

    Examples
    --------
    >>> two = np.array([[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10, 11]])
    >>> nodes = np.zeros(12, dtype=bool)
    >>> nodes[[0, 11]] = True
    >>> [np.flatnonzero(part) for part in connected_regions(two, nodes)]
    [array([0]), array([11])]
    """
    around = np.flatnonzero(nodes[cells].any(axis=1))
    corners = cells[around]
    inside = nodes[corners.ravel()]
    rows = np.repeat(np.arange(len(around)), 8)[inside]
    # A graph of the cells, and of the nodes of the set behind them.
    pairs = np.stack([rows, len(around) + corners.ravel()[inside]]).T
    labels = connected_components(pairs, len(around) + len(nodes))[: len(around)]
    count = int(labels.max(initial=-1)) + 1
    found = np.zeros((count, len(nodes)), dtype=bool)
    for label in range(count):
        found[label, corners[labels == label]] = True
    return list(found & nodes)


def node_rings(
    cells: NDArray[np.int64], count: int, seeds: NDArray[np.bool_], width: int, space: Space = SERIAL
) -> NDArray[np.bool_]:
    """(count,) nodes of the seed cells (m,) and of so many rings of cells around them."""
    nodes = np.zeros(count, dtype=bool)
    nodes[cells[seeds]] = True
    for _ in range(width):
        nodes = space.joined(nodes)
        nodes[cells[nodes[cells].any(axis=1)]] = True
    return space.joined(nodes)


def _quads(cells: NDArray[np.int64], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    # Face number 6 c + f is face f of cell c.
    places = FACES[faces % 6]
    places += (faces // 6 * 8)[:, None]
    return with_last_twice(np.take(cells.reshape(-1), places))


@loop
def _find_first_occurrences(cells, faces, heads, following, first):  # type: ignore[no-untyped-def]
    # heads and following chain, for every node, the different faces of which it is the smallest.
    for face in range(len(first)):
        a, b, c, d = _sorted_nodes(cells, faces, face)
        if b == c or c == d:  # fewer than three nodes
            first[face] = -1
            continue
        other = heads[b] if a < 0 else heads[a]
        while other >= 0 and (a, b, c, d) != _sorted_nodes(cells, faces, other):
            other = following[other]
        if other >= 0:
            first[face] = other
        else:
            first[face] = face
            least = b if a < 0 else a
            following[face] = heads[least]
            heads[least] = face


@algebra
def _sorted_nodes(cells, faces, face):  # type: ignore[no-untyped-def]
    cell, local = divmod(face, 6)
    a, b = cells[cell, faces[local, 0]], cells[cell, faces[local, 1]]
    c, d = cells[cell, faces[local, 2]], cells[cell, faces[local, 3]]
    a, b = min(a, b), max(a, b)
    c, d = min(c, d), max(c, d)
    low, high = max(a, c), min(b, d)
    a, b, c, d = min(a, c), min(low, high), max(low, high), max(b, d)
    # A triangle has one node twice, whichever: it counts once, behind none.
    if a == b:
        return -1, b, c, d
    if b == c:
        return -1, a, c, d
    if c == d:
        return -1, a, b, d
    return a, b, c, d


def _first_occurrences(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """For each of the 6 m faces the number of the first face with the same nodes, often its own; -1 for none."""
    first = np.empty(6 * len(cells), dtype=np.int64)
    following = np.empty(len(first), dtype=np.int64)
    heads = np.full(int(cells.max(initial=-1)) + 1, -1, dtype=np.int64)
    # Read-only arrays would be compiled for anew.
    _find_first_occurrences(np.require(cells, np.int64, ["C", "W"]), FACES, heads, following, first)
    return first


def _orientations(one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.int8]:
    """Of faces (k, 4) of the same nodes: 1 where they go round the other way, -1 the same way, 0 where not alike."""
    rows = np.arange(len(one))
    place = np.argmax(other == one[:, :1], axis=1)
    after = other[rows, (place + 1) % 4]
    after = np.where(after == one[:, 0], other[rows, (place + 2) % 4], after)  # a triangle may have a node twice
    return np.asarray(np.subtract(after == one[:, -1], after == one[:, 1], dtype=np.int8))
