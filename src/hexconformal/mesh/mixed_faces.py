"""Faces of meshes of several types of cells, triangles and quadrilaterals, and what is connected."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .mixed_mesh import CellBlock
from .topology import FaceTable, by_first_appearance, connected_components, orientations

__all__ = ["mixed_components", "mixed_faces", "split_quads"]

Ints = NDArray[np.int64]


def mixed_faces(blocks: Sequence[CellBlock]) -> FaceTable:
    """All faces, each with the cells on its two sides; the fourth node of a triangle is -1.

    Parameters
    ----------
    blocks
        Cells by type, their nodes >= 0.

    Examples
    --------
    >>> from hexconformal.elements import PYRAMID, TETRAHEDRON
    >>> pyramid = CellBlock(PYRAMID, np.array([[0, 1, 2, 3, 4]]), np.array([0]))
    >>> table = mixed_faces([pyramid, CellBlock(TETRAHEDRON, np.array([[0, 1, 4, 5]]), np.array([1]))])
    >>> len(table.quads), table.quads[table.counts == 2], table.orientation.max()
    (8, array([[ 0,  1,  4, -1]]), np.int8(1))
    """
    three, four = (_matched(*_faces_of(blocks, corners)) for corners in (3, 4))
    return FaceTable(
        np.concatenate([np.pad(three.quads, ((0, 0), (0, 1)), constant_values=-1), four.quads]),
        np.concatenate([three.cells, four.cells]),
        np.concatenate([three.counts, four.counts]),
        np.concatenate([three.orientation, four.orientation]),
    )


def mixed_components(blocks: Sequence[CellBlock]) -> tuple[int, Ints]:
    """Pieces of a mesh that share no node: their number, and (m,) that of each cell, numbered by first appearance."""
    first = np.empty(sum(len(block.cells) for block in blocks), dtype=np.int64)
    stars = []
    for block in blocks:
        first[block.places] = block.cells[:, 0]
        stars.append(np.stack([np.repeat(block.cells[:, 0], block.cells.shape[1] - 1), block.cells[:, 1:].ravel()]).T)
    count = max(int(block.cells.max()) for block in blocks) + 1
    return by_first_appearance(connected_components(np.concatenate(stars), count)[first])


def split_quads(faces: FaceTable) -> NDArray[np.bool_]:
    """(f,) quadrilaterals on the boundary in whose place there are two triangles on the other side.

    Examples
    --------
    >>> from hexconformal.elements import PYRAMID, TETRAHEDRON
    >>> pyramid = CellBlock(PYRAMID, np.array([[0, 1, 2, 3, 4]]), np.array([0]))
    >>> below = CellBlock(TETRAHEDRON, np.array([[0, 2, 1, 5], [0, 3, 2, 5]]), np.array([1, 2]))
    >>> table = mixed_faces([pyramid, below])
    >>> table.quads[split_quads(table)]
    array([[0, 3, 2, 1]])
    """
    alone, triangles = faces.counts == 1, faces.quads[:, 3] < 0
    result = np.zeros(len(faces.counts), dtype=bool)
    quads, beside = np.flatnonzero(alone & ~triangles), np.sort(faces.quads[alone & triangles, :3], axis=1)
    if len(quads) and len(beside):
        thirds = [np.sort(faces.quads[quads][:, [i, (i + 1) % 4, (i + 2) % 4]], axis=1) for i in range(4)]
        numbers = np.unique(np.concatenate([beside, *thirds]), axis=0, return_inverse=True)[1].ravel()
        known = np.isin(numbers[len(beside) :], numbers[: len(beside)]).reshape(4, -1)
        result[quads] = (known[0] & known[2]) | (known[1] & known[3])
    return result


def _faces_of(blocks: Sequence[CellBlock], corners: int) -> tuple[Ints, Ints]:
    """Faces with so many corners, as their cells have them, and these cells."""
    nodes, owners = [np.empty((0, corners), dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for block in blocks:
        for face in block.cell_type.faces:
            if len(face) == corners:
                nodes.append(block.cells[:, list(face)])
                owners.append(block.places)
    return np.concatenate(nodes), np.concatenate(owners)


def _matched(nodes: Ints, owners: Ints) -> FaceTable:
    """Each face once, that of the cell with the smallest number first."""
    order = np.argsort(owners, kind="stable")
    nodes, owners = nodes[order], owners[order]
    _, first, inverse, counts = np.unique(
        np.sort(nodes, axis=1), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    inverse = inverse.ravel()
    across = np.full(len(first), -1)
    repeats = np.flatnonzero(first[inverse] != np.arange(len(nodes)))
    # Written backwards, so that the second owner of a crowded face stays.
    across[inverse[repeats[::-1]]] = repeats[::-1]
    inside = across >= 0
    orientation = np.zeros(len(first), dtype=np.int8)
    orientation[inside] = orientations(nodes[first[inside]], nodes[across[inside]])
    sides = np.stack([owners[first], np.where(inside, owners[across], -1)], axis=1)
    return FaceTable(nodes[first], sides, counts, orientation)
