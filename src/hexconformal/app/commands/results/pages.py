"""The pages that commands write: of results, and of series."""

from __future__ import annotations

import csv
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError, reading
from ....page import Page, PageSchedule, SeriesReader, series_page, thinned
from ....runs import frames_listed
from ..kinds import MeshKind

__all__ = ["page_of_series", "write_result_page"]

Columns = dict[str, NDArray[np.float64]]


def write_result_page(path: str, result: Any, series: str | None, kind: MeshKind) -> None:
    """Write the page of a result, with frames of the series that its run has written, if it has."""
    frames = []
    if series is not None and result.history:
        last = result.history[-1].iteration
        between = [(time, file) for time, file in frames_listed(series) if 0 < time < last]
        reader = SeriesReader(partial(_read, kind, result.before), partial(_worst, kind), _iteration)
        frames = reader.frames(thinned(between, len(result.points), PageSchedule()), result.before)
    result.page(frames).write(path)


def page_of_series(
    series: Path,
    kind: MeshKind,
    history: Path | None = None,
    report: Any = "",
    title: str = "",
    interfaces: Any = "auto",
) -> Page:
    """The page of a series of a mesh, with the curves of the history of its run, if there is one."""
    listed = frames_listed(series)
    mesh = kind.read_like(listed[0][1], None)
    return series_page(
        kind.page,
        listed,
        partial(_read, kind, mesh),
        partial(_worst, kind),
        {} if history is None else _columns(history),
        report=report,
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


def _columns(history: Path) -> Columns:
    """Columns of numbers of a history."""
    with reading(history, (history.suffix.lower(),)), open(history, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
        if rows and not {"iteration", "step"} & set(rows[0]):
            raise ReadError("it is no history of a run: it has no column 'iteration' or 'step'")
    found = {}
    for name in rows[0] if rows else ():
        try:
            found[name] = np.array([float(row[name]) for row in rows])
        except (TypeError, ValueError):
            continue  # words, such as the phase of an iteration, or a row that is cut off
    return found
