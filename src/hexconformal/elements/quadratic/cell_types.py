"""The types of quadratic cells, nodes in VTK's order: corners, middles of edges, and of some those of faces and cell.

A cell of any type is a hexahedron of 27 nodes, some of which coincide where it is not one: all of them are combinations
of its own, equation (13d), so that what holds for 27 nodes holds for all types.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..cell_type import CellType
from ..collapsed import COLLAPSED
from ..hexahedron import CORNERS, FACES, HEXAHEDRON, trilinear_shapes
from ..pyramid import PYRAMID
from ..tetrahedron import TETRAHEDRON
from ..wedge import WEDGE

__all__ = [
    "BETWEEN",
    "FULL_TYPES",
    "HEXAHEDRON20",
    "HEXAHEDRON27",
    "LATTICE",
    "PYRAMID13",
    "PYRAMID14",
    "QUADRATIC_TYPES",
    "SECOND_ORDER",
    "TETRAHEDRON10",
    "WEDGE15",
    "WEDGE18",
    "between",
    "edge_nodes",
    "from_nodes",
    "means_of_corners",
    "quadratic_type",
    "reference_nodes",
]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

# The corners that each of the further nodes of a hexahedron lies between.
_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
BETWEEN = (*_EDGES, *(tuple(face) for face in FACES.tolist()), tuple(range(8)))

# Twice the coordinates in the unit cube of the 27 nodes.
LATTICE = np.array([*(2 * CORNERS), *(2 * CORNERS[list(among)].sum(axis=0) // len(among) for among in BETWEEN)])
LATTICE.setflags(write=False)

# Types by their meshio names: the linear one of their corners, and these of each further node in VTK's order.
_WEDGE = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
_PYRAMID = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)]
SECOND_ORDER: dict[str, tuple[str, tuple[tuple[int, ...], ...]]] = {
    "hexahedron20": ("hexahedron", tuple(_EDGES)),
    "hexahedron27": ("hexahedron", BETWEEN),
    "wedge15": ("wedge", tuple(_WEDGE)),
    "wedge18": ("wedge", (*_WEDGE, (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))),
    "pyramid13": ("pyramid", tuple(_PYRAMID)),
    "pyramid14": ("pyramid", (*_PYRAMID, (0, 1, 2, 3))),
    "tetra10": ("tetra", ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))),
}


def _quadratic(linear: CellType, nodes: int, vtk: int) -> CellType:
    among = [frozenset(one) for one in SECOND_ORDER[f"{linear.name}{nodes}"][1]]
    there = [len(linear.mirrored) + among.index(frozenset(linear.mirrored[a] for a in one)) for one in among]
    return replace(
        linear,
        name=f"{linear.name}{nodes}",
        singular=f"{linear.singular} of {nodes} nodes",
        plural=f"{linear.plural} of {nodes} nodes",
        vtk=vtk,
        ideal=np.concatenate([linear.ideal, [linear.ideal[list(one)].mean(axis=0) for one in among]]),
        mirrored=(*linear.mirrored, *there),
        straight=linear,
    )


HEXAHEDRON20, HEXAHEDRON27 = _quadratic(HEXAHEDRON, 20, 25), _quadratic(HEXAHEDRON, 27, 29)
WEDGE15, WEDGE18 = _quadratic(WEDGE, 15, 26), _quadratic(WEDGE, 18, 32)
PYRAMID13, PYRAMID14 = _quadratic(PYRAMID, 13, 27), _quadratic(PYRAMID, 14, 0)
TETRAHEDRON10 = _quadratic(TETRAHEDRON, 10, 24)
QUADRATIC_TYPES = {
    one.name: one
    for one in (HEXAHEDRON20, HEXAHEDRON27, WEDGE15, WEDGE18, PYRAMID13, PYRAMID14, TETRAHEDRON10)
}  # fmt: skip

# Of each linear type the quadratic one with a node for all products of two of its shape functions.
FULL_TYPES = {HEXAHEDRON: HEXAHEDRON27, WEDGE: WEDGE18, PYRAMID: PYRAMID14, TETRAHEDRON: TETRAHEDRON10}


def quadratic_type(cell_type: CellType, nodes: int) -> CellType:
    """The type of second order with the corners of a linear one that belongs beside hexahedra of 20 or 27 nodes.

    Examples
    --------
    >>> quadratic_type(WEDGE, 20), quadratic_type(WEDGE, 27)
    (CellType('wedge15'), CellType('wedge18'))
    """
    full = FULL_TYPES[cell_type]
    edges = cell_type.corners + len(cell_type.edges)
    return full if nodes == len(HEXAHEDRON27.nodes) else QUADRATIC_TYPES[f"{cell_type.name}{edges}"]


def between(cell_type: CellType) -> tuple[tuple[int, ...], ...]:
    """The corners that each of the further nodes of a type lies between, none of a linear one.

    Examples
    --------
    >>> between(TETRAHEDRON10)
    ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
    """
    return SECOND_ORDER[cell_type.name][1] if cell_type.straight else ()


@cache
def edge_nodes(cell_type: CellType) -> Ints:
    """(e, 3) ends and middle of each edge of a quadratic type, in the order of the edges of the linear one.

    Examples
    --------
    >>> edge_nodes(TETRAHEDRON10).tolist()
    [[0, 1, 4], [0, 2, 6], [0, 3, 7], [1, 2, 5], [1, 3, 8], [2, 3, 9]]
    """
    among = [set(one) for one in between(cell_type)]
    found = [[a, b, cell_type.corners + among.index({a, b})] for a, b in cell_type.edges.tolist()]
    nodes = np.array(found, dtype=np.int64)
    nodes.setflags(write=False)
    return nodes


@cache
def means_of_corners(cell_type: CellType) -> Field:
    """(k, c) shares of the corners in the nodes of cells of a type with straight edges."""
    corners = np.eye(cell_type.corners)
    shares = np.array([*corners, *(corners[list(among)].mean(axis=0) for among in between(cell_type))])
    shares.setflags(write=False)
    return shares


def reference_nodes(cell_type: CellType) -> Field:
    """(k, 3) reference coordinates of the nodes of a type.

    Examples
    --------
    >>> reference_nodes(TETRAHEDRON10)[[3, 4, 9]].tolist()
    [[0.0, 0.0, 1.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.5]]
    """
    return means_of_corners(cell_type) @ cell_type.reference_corners


@cache
def from_nodes(cell_type: CellType) -> Field:
    """(27, k) matrix that takes the nodes of a type to the 27 of a hexahedron, of which some coincide.

    Examples
    --------
    >>> from_nodes(HEXAHEDRON20).shape
    (27, 20)
    >>> np.unique(from_nodes(HEXAHEDRON20)[20:]).tolist()  # faces and centre
    [-0.25, 0.0, 0.25, 0.5]
    >>> np.unique(from_nodes(HEXAHEDRON)[8:]).tolist()  # edges, faces and centre
    [0.0, 0.125, 0.25, 0.5]
    >>> from_nodes(TETRAHEDRON10)[7].tolist()  # a corner of the hexahedron
    [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    """
    linear = np.zeros((27, cell_type.corners))
    np.add.at(linear.T, np.array(COLLAPSED[cell_type.linear.name]), trilinear_shapes(LATTICE / 2.0).T)
    matrix = linear
    if cell_type.straight:
        full = FULL_TYPES[cell_type.straight]
        # A polynomial that is a sum of products of two linear shape functions is told by its values at all nodes.
        shares = _products_of_two(linear) @ np.linalg.pinv(_products_of_two(means_of_corners(full)))
        matrix = np.rint(64.0 * shares) / 64.0 @ _completed(cell_type, full)
    matrix.setflags(write=False)
    return matrix


def _products_of_two(values: Field) -> Field:
    first, second = np.triu_indices(values.shape[1])
    return np.asarray(values[:, first] * values[:, second])


def _completed(cell_type: CellType, full: CellType) -> Field:
    """(j, k) all nodes of a type that has those of faces and cell, from those of one that has not."""
    count, edges = len(cell_type.nodes), [set(one) for one in between(cell_type) if len(one) == 2]
    matrix = np.eye(len(full.nodes))[:, :count]
    for node, among in enumerate(between(full)[count - cell_type.corners :], start=count):
        middles = [cell_type.corners + place for place, ends in enumerate(edges) if ends <= set(among)]
        matrix[node, list(among)] = -0.25
        matrix[node, middles] = (1.0 + len(among) / 4.0) / len(middles)
    return matrix
