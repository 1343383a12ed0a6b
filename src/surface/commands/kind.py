"""How surfaces are measured, drawn and written."""

from __future__ import annotations

from hexconformal.commands.kind import Kind

from ..io import EXTENSIONS, write
from ..plots import before_after, histogram, worst_cells
from ..quality import Quality, quality

__all__ = ["SURFACES"]

SURFACES = Kind(quality, Quality.arrays, write, EXTENSIONS, histogram, before_after, worst_cells, "conformality")
