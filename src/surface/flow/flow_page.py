"""The page of a flow, to look at in a browser."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexconformal.common import OptionError
from hexconformal.page import Page, columns_of, series_page

from ..mesh import SurfaceMesh
from ..page import surface_page
from ..quality import quality
from .moment import Moment

__all__ = ["flow_page"]


def flow_page(
    moments: Iterable[Moment],
    *,
    report: Any = "",
    **options: Any,
) -> Page:
    """The page of a flow: the surface at its moments, with a slider, and energy and angles over the steps.

    Parameters
    ----------
    moments
        Of a run, in their order; all that is iterated over is kept.
    report
        What the page says of it; the numbers of the last moment if it is empty.
    **options
        Of the page: interfaces, title, schedule, as in :func:`surface.page.surface_page`. Of more frames than it
        has room for an even choice is shown.

    Raises
    ------
    OptionError
        If there are no moments.

    Examples
    --------
    >>> from surface import MeanCurvature, evolve
    >>> tetrahedron = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> flow_page(evolve(MeanCurvature(tetrahedron), steps=3))
    Page(4 cells, 4 frames)
    """
    seen = list(moments)
    if not seen:
        raise OptionError("moments must have at least one: the run has not begun")
    return series_page(
        surface_page,
        [(moment.record.time, moment) for moment in seen],
        lambda moment: moment.surface_mesh,
        _conformality,
        columns_of([moment.record for moment in seen]),
        report=report or str(seen[-1].record),
        **options,
    )


def _conformality(mesh: SurfaceMesh) -> dict[str, NDArray[np.float64]]:
    return {"conformality": quality(mesh).conformality}
