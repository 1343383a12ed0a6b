"""Surfaces as a kind of mesh: only what works on them loads them."""

from __future__ import annotations

import surface
from surface import plots as surface_plots
from surface.io import EXTENSIONS
from surface.page import surface_page

from .kinds import MeshKind

__all__ = ["SURFACES"]

SURFACES = MeshKind(
    measure=surface.quality,
    arrays=surface.Quality.arrays,
    write=surface.write,
    extensions=EXTENSIONS,
    histogram=surface_plots.histogram,
    before_after=surface_plots.before_after,
    worst_cells=surface_plots.worst_cells,
    worst_measure="conformality",
    page=surface_page,
    read_like=lambda path, mesh: surface.read(path),
)
