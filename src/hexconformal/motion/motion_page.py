"""The page of a motion, to look at in a browser."""

from __future__ import annotations

from collections.abc import Iterable
from reprlib import repr as shortened
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import MeshError, OptionError, array_of_numbers, require_items
from ..mesh import HexMesh, MixedMesh
from ..page import Page, PageSchedule, require_places, series_page, volume_page
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
    interfaces: Any = "auto",
    title: str = "",
    schedule: PageSchedule | None = None,
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
    interfaces, title, schedule
        Of the page, as in :func:`hexconformal.page.volume_page`. Of more frames than the schedule has room for an even
        choice is shown.

    Raises
    ------
    OptionError
        If there are no steps, or what is handed in is none; if times are not as many, or do not increase.
    MeshError
        If steps are not of that mesh, or points are not finite.

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
    if not isinstance(motion, MeshMotion) or motion.comm is not None:
        raise OptionError(f"motion must be a MeshMotion in one process, not {shortened(motion)}")
    steps = require_items("steps", steps, MotionStep)
    at = _times(times, len(steps))
    meshes = [motion.mesh, *(_after(motion, step, f"the step at index {k}") for k, step in enumerate(steps))]
    reports = [step.report for step in steps]
    refused = [f"step {number}: {one.reason}" for number, one in enumerate(reports, 1) if one.refused]
    return series_page(
        volume_page,
        list(zip([0.0, *at.tolist()], meshes, strict=True)),
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
        interfaces=interfaces,
        title=title,
        schedule=schedule,
    )


def _times(times: ArrayLike | None, count: int) -> NDArray[np.float64]:
    """(k,) times of so many steps."""
    if times is None:
        return np.arange(1.0, count + 1.0)
    at = array_of_numbers("times", times)
    if at.shape != (count,) or not np.isfinite(at).all() or not (np.diff(at, prepend=0.0) > 0.0).all():
        raise OptionError(f"times must be {count}, one for each step, above 0 and increasing")
    return at


def _after(motion: MeshMotion, step: MotionStep, name: str) -> HexMesh | MixedMesh:
    """The mesh of a motion after a step."""
    if step.points.shape != motion.mesh.points.shape:
        raise MeshError(f"{name} has points {step.points.shape}, and the mesh of the motion {motion.mesh.points.shape}")
    mesh: HexMesh | MixedMesh = motion.mesh.replaced(step.points)
    require_places(mesh, name)
    return mesh


def _scaled_jacobian(mesh: HexMesh | MixedMesh) -> dict[str, NDArray[np.float64]]:
    return {"scaled_jacobian": quality(mesh).scaled_jacobian}
