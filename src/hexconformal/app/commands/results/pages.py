"""The pages that commands write: of results, and of series."""

from __future__ import annotations

import csv
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....page import Curve, Page, PageSchedule, SeriesReader, curves_of, thinned
from ....runs import frames_listed
from ..kinds import MeshKind

__all__ = ["series_page", "write_result_page"]

Columns = dict[str, NDArray[np.float64]]

_CURVES = (
    Curve("energy", ("energy",)),
    Curve("reduced volume", ("reduced_volume",)),
    Curve("smallest angle of a cell, degrees", ("mean_angle", "min_angle")),
    Curve("scaled Jacobian", ("mean_scaled_jacobian", "min_scaled_jacobian")),
    Curve("iterations of a step", ("iterations",)),
    Curve("time step", ("tau",), logarithmic=True),
)


def write_result_page(path: str, result: Any, series: str | None, kind: MeshKind) -> None:
    """Write the page of a result, with frames of the series that its run has written, if it has."""
    frames = []
    if series is not None and result.history:
        last = result.history[-1].iteration
        between = [(time, file) for time, file in frames_listed(series) if 0 < time < last]
        reader = SeriesReader(partial(_read, kind, result.before), partial(_worst, kind), _iteration)
        frames = reader.frames(thinned(between, len(result.points), PageSchedule()), result.before)
    result.page(frames).write(path)


def series_page(
    series: Path,
    kind: MeshKind,
    history: Path | None = None,
    report: Any = "",
    title: str = "",
    interfaces: Any = "auto",
) -> Page:
    """The page of a series of a mesh, with the curves of the history of its run, if there is one."""
    columns = {} if history is None else _columns(history)
    along = "iteration" if "iteration" in columns and "time" not in columns else "step"
    listed = frames_listed(series)
    (start, first), (end, last) = listed[0], listed[-1]
    mesh = kind.read_like(first, None)
    reader = SeriesReader(partial(_read, kind, mesh), partial(_worst, kind), _time, partial(_position, columns, along))
    between = thinned(listed[1:-1], len(mesh.points), PageSchedule())
    return kind.page(
        mesh,
        None if len(listed) == 1 else kind.read_like(last, mesh),
        frames=reader.frames(between, mesh),
        ends=[(_time(time), _position(columns, along, time)) for time in (start, end)],
        report=report,
        curves=curves_of(columns, along, f"{along}s", _CURVES),
        interfaces=interfaces,
        title=title or series.name,
    )


def _read(kind: MeshKind, mesh: Any, file: Path) -> Any:
    return kind.read_like(file, mesh)


def _worst(kind: MeshKind, mesh: Any) -> dict[str, Any]:
    """The measure by which cells are coloured at first."""
    if kind.worst_measure in mesh.cell_data:
        return {}
    return {kind.worst_measure: kind.arrays(kind.measure(mesh))[kind.worst_measure]}


def _iteration(time: float) -> str:
    return f"iteration {time:g}"


def _time(time: float) -> str:
    return f"t = {time:.6g}"


def _position(columns: Columns, along: str, time: float) -> float | None:
    """Where a time is on the axis of the curves: at the step that reached it."""
    if "time" not in columns or along not in columns:
        return time
    return 0.0 if time == 0.0 else float(columns[along][np.abs(columns["time"] - time).argmin()])


def _columns(history: Path) -> Columns:
    """Columns of numbers of a history."""
    with open(history, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    found = {}
    for name in rows[0] if rows else ():
        try:
            found[name] = np.array([float(row[name]) for row in rows])
        except ValueError:
            continue  # words, such as the phase of an iteration
    return found
