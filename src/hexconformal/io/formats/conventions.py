"""What meshio leaves out of formats: names of elements, orders of nodes that differ from VTK's, empty families."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["EXODUS_NAMES", "from_vtk_order", "med_families", "to_vtk_order", "write_med_families"]

# Besides the names that meshio knows; case does not matter.
EXODUS_NAMES = {
    **dict.fromkeys(["TET", "TET4", "TETRA4"], "tetra"),
    **dict.fromkeys(["TET10"], "tetra10"),
    **dict.fromkeys(["PYRA", "PYRA5", "PYRAMID5"], "pyramid"),
    **dict.fromkeys(["WEDGE6"], "wedge"),
    **dict.fromkeys(["TRISHELL", "TRISHELL3", "SHELL3"], "triangle"),
    **dict.fromkeys(["TRISHELL6", "SHELL6"], "triangle6"),
    **dict.fromkeys(["BAR", "EDGE", "EDGE2", "TRUSS", "TRUSS2"], "line"),
    **dict.fromkeys(["BAR3", "EDGE3", "TRUSS3"], "line3"),
}
# Where the format has the nodes that VTK names in turn. Exodus: edges upwards come before those of the top.
_EDGES = [*range(12), 16, 17, 18, 19, 12, 13, 14, 15]
# MED: solid cells are mirrored, by going round the bottom, and the top, the other way.
_ORDERS: dict[str, dict[str, list[int]]] = {
    "exodus": {"hexahedron20": _EDGES, "hexahedron27": [*_EDGES, 23, 24, 25, 26, 21, 22, 20]},
    "med": {
        "tetra": [0, 2, 1, 3],
        "tetra10": [0, 2, 1, 3, 6, 5, 4, 7, 9, 8],
        "pyramid": [0, 3, 2, 1, 4],
        "wedge": [0, 2, 1, 3, 5, 4],
        "hexahedron": [0, 3, 2, 1, 4, 7, 6, 5],
        "hexahedron20": [0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17],
    },
}


def to_vtk_order(blocks: list[Any], form: str) -> list[Any]:
    """Blocks of cells as meshio read them from a format, in VTK's order of nodes."""
    return _permuted(blocks, _ORDERS.get(form, {}))


def from_vtk_order(blocks: list[Any], form: str) -> list[Any]:
    """Blocks of cells as meshio is to write them into a format."""
    return _permuted(blocks, {name: np.argsort(order).tolist() for name, order in _ORDERS.get(form, {}).items()})


def med_families(group: Any) -> dict[int, list[str]]:
    """Names of the groups of each MED family; meshio's own stops at one that is in none, as Gmsh writes them."""
    named = {family.attrs["NUM"]: family["GRO"]["NOM"][()] if "GRO" in family else () for family in group.values()}
    return {
        number: [bytes(name.astype(np.uint8)).decode("utf-8", "surrogateescape").strip("\0 ") for name in names]
        for number, names in named.items()
    }


def write_med_families(group: Any, families: dict[int, list[str]]) -> None:
    """Write them; meshio's own spoils letters with accents."""
    for number, names in families.items():
        title = "_".join(["FAM", str(number), *names])
        family = group.create_group(title.encode("utf-8", "replace").decode())
        family.attrs.create("NUM", number)
        inside = family.create_group("GRO")
        inside.attrs.create("NBR", len(names))
        data = inside.create_dataset("NOM", (len(names),), dtype="80int8")
        for place, name in enumerate(names):
            data[place] = np.frombuffer(name.encode("utf-8", "surrogateescape")[:80].ljust(80, b"\0"), dtype=np.int8)


def _permuted(blocks: list[Any], orders: dict[str, list[int]]) -> list[Any]:
    import meshio

    return [
        meshio.CellBlock(block.type, block.data[:, orders[block.type]], block.tags) if block.type in orders else block
        for block in blocks
    ]
