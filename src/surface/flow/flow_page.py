"""The page of a flow, to look at in a browser."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexconformal.common import MeshError, OptionError, require_items
from hexconformal.page import Page, PageSchedule, columns_of, have_same_cells, require_places, series_page

from ..mesh import SurfaceMesh
from ..page import surface_page
from ..quality import quality
from .moment import Moment

__all__ = ["flow_page"]


def flow_page(
    moments: Iterable[Moment],
    *,
    report: Any = "",
    interfaces: Any = "auto",
    title: str = "",
    schedule: PageSchedule | None = None,
) -> Page:
    """The page of a flow: the surface at its moments, with a slider, and energy and angles over the steps.

    Parameters
    ----------
    moments
        Of one run, in their order; all that is iterated over is kept.
    report
        What the page says of it; the numbers of the last moment if it is empty.
    interfaces, title, schedule
        Of the page, as in :func:`surface.page.surface_page`. Of more frames than the schedule has room for an even
        choice is shown.

    Raises
    ------
    OptionError
        If there are no moments, what is handed in is none, or they are not in their order.
    MeshError
        If they are not all of the same surface, or points are not finite.

    Examples
    --------
    >>> from surface import MeanCurvature, evolve
    >>> tetrahedron = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> flow_page(evolve(MeanCurvature(tetrahedron), steps=3))
    Page(4 cells, 4 frames)
    """
    seen = require_items("moments", moments, Moment)
    for index, moment in enumerate(seen):
        moved = moment.moved_input
        if not have_same_cells(moved, seen[0].moved_input):
            raise MeshError(f"moments must be of one run; that at index {index} is of a surface with other cells")
        require_places(moved, f"the moment at index {index}")
        if moment.record.time < seen[max(index - 1, 0)].record.time:
            raise OptionError(f"moments must be in their order; that at index {index} is earlier than the one before")
    return series_page(
        surface_page,
        [(moment.record.time, moment) for moment in seen],
        lambda moment: moment.surface_mesh,
        _conformality,
        columns_of([moment.record for moment in seen]),
        report=report or str(seen[-1].record),
        interfaces=interfaces,
        title=title,
        schedule=schedule,
    )


def _conformality(mesh: SurfaceMesh) -> dict[str, NDArray[np.float64]]:
    return {"conformality": quality(mesh).conformality}
