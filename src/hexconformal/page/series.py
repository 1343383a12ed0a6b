"""Pages of series: of the states that a run went through, in files or in memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..common import ReadError
from .alike import have_same_cells, require_places
from .contents import Frame
from .curves import Curve, curves_of
from .page import Page
from .schedule import PageSchedule

__all__ = ["SeriesReader", "series_page", "thinned"]

T = TypeVar("T")

Columns = Mapping[str, NDArray[np.float64]]

_CURVES = (
    Curve("energy", ("energy",)),
    Curve("reduced volume", ("reduced_volume",)),
    Curve("smallest angle of a cell, degrees", ("mean_angle", "min_angle")),
    Curve("scaled Jacobian", ("mean_scaled_jacobian", "min_scaled_jacobian")),
    Curve("iterations of a step", ("iterations",)),
    Curve("time step", ("tau",), logarithmic=True),
)


def _time(time: float) -> str:
    return f"t = {time:.6g}"


@dataclass(frozen=True)
class SeriesReader(Generic[T]):
    """How the states of a series become frames.

    Attributes
    ----------
    read
        The mesh of a state, such as that in a file.
    measure
        Arrays on the cells of a mesh by name: what it is coloured by.
    name
        What the frame at a time is called.
    position
        Where it is on the axis of the curves; None: at its time.
    """

    read: Callable[[T], Any]
    measure: Callable[[Any], Mapping[str, NDArray[Any]]]
    name: Callable[[float], str] = _time
    position: Callable[[float], float | None] = float

    def frames(self, listed: Sequence[tuple[float, T]], mesh: Any) -> list[Frame]:
        """The frames of some times and states.

        Parameters
        ----------
        listed
            Times and states, for instance files (:func:`hexconformal.runs.frames_listed`).
        mesh
            Whose cells they must have.

        Raises
        ------
        ReadError
            If one of them cannot be read, or is of another mesh.
        MeshError
            If points are not finite.
        """
        found = []
        for time, state in listed:
            there, name = self.read(state), self.name(time)
            what = str(state) if isinstance(state, Path) else name
            if not have_same_cells(there, mesh):
                raise ReadError(f"cannot show {what}: it is a frame of another mesh, with other cells")
            require_places(there, what)
            data = {**self.measure(there), **there.cell_data}
            found.append(Frame(name, np.asarray(there.points), data, there.point_data, self.position(time)))
        return found


def series_page(
    make: Callable[..., Page],
    listed: Sequence[tuple[float, T]],
    read: Callable[[T], Any],
    measure: Callable[[Any], Mapping[str, NDArray[Any]]],
    columns: Columns,
    *,
    schedule: PageSchedule | None = None,
    **options: Any,
) -> Page:
    """The page of a series of a mesh, with the curves of the history of its run.

    Parameters
    ----------
    make
        Makes the page of a mesh before and after: :func:`hexconformal.page.volume_page` or
        :func:`surface.page.surface_page`.
    listed
        Times and states, the first and the last one among them; others are thinned out to those there is room for.
    read, measure
        See :class:`SeriesReader`.
    columns
        Of the history of the run by name, as far as there is one.
    schedule
        How much the page holds.
    **options
        Of the page: report, interfaces, title.

    Raises
    ------
    ReadError
        If a state cannot be read, or is of another mesh.
    """
    schedule = PageSchedule() if schedule is None else schedule
    along = "iteration" if "iteration" in columns and "time" not in columns else "step"

    def position(time: float) -> float | None:
        # A time is at the step that reached it.
        if "time" not in columns or along not in columns:
            return time
        return 0.0 if time == 0.0 else float(columns[along][np.abs(columns["time"] - time).argmin()])

    (start, first), (end, last) = listed[0], listed[-1]
    mesh, reader = read(first), SeriesReader(read, measure, position=position)
    return make(
        mesh,
        None if len(listed) == 1 else read(last),
        frames=reader.frames(thinned(listed[1:-1], len(mesh.points), schedule), mesh),
        ends=[(_time(time), position(time)) for time in (start, end)],
        curves=curves_of(columns, along, f"{along}s", _CURVES),
        schedule=schedule,
        **options,
    )


def thinned(between: Sequence[T], nodes: int, schedule: PageSchedule) -> list[T]:
    """As many of the frames between the first and the last one, evenly spaced, as a page of so many nodes has room for.

    Examples
    --------
    >>> thinned(range(1, 100), 1000, PageSchedule(most_frames=3))
    [25, 50, 75]
    """
    room = min(int(schedule.most_frames), int(schedule.most_places) // max(nodes, 1), len(between))
    places = np.linspace(-1, len(between), room + 2)[1:-1].round().astype(int)
    return [between[place] for place in places.tolist()]
