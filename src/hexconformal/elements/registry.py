"""The types of linear cells that there are."""

from __future__ import annotations

from .cell_type import CellType
from .hexahedron import HEXAHEDRON
from .pyramid import PYRAMID
from .tetrahedron import TETRAHEDRON
from .wedge import WEDGE

__all__ = ["CELL_TYPES"]

# By name, in the order in which reports tell of them.
CELL_TYPES: dict[str, CellType] = {one.name: one for one in (HEXAHEDRON, WEDGE, PYRAMID, TETRAHEDRON)}
