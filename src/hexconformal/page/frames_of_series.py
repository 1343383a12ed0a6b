"""Frames of a page from a series that a run has written."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..common import ReadError
from .contents import Frame
from .schedule import PageSchedule

__all__ = ["SeriesReader", "thinned"]

T = TypeVar("T")


@dataclass(frozen=True)
class SeriesReader:
    """How the frames of a series are read.

    Attributes
    ----------
    read
        Reads the mesh in a file.
    measure
        Arrays on the cells of a mesh by name: what it is coloured by.
    name
        What the frame at a time is called.
    position
        Where it is on the axis of the curves; None: at its time.
    """

    read: Callable[[Path], Any]
    measure: Callable[[Any], Mapping[str, NDArray[Any]]]
    name: Callable[[float], str]
    position: Callable[[float], float | None] = float

    def frames(self, listed: Sequence[tuple[float, Path]], mesh: Any) -> list[Frame]:
        """The frames of some times and files.

        Parameters
        ----------
        listed
            Times and files, see :func:`hexconformal.runs.frames_listed`.
        mesh
            Whose cells they must have.

        Raises
        ------
        ReadError
            If one of them cannot be read, or is of another mesh.
        """
        found = []
        for time, file in listed:
            there = self.read(file)
            if len(there.points) != len(mesh.points) or len(there.cells) != len(mesh.cells):
                raise ReadError(f"cannot show {file}: it is a frame of another mesh")
            data = {**self.measure(there), **there.cell_data}
            found.append(Frame(self.name(time), np.asarray(there.points), data, there.point_data, self.position(time)))
        return found


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
