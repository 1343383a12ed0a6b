"""The types of cells that there are."""

from __future__ import annotations

from .cell_type import CellType
from .hexahedron import HEXAHEDRON
from .pyramid import PYRAMID
from .quadratic import QUADRATIC_TYPES
from .tetrahedron import TETRAHEDRON
from .wedge import WEDGE

__all__ = ["CELL_TYPES", "SOLID_TYPES"]

# The linear ones by name, in the order in which reports tell of them, and all.
CELL_TYPES: dict[str, CellType] = {one.name: one for one in (HEXAHEDRON, WEDGE, PYRAMID, TETRAHEDRON)}
SOLID_TYPES: dict[str, CellType] = CELL_TYPES | QUADRATIC_TYPES
