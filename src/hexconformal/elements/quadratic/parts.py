"""Quadratic hexahedra cut into parts: linear hexahedra at a grid of places on them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..hexahedron import CORNERS, EDGES, FACES

__all__ = ["CellParts", "cell_parts"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class CellParts:
    """What a cell is cut into, n parts along each edge.

    Attributes
    ----------
    places
        ((n + 1)^3, 3) reference coordinates of the nodes of the parts.
    cells
        (n^3, 8) their nodes, VTK order.
    faces
        (6, n^2, 4) parts of each face of the cell, in the order of `FACES`, counter-clockwise seen from outside.
    edges
        (12, n, 2) parts of each edge, in the order of `EDGES`.
    on_faces, on_edges
        (6, 3, 3), (12, 3, 1) the nodes of a quadratic face, or edge, line by line, where n is even.
    """

    places: Field
    cells: Ints
    faces: Ints
    edges: Ints
    on_faces: Ints
    on_edges: Ints


@cache
def cell_parts(n: int) -> CellParts:
    """The parts of a cell that is cut into n along each edge, an even number.

    Examples
    --------
    >>> parts = cell_parts(2)
    >>> parts.places.shape, parts.cells.shape, parts.faces.shape
    ((27, 3), (8, 8), (6, 4, 4))
    >>> parts.places[parts.edges[0]].tolist()
    [[[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]], [[0.5, 0.0, 0.0], [1.0, 0.0, 0.0]]]
    """
    strides = np.array([1, n + 1, (n + 1) ** 2])
    first = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = (first[:, None] + CORNERS) @ strides
    faces = []
    for face in FACES:
        axis, side = _side(face)
        faces.append(cells[first[:, axis] == side * (n - 1)][:, face])
    along = np.arange(n + 1)[:, None]
    lines = [(n * CORNERS[a] + along * (CORNERS[b] - CORNERS[a])) @ strides for a, b in EDGES]
    edges = np.array([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
    places = np.stack(np.unravel_index(np.arange((n + 1) ** 3), (n + 1,) * 3, order="F"), axis=1) / n
    halves = n // 2 * np.arange(3)
    a, b, _, d = (CORNERS[FACES[:, k]] @ strides for k in range(4))
    on_faces = n * a[:, None, None] + halves[:, None] * (b - a)[:, None, None] + halves * (d - a)[:, None, None]
    on_edges = np.array(lines)[:, halves, None]
    parts = CellParts(places, cells, np.array(faces), edges, on_faces, on_edges)
    for array in (places, cells, parts.faces, edges, on_faces, on_edges):
        array.setflags(write=False)
    return parts


def _side(face: Ints) -> tuple[int, int]:
    """The axis that is constant on a face of the unit cube, and its value there."""
    axis = int(np.flatnonzero((CORNERS[face] == CORNERS[face[0]]).all(axis=0))[0])
    return axis, int(CORNERS[face[0], axis])
