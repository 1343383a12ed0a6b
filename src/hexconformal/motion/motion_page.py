"""The page of a motion, to look at in a browser."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import OptionError
from ..mesh import HexMesh, MixedMesh
from ..page import Page, series_page, volume_page
from ..quality import quality
from .mesh_motion import MeshMotion
from .report import MotionStep

__all__ = ["motion_page"]


def motion_page(
    motion: MeshMotion,
    steps: Iterable[MotionStep],
    times: ArrayLike | None = None,
    *,
    report: Any = "",
    **options: Any,
) -> Page:
    """The page of a motion: the mesh after each step, with a slider, and its quality over the steps.

    Parameters
    ----------
    motion
        What moves; the mesh as it came is the first frame.
    steps
        What it has returned, in their order.
    times
        (k,) times of the k steps, increasing; 1, 2, ... where none are given.
    report
        What the page says of it; a line on each step that was refused if it is empty.
    **options
        Of the page: interfaces, title, schedule, as in :func:`hexconformal.page.volume_page`. Of more frames than it
        has room for an even choice is shown.

    Raises
    ------
    OptionError
        If times are not as many as steps, or do not increase.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((4, 4, 4))
    >>> lid = np.flatnonzero(points[:, 2] == points[:, 2].max())
    >>> motion = MeshMotion((points, cells), moving=lid)
    >>> steps = [motion.step(np.tile([x, 0.0, 0.0], (len(lid), 1))) for x in (0.1, 0.2)]
    >>> motion_page(motion, steps)
    Page(64 cells, 3 frames)
    """
    steps = list(steps)
    at = np.arange(1.0, len(steps) + 1.0) if times is None else np.asarray(times, dtype=np.float64)
    if at.shape != (len(steps),) or not (np.diff(at, prepend=0.0) > 0.0).all():
        raise OptionError(f"times must be {len(steps)}, one for each step, above 0 and increasing")
    reports = [step.report for step in steps]
    refused = [f"step {number}: {one.reason}" for number, one in enumerate(reports, 1) if one.refused]
    return series_page(
        volume_page,
        [
            (0.0, motion.mesh),
            *((time, motion.mesh.replaced(step.points)) for time, step in zip(at, steps, strict=True)),
        ],
        lambda mesh: mesh,
        _scaled_jacobian,
        {
            "step": np.arange(1.0, len(steps) + 1.0),
            "time": at,
            "min_scaled_jacobian": np.array([one.min_scaled_jacobian for one in reports]),
            "mean_scaled_jacobian": np.array([one.mean_scaled_jacobian for one in reports]),
            "iterations": np.array([float(one.iterations) for one in reports]),
        },
        report=report or "\n".join(refused),
        **options,
    )


def _scaled_jacobian(mesh: HexMesh | MixedMesh) -> dict[str, NDArray[np.float64]]:
    return {"scaled_jacobian": quality(mesh).scaled_jacobian}
