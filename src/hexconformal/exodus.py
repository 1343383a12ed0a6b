"""What meshio leaves out of Exodus: other names of elements, and the order of nodes of higher order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

__all__ = ["NAMES", "from_vtk", "to_vtk"]

# Besides the names that meshio knows; case does not matter.
NAMES = {
    **dict.fromkeys(["TET", "TET4", "TETRA4"], "tetra"),
    **dict.fromkeys(["TET10"], "tetra10"),
    **dict.fromkeys(["PYRA", "PYRA5", "PYRAMID5"], "pyramid"),
    **dict.fromkeys(["WEDGE6"], "wedge"),
    **dict.fromkeys(["TRISHELL", "TRISHELL3", "SHELL3"], "triangle"),
    **dict.fromkeys(["TRISHELL6", "SHELL6"], "triangle6"),
    **dict.fromkeys(["BAR", "EDGE", "EDGE2", "TRUSS", "TRUSS2"], "line"),
    **dict.fromkeys(["BAR3", "EDGE3", "TRUSS3"], "line3"),
}
# Where Exodus has the nodes that VTK names in turn: the edges upwards come before those of the top.
_EDGES = [*range(12), 16, 17, 18, 19, 12, 13, 14, 15]
_ORDER = {"hexahedron20": _EDGES, "hexahedron27": [*_EDGES, 23, 24, 25, 26, 21, 22, 20]}


def to_vtk(blocks: list[Any]) -> list[Any]:
    """Blocks of cells as meshio read them, in VTK's order of nodes."""
    return _permuted(blocks, _ORDER)


def from_vtk(blocks: list[Any]) -> list[Any]:
    """Blocks of cells as meshio is to write them, in the order that Exodus has."""
    return _permuted(blocks, {name: np.argsort(order).tolist() for name, order in _ORDER.items()})


def _permuted(blocks: list[Any], orders: Mapping[str, list[int]]) -> list[Any]:
    import meshio

    return [
        meshio.CellBlock(block.type, block.data[:, orders[block.type]], block.tags) if block.type in orders else block
        for block in blocks
    ]
