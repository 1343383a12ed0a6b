"""The files of a run, which are checked before it begins."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

from ...common import OptionError, check_writable
from ...plots import PICTURE_EXTENSIONS, require_rendering

__all__ = ["Outputs", "check_paths", "check_pictures"]


@dataclass(frozen=True)
class Outputs:
    """Paths of the results of a run; what is None is not written.

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

    def paths(self) -> list[str]:
        """The files that will be written."""
        candidates = (self.mesh, self.history, self.frames, self.report, self.plot, self.picture, self.worst_picture)
        return [path for path in candidates if path is not None]

    def check(self, source: str | None = None, overwrite: bool = False) -> None:
        """Raise a WriteError or OptionError unless all of them can be written; `source` is the input."""
        if self.every < 1:
            raise OptionError(f"every must be 1 or more, not {self.every}")
        check_paths(self.paths(), source, overwrite)
        check_writable(self.mesh, self.extensions)
        if self.frames is not None:
            check_writable(self.frames, (".pvd",))
        check_pictures(self.plot, self.picture, self.worst_picture)


def check_paths(outputs: Sequence[str | None], source: str | None = None, overwrite: bool = False) -> None:
    """Raise unless the outputs can be written to and are different from each other and from the input.

    Raises
    ------
    OptionError
        If two of them are one file, or the first is the input and `overwrite` is not set, or another is.
    WriteError
        If a folder is missing or cannot be written to.
    """
    paths = [path for path in outputs if path is not None]
    seen = {} if source is None else {os.path.realpath(source): "the input"}
    for number, path in enumerate(paths):
        real = os.path.realpath(path)
        if real in seen and not (overwrite and number == 0):
            advice = ": add --overwrite to replace it" if number == 0 else ""
            raise OptionError(f"{path} is {seen[real]} already{advice}")
        seen[real] = "an output"
        check_writable(path)


def check_pictures(plot: str | None, *scenes: str | None) -> None:
    """Raise a WriteError unless a plot, and pictures in three dimensions, can be drawn; None is not wanted."""
    for path in (plot, *scenes):
        if path is not None:
            check_writable(path, PICTURE_EXTENSIONS)
    if any(scenes):
        require_rendering()
