"""The files of a run, which are checked before it begins."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from ....common import (
    OptionError,
    OutputPlace,
    WriteError,
    check_writable,
    companion_file,
    require_distinct_places,
    same_file,
)
from ....io import files_named_by
from ....plots import PICTURE_EXTENSIONS, require_rendering
from ....runs import series_place
from ...terminal import print_line, print_text

__all__ = ["Outputs", "check_page", "check_paths", "check_pictures", "named_inputs", "print_summary"]


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
        .pvd series of the iterations.
    report
        JSON.
    plot
        Histograms of the quality before and after.
    picture
        The mesh before and after, cut open.
    worst_picture
        The worst cells before and after.
    html
        The page.
    checkpoint
        What the run has reached, to go on from.
    every
        Number of iterations from one frame to the next; the last one has a frame too.
    """

    mesh: str
    extensions: tuple[str, ...]
    history: str | None = None
    frames: str | None = None
    report: str | None = None
    plot: str | None = None
    picture: str | None = None
    worst_picture: str | None = None
    html: str | None = None
    checkpoint: str | None = None
    every: int = 1

    def paths(self) -> list[str]:
        """The files that will be written."""
        others = (self.plot, self.picture, self.worst_picture, self.html, self.checkpoint)
        return [path for path in (self.mesh, self.history, self.frames, self.report, *others) if path is not None]

    def check(self, inputs: Mapping[Path, str] | None = None, overwrite: bool = False) -> None:
        """Raise a WriteError or OptionError unless all of them can be written, and none is one of the inputs."""
        if self.every < 1:
            raise OptionError(f"every must be 1 or more, not {self.every}")
        check_paths(self.paths(), inputs or {}, overwrite)
        check_writable(self.mesh, self.extensions)
        if self.frames is not None:
            check_writable(self.frames, (".pvd",))
        check_pictures(self.plot, self.picture, self.worst_picture)
        check_page(self.html)


def named_inputs(mesh: str, **others: Any) -> dict[Path, str]:
    """The files that a command reads, those that they name too, with what they are, for messages.

    Parameters
    ----------
    mesh
        The input.
    **others
        By option what it was given: a file, or, where there is none of that name, a choice.
    """
    named = {Path(mesh): "the input"}
    for option, given in others.items():
        if isinstance(given, str) and Path(given).is_file():
            named.setdefault(Path(given), f"the file of --{option}")
    for path, what in list(named.items()):
        for part in files_named_by(path):
            named.setdefault(part, f"a file that {what} names")
    return named


def check_paths(outputs: Sequence[str | None], inputs: Mapping[Path, str], overwrite: bool = False) -> None:
    """Raise unless the outputs can be written to and are different from each other and from the inputs.

    Raises
    ------
    OptionError
        If two of them are one file, or the first is the first input and `overwrite` is not set, or another is one.
    WriteError
        If a folder is missing or cannot be written to.
    """
    for path in outputs:
        if path is not None and path.endswith((os.sep, os.altsep or os.sep)):
            raise WriteError(f"cannot write {path}: this is the name of a folder")
    first = outputs[0] if outputs else None
    places = []
    for path in outputs:
        if path is not None and path == first:
            place, source = _place_of(Path(path)), next(iter(inputs), None)
            if source is not None and same_file(source, place.path):
                advice = "add --overwrite to replace it"
                place = replace(place, replaces=source if overwrite else None, advice=advice)
            places.append(place)
            first = None  # the same again is another output
        elif path is not None:
            places.append(_place_of(Path(path)))
    require_distinct_places(places, inputs)
    for place in places:
        check_writable(place.path)


def print_summary(summary: Any, worst_measure: str) -> None:
    """Print the quality of a mesh, and its worst cells."""
    print_text(summary)
    if summary.worst:
        typed = ", type" if hasattr(summary.worst[0], "type") else ""
        print_line(f"worst cells (id, {worst_measure.replace('_', ' ')}, centre{typed})")
    for cell in summary.worst:
        centre = ", ".join(f"{x:.6g}" for x in cell.centre)
        line = f"{cell.id:>10} {getattr(cell, worst_measure):>10.5f}  ({centre})  {getattr(cell, 'type', '')}"
        print_line(line.rstrip())


def _place_of(path: Path) -> OutputPlace:
    if path.suffix.lower() == ".pvd":
        return series_place(path)
    companion = companion_file(path)
    return OutputPlace(path) if companion is None else OutputPlace(path, partial(same_file, companion))


def check_pictures(plot: str | None, *scenes: str | None) -> None:
    """Raise a WriteError unless a plot, and pictures in three dimensions, can be drawn; None is not wanted."""
    for path in (plot, *scenes):
        if path is not None:
            check_writable(path, PICTURE_EXTENSIONS)
    if any(scenes):
        require_rendering()


def check_page(path: str | None, inputs: Mapping[Path, str] | None = None) -> None:
    """Raise a WriteError or OptionError unless a page can be written there, and is no input; None is not wanted."""
    if path is not None:
        from ....page import PAGE_EXTENSIONS  # not loaded where no page is written

        check_writable(path, PAGE_EXTENSIONS)
        check_paths([None, path], inputs or {})
