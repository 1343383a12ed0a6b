"""How surfaces are measured, drawn and written."""

from __future__ import annotations

from surface.io import EXTENSIONS, write
from surface.plots import before_after, histogram, worst_cells
from surface.quality import Quality, quality

from .kind import Kind

__all__ = ["SURFACES"]

SURFACES = Kind(quality, Quality.arrays, write, EXTENSIONS, histogram, before_after, worst_cells, "conformality")
