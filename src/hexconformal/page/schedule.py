"""The numbers by which a page is kept small enough."""

from __future__ import annotations

from dataclasses import dataclass

from ..common import Schedule, tuned

__all__ = ["PageSchedule"]


@dataclass(frozen=True)
class PageSchedule(Schedule):
    """How much a page holds: a browser has to unpack and draw all of it.

    Attributes
    ----------
    most_cells
        Cells up to which a page has all of them; of larger meshes it has the cells at the boundary, the worst ones and
        those around them; of larger surfaces the worst ones and those around them, and a coarse surface in the place of
        others. At 200,000 hexahedra a page has about 20 MB, and a filter is applied in half a second.
    most_inline
        The same for pages inside notebooks, which are stored in the notebook's file: at 50,000 they have about 5 MB.
    worst
        The worst cells of each frame that pages of larger meshes have: as many as anyone looks through.
    coarse
        Triangles of that coarse surface as a share of most_cells, or most_inline: 50,000 show the shape of a scan.
    most_frames
        Frames between the first and the last one: more are thinned out evenly.
    most_places
        Nodes of all frames between the first and the last one together, of 24 bytes each, hardly compressed: 50 MB.
    bins
        Of a histogram: one is five pixels wide in the panel of a page.
    logarithmic_from
        Ratio of the largest to the smallest value of a ratio from which on its histogram is logarithmic.
    """

    most_cells: int = tuned(200_000)
    most_inline: int = tuned(50_000)
    worst: int = tuned(2000)
    coarse: float = tuned(0.25, 0.0, 1.0)
    most_frames: int = tuned(60)
    most_places: int = tuned(2_000_000)
    bins: int = tuned(60, 1)
    logarithmic_from: float = tuned(20.0, 1.0)
