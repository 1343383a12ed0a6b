"""The types of quadratic hexahedra, nodes in VTK's order: corners, middles of edges, and of 27 those of faces and cell.

A hexahedron of 20 nodes is one of 27 whose others are means of these, equation (13d), so that what holds for 27 holds
for both.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..cell_type import CellType
from ..hexahedron import CORNERS, EDGES, FACES, HEXAHEDRON

__all__ = [
    "BETWEEN",
    "EDGE_NODES",
    "HEXAHEDRON20",
    "HEXAHEDRON27",
    "LATTICE",
    "QUADRATIC_TYPES",
    "SECOND_ORDER",
    "from_nodes",
]

Field = NDArray[np.float64]

# The corners that each of the further nodes lies between.
_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
BETWEEN = (*_EDGES, *(tuple(face) for face in FACES.tolist()), tuple(range(8)))

# Twice the reference coordinates in the unit cube of the 27 nodes.
LATTICE = np.array([*(2 * CORNERS), *(2 * CORNERS[list(among)].sum(axis=0) // len(among) for among in BETWEEN)])
LATTICE.setflags(write=False)


def _quadratic(nodes: int) -> CellType:
    lattice = LATTICE[:nodes]
    upside_down = (lattice * [1, 1, -1] + [0, 0, 2])[:, None]
    return replace(
        HEXAHEDRON,
        name=f"hexahedron{nodes}",
        singular=f"hexahedron of {nodes} nodes",
        plural=f"hexahedra of {nodes} nodes",
        vtk={20: 25, 27: 29}[nodes],
        ideal=lattice / 2.0,
        mirrored=tuple((upside_down == lattice).all(axis=2).argmax(axis=1).tolist()),
    )


# Ends and middle of each edge, in the order of linear hexahedra.
EDGE_NODES = np.array(
    [[a, b, 8 + [set(edge) for edge in _EDGES].index({a, b})] for a, b in EDGES.tolist()], dtype=np.int64
)
EDGE_NODES.setflags(write=False)

HEXAHEDRON20, HEXAHEDRON27 = _quadratic(20), _quadratic(27)
QUADRATIC_TYPES = {one.name: one for one in (HEXAHEDRON20, HEXAHEDRON27)}

# Types of second order by their meshio names: the linear one of their corners, and these of each further node in VTK's
# order. Those of hexahedra alone are worked on as they are.
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


@cache
def from_nodes(cell_type: CellType) -> Field:
    """(27, k) matrix that takes the nodes of a type of hexahedra to all 27: means of nodes but for 27 themselves.

    Examples
    --------
    >>> from_nodes(HEXAHEDRON20).shape
    (27, 20)
    >>> np.unique(from_nodes(HEXAHEDRON20)[20:]).tolist()  # faces and centre
    [-0.25, 0.0, 0.25, 0.5]
    >>> np.unique(from_nodes(HEXAHEDRON)[8:]).tolist()  # edges, faces and centre
    [0.0, 0.125, 0.25, 0.5]
    """
    count = len(cell_type.nodes)
    matrix, signs = np.eye(27)[:, :count], LATTICE[:count] - 1
    for node in range(count, 27):
        place = LATTICE[node] - 1
        if count == 8:
            matrix[node] = ((1.0 + place * signs) / 2.0).prod(axis=1)
            continue
        # The shape functions of 20 nodes at the others: reference coordinates there are 0, or those of a face.
        along = signs == 0
        factors = np.where(along, 1.0 - place**2, 1.0 + place * signs).prod(axis=1)
        corner = ~along.any(axis=1)
        matrix[node] = np.where(corner, factors * ((place * signs).sum(axis=1) - 2.0) / 8.0, factors / 4.0)
    matrix.setflags(write=False)
    return matrix
