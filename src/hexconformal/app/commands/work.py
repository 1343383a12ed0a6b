"""A run with everything around it: outputs checked before the work, watched during it, written after it."""

from __future__ import annotations

import os
import sys
import tempfile
from argparse import Namespace
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from ...common import WriteError, as_interruption, temporary_folder_beside, uninterrupted, write_text
from ...runs import HistoryFile, Series
from ..progress import Progress
from .arguments import STDOUT, tell_lost
from .kind import Kind
from .outputs import Outputs

__all__ = ["Finished", "Work", "carry_out", "ended", "run_work"]

_RESCUE = "rescued.vtu"  # in a format that holds everything


@dataclass(frozen=True)
class Finished:
    """What a run came to: its result, what the file format could not keep, and what ended it early, if anything."""

    result: Any
    lost: list[str]
    stopped_by: BaseException | None


class Work(Protocol):
    """What a job needs to know of what is done."""

    @property
    def kind(self) -> Kind:
        """What is worked on."""

    @property
    def mesh(self) -> Any:
        """The input."""

    def start(self) -> Any:
        """A run to iterate over, with `history` and `result()`."""

    def dry_run(self) -> Any:
        """The input with the arrays that the result will have."""

    def frame(self, run: Any) -> Any:
        """The mesh reached, for a series."""


def carry_out(arguments: Namespace, kind: Kind, prepare: Callable[[], Work]) -> int:
    """Do a work with everything that is asked for, and say how it ended.

    Parameters
    ----------
    arguments
        Input, output, and what is to be told.
    kind
        What is worked on.
    prepare
        Reads the input.
    """
    to_stdout = arguments.report == STDOUT
    outputs = Outputs(
        mesh=arguments.output,
        extensions=kind.extensions,
        history=arguments.history,
        frames=arguments.frames,
        report=None if to_stdout else arguments.report,
        plot=arguments.plot,
        picture=arguments.picture,
        worst_picture=arguments.worst_picture,
        every=arguments.every,
    )
    outputs.check(arguments.input, arguments.overwrite)
    with Progress(arguments.quiet) as progress:
        progress.say(f"reading {arguments.input}")
        finished = run_work(prepare(), outputs, progress)
    if to_stdout:
        print(finished.result.report.to_json())
    elif not arguments.quiet:
        print(finished.result.report)
        print(f"wrote {', '.join(filter(os.path.exists, outputs.named()))}")
    tell_lost(arguments.output, finished.lost)
    return ended(finished, arguments.output)


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
        try:
            _tell(work, result, outputs, progress)
        except WriteError as problem:
            stopped_by = stopped_by or problem
    return Finished(result, lost, stopped_by)


def _tell(work: Work, result: Any, outputs: Outputs, progress: Progress) -> None:
    """Write the report and draw the pictures that are asked for."""
    if outputs.report is not None:
        write_text(outputs.report, result.report.to_json() + "\n")
    drawings = (
        (outputs.plot, work.kind.histogram),
        (outputs.picture, work.kind.before_after),
        (outputs.worst_picture, work.kind.worst_cells),
    )
    for path, draw in drawings:
        if path is not None:
            progress.say(f"drawing {path}")
            draw(path, work.mesh, work.mesh.replaced(result.points))


def ended(finished: Finished, place: str) -> int:
    """Say what ended a run early, if anything; returns the exit code."""
    if finished.stopped_by is None:
        return 0
    reached = f"the mesh of iteration {finished.result.report.iterations} is in {place}"
    if isinstance(finished.stopped_by, KeyboardInterrupt):
        print(f"interrupted: {reached}", file=sys.stderr)
        return 130
    print(f"error: {finished.stopped_by or 'not enough memory'}; {reached}", file=sys.stderr)
    return 1


def _watch(work: Work, run: Any, outputs: Outputs, progress: Progress) -> BaseException | None:
    """Run to the end; returns what ended it early."""
    with ExitStack() as stack:
        history = None if outputs.history is None else stack.enter_context(HistoryFile(outputs.history))
        frames = None if outputs.frames is None else stack.enter_context(Series(outputs.frames))
        shown = -1
        try:
            with as_interruption():
                for record in run:
                    if history is not None:
                        history.add(record)
                    if frames is not None and record.iteration % outputs.every == 0:
                        shown = record.iteration
                        frames.add(shown, work.frame(run))
                    progress.say(str(record))
                if frames is not None and run.history and shown != run.history[-1].iteration:
                    frames.add(run.history[-1].iteration, work.frame(run))
        except (KeyboardInterrupt, OSError, MemoryError) as problem:
            # What was reached is worth keeping, also when a disk is full.
            return problem
    return None


def _write_or_rescue(path: str, work: Work, mesh: Any) -> list[str]:
    """Write the mesh; if that fails after all, to the folder for temporary files, for the work not to be lost."""
    try:
        return work.kind.write(path, mesh)
    except WriteError as problem:
        refuge = Path(tempfile.mkdtemp(prefix="hexconformal-")) / _RESCUE
        work.kind.write(refuge, mesh)
        raise WriteError(f"{problem}; the mesh was saved as {refuge}") from problem


def _rehearse(path: str, work: Work) -> None:
    """Write the input beside `path` and remove it: what a format cannot hold, or a disk, shows before the work."""
    place = Path(os.path.realpath(path))
    with temporary_folder_beside(place) as folder:
        trial = folder / place.name
        try:
            work.kind.write(trial, work.dry_run())
        except WriteError as problem:
            raise WriteError(str(problem).replace(str(trial), path)) from problem
