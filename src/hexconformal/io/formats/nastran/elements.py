"""Nastran's elements: their types of cells, and the order of their nodes."""

from __future__ import annotations

__all__ = ["COUPLING_CARDS", "ELEMENTS", "NODE_ORDERS", "UNSUPPORTED_SOLIDS", "ElementCard"]

from dataclasses import dataclass


@dataclass(frozen=True)
class ElementCard:
    """A card of an element.

    Attributes
    ----------
    types
        Types of cells by number of nodes.
    first
        The place of the first node among the fields.
    """

    types: dict[int, str]
    first: int = 2


_LINE = ElementCard({2: "line"})
_TRIANGLE = ElementCard({3: "triangle"})
_QUAD = ElementCard({4: "quad"})
ELEMENTS = {
    "CHEXA": ElementCard({8: "hexahedron", 20: "hexahedron20"}),
    "CPENTA": ElementCard({6: "wedge", 15: "wedge15"}),
    "CPYRAM": ElementCard({5: "pyramid", 13: "pyramid13"}),
    "CPYRA": ElementCard({5: "pyramid", 13: "pyramid13"}),
    "CTETRA": ElementCard({4: "tetra", 10: "tetra10"}),
    "CQUAD4": _QUAD,
    "CQUADR": _QUAD,
    "CSHEAR": _QUAD,
    "CQUAD8": ElementCard({4: "quad", 8: "quad8"}),
    "CQUAD": ElementCard({4: "quad", 9: "quad9"}),
    "CTRIA3": _TRIANGLE,
    "CTRIAR": _TRIANGLE,
    "CTRIA6": ElementCard({3: "triangle", 6: "triangle6"}),
    **dict.fromkeys(["CROD", "CTUBE", "CVISC", "CBAR", "CBEAM", "CBEAM3", "CBEND", "CBUSH", "CGAP"], _LINE),
    **dict.fromkeys(["CONROD", "PLOTEL"], ElementCard({2: "line"}, first=1)),
}
# Where the format has the nodes that VTK names in turn: edges upwards come before those of the top.
NODE_ORDERS = {
    "hexahedron20": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15],
    "wedge15": [*range(9), 12, 13, 14, 9, 10, 11],
}
# Cards that tie nodes together, or add something at them, and have no cells: their beginnings.
COUPLING_CARDS = (
    *("CELAS", "CDAMP", "CMASS", "CONM", "CBUSH1D", "CBUSH2D", "CFAST", "CWELD", "CSEAM", "CHBDY", "CAABSF", "GENEL"),
    *("RBAR", "RBE", "RROD", "RTRPLT", "RJOINT", "RSPLINE", "RSSCON", "MPC"),
    *("CQUADX", "CTRIAX", "CTRAX", "CRAC2D"),
)
UNSUPPORTED_SOLIDS = ("CIHEX", "CHEXCZ", "CPENTCZ", "CIFHEX", "CIFPENT", "CHEXA1", "CHEXA2", "CWEDGE", "CRAC3D")
