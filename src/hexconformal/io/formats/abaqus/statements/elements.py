"""Types of elements by their names in decks."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["ELEMENT_NAMES", "cell_type_of", "in_vtk_order", "written_name"]

# Type of cell by the beginning of an element's name; what follows (R, H, I, T, ...) is about its formulation.
_CELL_TYPES = {
    r"([AD]?C|F)3D8": "hexahedron",
    r"[AD]?C3D20": "hexahedron20",
    r"[AD]?C3D27": "hexahedron27",
    r"([AD]?C|F)3D4": "tetra",
    r"[AD]?C3D10": "tetra10",
    r"([AD]?C|F)3D6": "wedge",
    r"[AD]?C3D15": "wedge15",
    r"[AD]?C3D5": "pyramid",
    r"(S|CPS|CPE|CAX|M3D|R3D|SFM3D|DS)4": "quad",
    r"(S|CPS|CPE|CAX|M3D|SFM3D|DS)8": "quad8",
    r"(S|M3D)9": "quad9",
    r"(S|STRI|CPS|CPE|CAX|M3D|R3D|SFM3D|DS)3": "triangle",
    r"(STRI65|(CPS|CPE|CAX|M3D|SFM3D|S)6)": "triangle6",
    r"T[23]D2|B21|B31|B33": "line",
    r"T[23]D3|B22|B32": "line3",
}
ELEMENT_NAMES = {
    "line": "B31",
    "line3": "B32",
    "triangle": "S3",
    "triangle6": "STRI65",
    "quad": "S4",
    "quad8": "S8R",
    "quad9": "S9R5",
    "tetra": "C3D4",
    "tetra10": "C3D10",
    "wedge": "C3D6",
    "wedge15": "C3D15",
    "hexahedron": "C3D8",
    "hexahedron20": "C3D20",
}
# The same with reduced integration, as far as there are such.
_REDUCED_NAMES = {"quad": "S4R", "quad8": "S8R", "hexahedron": "C3D8R", "hexahedron20": "C3D20R"}
# Where C3D27 has the nodes that VTK names in turn: it has the centre first, then the faces in its own order.
_C3D27 = [*range(20), 26, 24, 23, 25, 21, 22, 20]


def cell_type_of(name: str) -> str | None:
    """The meshio name of an element's type of cell; None if it is not known."""
    # A further digit would make it another element.
    found = [kind for pattern, kind in _CELL_TYPES.items() if re.match(f"(?:{pattern})(?!\\d)", name.upper())]
    return found[0] if found else None


@cache
def written_name(cell_type: str, name: str) -> str:
    """What to call an element of a type of cell that was of a type with a name, with reduced integration if it had it.

    Examples
    --------
    >>> written_name("hexahedron20", "C3D8R"), written_name("hexahedron20", "C3D8"), written_name("hexahedron", "")
    ('C3D20R', 'C3D20', 'C3D8')
    """
    reduced = re.match(r"\D+(3D)?\d+R", name.upper()) is not None
    return _REDUCED_NAMES.get(cell_type, ELEMENT_NAMES[cell_type]) if reduced else ELEMENT_NAMES[cell_type]


def in_vtk_order(cell_type: str, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Nodes (k, w) of elements of a type, in VTK's order."""
    return nodes[:, _C3D27] if cell_type == "hexahedron27" else nodes
