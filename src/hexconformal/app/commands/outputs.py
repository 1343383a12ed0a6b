"""Where results go: places that are tried before the work begins."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

from ...common import OptionError, check_writable
from ...plots import PICTURES, require_rendering

__all__ = ["Outputs", "check_pictures", "check_places"]


@dataclass(frozen=True)
class Outputs:
    """Where the results of a run go; what is None is not written.

    Attributes
    ----------
    mesh
        The better mesh.
    extensions
        Those that it may have.
    history
        CSV, one row per iteration.
    frames
        .pvd series of the iterations, every `every`-th and the last.
    report
        JSON.
    plot
        Histograms of the quality before and after.
    picture
        The mesh before and after, cut open.
    worst_picture
        The worst cells before and after.
    """

    mesh: str
    extensions: tuple[str, ...]
    history: str | None = None
    frames: str | None = None
    report: str | None = None
    plot: str | None = None
    picture: str | None = None
    worst_picture: str | None = None
    every: int = 1

    def named(self) -> list[str]:
        """The files that are asked for."""
        places = (self.mesh, self.history, self.frames, self.report, self.plot, self.picture, self.worst_picture)
        return [path for path in places if path is not None]

    def check(self, source: str | None = None, overwrite: bool = False) -> None:
        """Raise a WriteError or OptionError unless all of them can be written, `source` being the input."""
        if self.every < 1:
            raise OptionError(f"every must be 1 or more, not {self.every}")
        check_places(self.named(), source, overwrite)
        check_writable(self.mesh, self.extensions)
        if self.frames is not None:
            check_writable(self.frames, (".pvd",))
        check_pictures(self.plot, self.picture, self.worst_picture)


def check_places(outputs: Sequence[str | None], source: str | None = None, overwrite: bool = False) -> None:
    """Raise unless the outputs are places that can be written to, different from each other and from the input.

    Raises
    ------
    OptionError
        If two of them are one file, or the first is the input and `overwrite` is not set, or another is.
    WriteError
        If a folder is missing or cannot be written to.
    """
    places = [path for path in outputs if path is not None]
    seen = {} if source is None else {os.path.realpath(source): "the input"}
    for number, path in enumerate(places):
        place = os.path.realpath(path)
        if place in seen and not (overwrite and number == 0):
            advice = ": add --overwrite to replace it" if number == 0 else ""
            raise OptionError(f"{path} is {seen[place]} already{advice}")
        seen[place] = "an output"
        check_writable(path)


def check_pictures(plot: str | None, *scenes: str | None) -> None:
    """Raise a WriteError unless a plot, and pictures in three dimensions, can be drawn; None is not wanted."""
    for path in (plot, *scenes):
        if path is not None:
            check_writable(path, PICTURES)
    if any(scenes):
        require_rendering()
