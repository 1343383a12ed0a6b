"""Quadratic cells cut into parts: linear cells that are halved again and again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..cell_type import CellType
from ..collapsed import COLLAPSED
from ..hexahedron import CORNERS, HEXAHEDRON
from ..pyramid import PYRAMID
from ..tetrahedron import TETRAHEDRON
from ..wedge import WEDGE
from .cell_types import FULL_TYPES, LATTICE, means_of_corners
from .places import in_cube

__all__ = ["CellParts", "cell_parts"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

# What a cell of each linear type is halved into, by the nodes of the quadratic type that has all of them.
_OCTANTS = [[int(np.flatnonzero((c + d == LATTICE).all(axis=1))[0]) for d in CORNERS] for c in CORNERS]
_LOW, _MIDDLE, _HIGH = (0, 1, 2, 6, 7, 8), (12, 13, 14, 15, 16, 17), (3, 4, 5, 9, 10, 11)
_TRIANGLES = (0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)
_WEDGES = [
    [layer[k] for layer in two for k in three] for two in ((_LOW, _MIDDLE), (_MIDDLE, _HIGH)) for three in _TRIANGLES
]
_PYRAMIDS = (
    *((0, 5, 13, 8, 9), (5, 1, 6, 13, 10), (13, 6, 2, 7, 11), (8, 13, 7, 3, 12)),
    *((9, 10, 11, 12, 4), (9, 12, 11, 10, 13)),
)
_BETWEEN_PYRAMIDS = (5, 13, 9, 10), (6, 13, 10, 11), (7, 13, 11, 12), (8, 13, 12, 9)
_TETRAHEDRA = (
    *((0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3)),
    *((4, 9, 5, 6), (4, 9, 6, 7), (4, 9, 7, 8), (4, 9, 8, 5)),
)
_HALVES: dict[CellType, tuple[tuple[CellType, Ints], ...]] = {
    HEXAHEDRON: ((HEXAHEDRON, np.array(_OCTANTS)),),
    WEDGE: ((WEDGE, np.array(_WEDGES)),),
    PYRAMID: ((PYRAMID, np.array(_PYRAMIDS)), (TETRAHEDRON, np.array(_BETWEEN_PYRAMIDS))),
    TETRAHEDRON: ((TETRAHEDRON, np.array(_TETRAHEDRA)),),
}


@dataclass(frozen=True, eq=False)
class CellParts:
    """What a cell of f faces and e edges is cut into, n parts along each edge, n^2 on each face.

    Attributes
    ----------
    reference
        (p, 3) reference coordinates of the nodes of the parts.
    places
        (p, 3) these in the unit cube.
    cells
        (c, 8) the nodes of the parts, of other types than hexahedra collapsed; n^3 of all types but pyramids.
    faces
        (f, n^2, 4) parts of each face of the cell, counter-clockwise seen from outside; triangles have their last node
        twice.
    edges
        (e, n, 2) parts of each edge.
    on_faces, on_edges
        (f, 3, 3), (e, 3, 1) the nodes of a quadratic face, or edge, line by line, where n is even. Of a triangle those
        of the square whose half it is: -1 where there are none.
    """

    reference: Field
    places: Field
    cells: Ints
    faces: Ints
    edges: Ints
    on_faces: Ints
    on_edges: Ints


@cache
def cell_parts(cell_type: CellType, n: int) -> CellParts:
    """The parts of a cell that is cut into n along each edge, a power of two from 2 on.

    Examples
    --------
    >>> parts = cell_parts(HEXAHEDRON, 2)
    >>> parts.places.shape, parts.cells.shape, parts.faces.shape
    ((27, 3), (8, 8), (6, 4, 4))
    >>> parts.places[parts.edges[0]].tolist()
    [[[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]], [[0.5, 0.0, 0.0], [1.0, 0.0, 0.0]]]
    >>> cell_parts(TETRAHEDRON, 4).cells.shape, cell_parts(PYRAMID, 2).cells.shape
    ((64, 8), (10, 8))
    """
    linear = cell_type.linear
    corners = n * linear.reference_corners
    typed = {linear: corners[None]}
    for _ in range(n.bit_length() - 1):
        typed = _halved(typed)
    every = np.concatenate([x.reshape(-1, 3) for x in typed.values()])
    rows, which = np.unique(every[:, ::-1], axis=0, return_inverse=True)
    lattice, cells, faces = rows[:, ::-1], [], []
    for one, nodes in zip(typed, _split(which.ravel(), typed), strict=True):
        cells.append(nodes[:, COLLAPSED[one.name]])
        own = np.zeros((len(nodes), 6, 4), dtype=np.int64)
        own[:, : len(one.faces)] = nodes[:, one.quads]
        faces.append(own)
    table = np.concatenate(cells)
    order = np.lexsort(lattice[table].sum(axis=1).T[::-1])
    outside = np.concatenate(faces)[order].reshape(-1, 4)
    numbers = {tuple(place): number for number, place in enumerate(lattice)}
    on_edges = np.array([_line(corners[a], corners[b], n, numbers) for a, b in linear.edges])
    parts = CellParts(
        lattice / n,
        in_cube(lattice / n, linear),
        table[order],
        np.array([_on_face(lattice, outside, corners[list(face)]) for face in linear.faces]),
        np.stack([on_edges[:, :-1], on_edges[:, 1:]], axis=2),
        np.array([_grid(corners[list(face)], numbers) for face in linear.faces]),
        on_edges[:, :: n // 2, None],
    )
    for array in vars(parts).values():
        array.setflags(write=False)
    return parts


def _halved(typed: dict[CellType, Field]) -> dict[CellType, Field]:
    """Corners (c, k, 3) of cells of each type, halved."""
    out: dict[CellType, list[Field]] = {}
    for one, x in typed.items():
        nodes = np.einsum("ka,car->ckr", means_of_corners(FULL_TYPES[one]), x)
        for kind, table in _HALVES[one]:
            out.setdefault(kind, []).append(nodes[:, table].reshape(-1, kind.corners, 3))
    return {kind: np.concatenate(parts) for kind, parts in out.items()}


def _split(numbers: Ints, typed: dict[CellType, Field]) -> Iterator[Ints]:
    """(c, k) numbers of the corners of the cells of each type, of those of all one after the other."""
    start = 0
    for x in typed.values():
        yield numbers[start : start + x.shape[0] * x.shape[1]].reshape(x.shape[:2])
        start += x.shape[0] * x.shape[1]


def _on_face(lattice: Field, faces: Ints, corners: Field) -> Ints:
    """The faces (k, 4) that lie in the plane of a face with these corners."""
    heights = (lattice - corners[0]) @ np.cross(corners[1] - corners[0], corners[-1] - corners[0])
    different = faces[:, 0] != faces[:, 1]
    return faces[different & (heights[faces] == 0.0).all(axis=1)]


def _line(first: Field, last: Field, n: int, numbers: dict[tuple[float, ...], int]) -> list[int]:
    """Numbers of the n + 1 places along an edge."""
    return [numbers[tuple(first + step / n * (last - first))] for step in range(n + 1)]


def _grid(corners: Field, numbers: dict[tuple[float, ...], int]) -> list[list[int]]:
    """Numbers of the nodes of a quadratic face, -1 where the square of which a triangle is half has none."""
    along, across = (0.5 * (corner - corners[0]) for corner in (corners[1], corners[-1]))
    return [[numbers.get(tuple(corners[0] + i * along + j * across), -1) for j in range(3)] for i in range(3)]
