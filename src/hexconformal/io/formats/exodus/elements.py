"""Exodus' elements: their names, the order of their nodes, and their sides."""

from __future__ import annotations

import re

from ....common import ReadError
from ....elements import SECOND_ORDER

__all__ = ["ELEMENT_NAMES", "NODE_ORDERS", "SHELLS", "SIDES", "cell_type", "side_nodes"]

# Types of cells by names of elements without their number of nodes, and by that number.
_TRIANGLE = {3: "triangle", 6: "triangle6"}
_QUAD = {4: "quad", 8: "quad8", 9: "quad9"}
_FAMILIES = {
    "SPHERE CIRCLE POINT NODE": {1: "vertex"},
    "BAR BEAM EDGE ROD TRUSS": {2: "line", 3: "line3"},
    "TRI TRIANGLE TRISHELL": _TRIANGLE,
    "QUAD": _QUAD,
    "SHELL": {**_TRIANGLE, **_QUAD},
    "TET TETRA TETRAHEDRON": {4: "tetra", 10: "tetra10"},
    "PYR PYRA PYRAMID": {5: "pyramid", 13: "pyramid13"},
    "WEDGE PENTA PRISM": {6: "wedge", 15: "wedge15"},
    "HEX HEXAHEDRON": {8: "hexahedron", 20: "hexahedron20", 27: "hexahedron27"},
}
ELEMENT_NAMES = {
    "vertex": "SPHERE",
    "line": "BAR2",
    "line3": "BAR3",
    "triangle": "TRISHELL3",
    "triangle6": "TRISHELL6",
    "quad": "SHELL4",
    "quad8": "SHELL8",
    "quad9": "SHELL9",
    "tetra": "TETRA4",
    "tetra10": "TETRA10",
    "pyramid": "PYRAMID5",
    "pyramid13": "PYRAMID13",
    "wedge": "WEDGE6",
    "wedge15": "WEDGE15",
    "hexahedron": "HEX8",
    "hexahedron20": "HEX20",
    "hexahedron27": "HEX27",
}
# Where the format has the nodes that VTK names in turn: edges upwards come before those of the top.
_EDGES = [*range(12), 16, 17, 18, 19, 12, 13, 14, 15]
NODE_ORDERS = {
    "hexahedron20": _EDGES,
    "hexahedron27": [*_EDGES, 23, 24, 25, 26, 21, 22, 20],
    "wedge15": [*range(9), 12, 13, 14, 9, 10, 11],
}

# Corners of the sides in the order in which Exodus numbers them.
_HEX = ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1), (4, 5, 6, 7))
_TET = ((0, 1, 3), (1, 2, 3), (0, 3, 2), (0, 2, 1))
SHELLS = ("triangle", "triangle6", "quad", "quad8", "quad9")
SIDES: dict[str, tuple[tuple[int, ...], ...]] = {
    **dict.fromkeys(["hexahedron", "hexahedron20", "hexahedron27"], _HEX),
    **dict.fromkeys(["tetra", "tetra10"], _TET),
    **dict.fromkeys(["pyramid", "pyramid13"], ((0, 1, 4), (1, 2, 4), (2, 3, 4), (0, 4, 3), (0, 3, 2, 1))),
    **dict.fromkeys(["wedge", "wedge15"], ((0, 1, 4, 3), (1, 2, 5, 4), (0, 3, 5, 2), (0, 2, 1), (3, 4, 5))),
    # The two faces of a shell are its first sides; those that follow are its edges.
    **dict.fromkeys(["triangle", "triangle6"], ((0, 1, 2), (0, 2, 1))),
    **dict.fromkeys(["quad", "quad8", "quad9"], ((0, 1, 2, 3), (0, 3, 2, 1))),
}
# Edges in whose middle the further nodes of a type are, in VTK's order.
_CURVED_EDGES = {
    **{name: tuple(pair for pair in between if len(pair) == 2) for name, (_, between) in SECOND_ORDER.items()},
    "triangle6": ((0, 1), (1, 2), (2, 0)),
    **dict.fromkeys(["quad8", "quad9"], ((0, 1), (1, 2), (2, 3), (3, 0))),
}
_CORNERS = {"vertex": 1, "line": 2, "triangle": 3, "quad": 4, "tetra": 4, "pyramid": 5, "wedge": 6, "hexahedron": 8}


def cell_type(name: str, nodes: int) -> tuple[str, int]:
    """The type of cell of an element, and how many of its nodes are taken: its corners, where no type has them all.

    >>> cell_type("HEX", 20), cell_type("wedge15", 15)
    (('hexahedron20', 20), ('wedge15', 15))
    """
    family = re.sub(r"[\s\d_]*$", "", name.strip().upper())
    types = next((types for names, types in _FAMILIES.items() if family in names.split()), None)
    if types is None:
        raise ReadError(f"elements of type {name!r} are not supported")
    if nodes in types:
        return types[nodes], nodes
    plain = types[min(types)]
    if plain in ("hexahedron", "wedge", "pyramid", "tetra") or nodes < min(types):
        counts = ", ".join(map(str, types))
        raise ReadError(f"elements of type {name!r} with {nodes} nodes are not supported, only with {counts}")
    return plain, _CORNERS[plain]


def side_nodes(kind: str, side: int) -> tuple[str, list[int]]:
    """The type of cell that a side of a type of cell is, and which of the nodes it has.

    >>> side_nodes("hexahedron20", 5)
    ('quad8', [4, 5, 6, 7, 12, 13, 14, 15])
    """
    corners = SIDES[kind][side]
    edges = {frozenset(edge): place for place, edge in enumerate(_CURVED_EDGES.get(kind, ()))}
    count = max(max(corners) + 1 for corners in SIDES[kind])
    pairs = zip(corners, (*corners[1:], corners[0]), strict=True) if edges else ()
    middles = [count + edges[frozenset(pair)] for pair in pairs]
    return {3: "triangle", 6: "triangle6", 4: "quad", 8: "quad8"}[len(corners) + len(middles)], [*corners, *middles]
