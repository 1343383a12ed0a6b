"""A run with everything around it: outputs checked before the work, watched during it, written after it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from .errors import OptionError, WriteError
from .files import check_writable, write_text
from .interrupt import uninterrupted
from .io import WRITE_EXTENSIONS, write
from .mesh import HexMesh
from .options import Options
from .plots import PICTURES, before_after, histogram, require_rendering, worst_cells
from .progress import HistoryFile, Progress, line
from .quality import corner_scaled_jacobian, quality
from .regularize import Regularization
from .series import Series

__all__ = ["Finished", "Outputs", "Volume", "Work", "check_pictures", "check_places", "run_job", "run_work"]


@dataclass(frozen=True)
class Outputs:
    """Where the results of a run go; what is None is not written.

    Attributes
    ----------
    mesh
        The better mesh.
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
    extensions
        Those that the mesh may have.
    """

    mesh: str
    history: str | None = None
    frames: str | None = None
    report: str | None = None
    plot: str | None = None
    picture: str | None = None
    worst_picture: str | None = None
    every: int = 1
    extensions: tuple[str, ...] = WRITE_EXTENSIONS

    def named(self) -> list[str]:
        """The files that are asked for."""
        places = (self.mesh, self.history, self.frames, self.report, self.plot, self.picture, self.worst_picture)
        return [path for path in places if path is not None]

    def check(self, source: str | None = None, overwrite: bool = False) -> None:
        """Raise a WriteError or OptionError unless all of them can be written, `source` being the input."""
        if self.every < 1:
            raise OptionError(f"every is 1 or more, not {self.every}")
        check_places(self.named(), source, overwrite)
        check_writable(self.mesh, self.extensions)
        if self.frames is not None:
            check_writable(self.frames, (".pvd",))
        check_pictures(self.plot, self.picture, self.worst_picture)


@dataclass(frozen=True)
class Finished:
    """What a run came to: its result, what the file format could not keep, and what ended it early, if anything."""

    result: Any
    lost: list[str]
    stopped_by: BaseException | None


class Work(Protocol):
    """What a job needs to know of a kind of mesh: volumes here, surfaces in :mod:`surface.commands`."""

    rescue: str  # name of a file in a format that holds everything

    def start(self) -> Any:
        """A run to iterate over, with `history` and `result()`."""

    def rehearsed(self) -> Any:
        """The input with the arrays that the result will have."""

    def write(self, path: str | os.PathLike[str], mesh: Any) -> list[str]:
        """Write a mesh; what the format could not keep."""

    def told(self, record: Any) -> str:
        """An iteration in a line."""

    def frame(self, run: Any) -> Any:
        """The mesh reached, for a series."""

    def histogram(self, path: str, result: Any) -> None:
        """Draw the quality before and after."""

    def picture(self, path: str, result: Any) -> None:
        """Draw the mesh before and after."""

    def worst(self, path: str, result: Any) -> None:
        """Draw the worst cells before and after."""


@dataclass(frozen=True)
class Volume:
    """Regularize a hexahedral mesh."""

    mesh: HexMesh
    options: Options
    rescue = "rescued.vtu"

    def start(self) -> Regularization:
        return Regularization(self.mesh, self.options)

    def rehearsed(self) -> HexMesh:
        zero = np.zeros(len(self.mesh.cells))
        return self.mesh.replaced(
            point_data={"moved_by": np.zeros_like(self.mesh.points)},
            cell_data={"scaled_jacobian": zero, "scaled_jacobian_change": zero},
        )

    def write(self, path: str | os.PathLike[str], mesh: HexMesh) -> list[str]:
        return write(path, mesh)

    def told(self, record: Any) -> str:
        return line(record)

    def frame(self, run: Any) -> HexMesh:
        points = run.points
        data = {"scaled_jacobian": corner_scaled_jacobian(points, run.mesh.cells)}
        return run.mesh.replaced(points=points, cell_data=data)

    def histogram(self, path: str, result: Any) -> None:
        histogram(path, quality(self.mesh), quality(self.mesh.replaced(points=result.points)))

    def picture(self, path: str, result: Any) -> None:
        before_after(path, self.mesh, self.mesh.replaced(points=result.points))

    def worst(self, path: str, result: Any) -> None:
        worst_cells(path, self.mesh, self.mesh.replaced(points=result.points))


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


def run_job(mesh: HexMesh, options: Options, outputs: Outputs, progress: Progress) -> Finished:
    """Regularize a mesh and write all that is asked for; see :func:`run_work`."""
    return run_work(Volume(mesh, options), outputs, progress)


def run_work(work: Work, outputs: Outputs, progress: Progress) -> Finished:
    """Do the work and write all that is asked for; an interruption leaves the mesh reached so far.

    Parameters
    ----------
    work
        What to do.
    outputs
        Where results go, checked before.
    progress
        Where to show what goes on.

    Raises
    ------
    MeshError, OptionError
        If the run cannot begin.
    WriteError
        If a file cannot be written: before the work, where that can be known.
    KeyboardInterrupt
        If interrupted before there is anything to keep.
    """
    progress.say(f"trying {outputs.mesh}")
    _rehearse(outputs.mesh, work)
    progress.say("preparing")
    run = work.start()
    stopped_by = _watch(work, run, outputs, progress)
    if not run.history:
        raise stopped_by or KeyboardInterrupt
    with uninterrupted():
        progress.say(f"writing {outputs.mesh}")
        result = run.result()
        lost = _write_or_rescue(outputs.mesh, work, result.mesh)
        if outputs.report is not None:
            write_text(outputs.report, result.report.to_json() + "\n")
        drawings = (
            (outputs.plot, work.histogram),
            (outputs.picture, work.picture),
            (outputs.worst_picture, work.worst),
        )
        for path, draw in drawings:
            if path is not None:
                progress.say(f"drawing {path}")
                draw(path, result)
    return Finished(result, lost, stopped_by)


def _watch(work: Work, run: Any, outputs: Outputs, progress: Progress) -> BaseException | None:
    """Run to the end; returns what ended it early."""
    with ExitStack() as stack:
        history = None if outputs.history is None else stack.enter_context(HistoryFile(outputs.history))
        frames = None if outputs.frames is None else stack.enter_context(Series(outputs.frames))
        shown = -1
        try:
            for record in run:
                if history is not None:
                    history.add(record)
                if frames is not None and record.iteration % outputs.every == 0:
                    shown = record.iteration
                    frames.add(shown, work.frame(run))
                progress.say(work.told(record))
            if frames is not None and run.history and shown != run.history[-1].iteration:
                frames.add(run.history[-1].iteration, work.frame(run))
        except (KeyboardInterrupt, OSError, MemoryError) as problem:
            # What was reached is worth keeping, also when a disk is full.
            return problem
    return None


def _write_or_rescue(path: str, work: Work, mesh: Any) -> list[str]:
    """Write the mesh; if that fails after all, to the folder for temporary files, for the work not to be lost."""
    try:
        return work.write(path, mesh)
    except WriteError as problem:
        refuge = Path(tempfile.mkdtemp(prefix="hexconformal-")) / work.rescue
        work.write(refuge, mesh)
        raise WriteError(f"{problem}; the mesh was saved as {refuge}") from problem


def _rehearse(path: str, work: Work) -> None:
    """Write the input beside `path` and remove it: what a format cannot hold, or a disk, shows before the work."""
    place = Path(os.path.realpath(path))
    with tempfile.TemporaryDirectory(prefix=".hexconformal-", dir=place.parent) as folder:
        trial = Path(folder) / place.name
        try:
            work.write(trial, work.rehearsed())
        except WriteError as problem:
            raise WriteError(str(problem).replace(str(trial), path)) from problem
