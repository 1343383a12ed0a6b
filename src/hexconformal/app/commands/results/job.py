"""A run and its files: outputs are checked before it, written while it goes on, and completed after it."""

from __future__ import annotations

import os
import tempfile
from argparse import Namespace
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from ....common import WriteError, as_interruption, temporary_folder_beside, uninterrupted, write_text
from ....runs import HistoryFile, Series
from ...progress import Progress
from ...terminal import print_line, print_text
from ..arguments import STDOUT, note_dropped
from ..kinds import MeshKind
from .outputs import Outputs, named_inputs
from .pages import write_result_page

__all__ = ["FinishedJob", "Job", "exit_code_of", "run_command", "run_job"]

_FALLBACK_NAME = "rescued.vtu"  # in a format that stores everything


@dataclass(frozen=True)
class FinishedJob:
    """The outcome of a job.

    Attributes
    ----------
    result
        The result of the run.
    dropped
        Names of what the format of the output could not store.
    stopped_by
        The exception that ended the run early, if one did.
    """

    result: Any
    dropped: list[str]
    stopped_by: BaseException | None


class Job(Protocol):
    """A run on one mesh, of either kind."""

    @property
    def kind(self) -> MeshKind:
        """The kind of the mesh."""

    @property
    def mesh(self) -> Any:
        """The input."""

    def start(self) -> Any:
        """A run to iterate over, with `history` and `result()`."""

    def placeholder(self) -> Any:
        """The input with the arrays that the result will have, to try whether it can be written."""

    def snapshot(self, run: Any) -> Any:
        """The mesh that the run has reached, for a series."""

    def keep(self, run: Any, result: Any = None) -> None:
        """Keep what the run has reached, or its result, for another one to go on from, if that is wanted."""


def run_command(arguments: Namespace, kind: MeshKind, prepare: Callable[[], Job]) -> int:
    """Run a job with the outputs that the command line names; returns the exit code.

    Parameters
    ----------
    arguments
        Input and outputs.
    kind
        The kind of the mesh.
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
        html=arguments.html,
        checkpoint=getattr(arguments, "checkpoint", None),
        every=arguments.every,
    )
    given = {name: getattr(arguments, name, None) for name in ("surface", "target")}
    outputs.check(named_inputs(arguments.input, **given), arguments.overwrite)
    with Progress(arguments.quiet) as progress:
        progress.show(f"reading {arguments.input}")
        finished = run_job(prepare(), outputs, progress)
    if to_stdout:
        print_text(finished.result.report.to_json())
    elif not arguments.quiet:
        print_text(finished.result.report)
        print_line(f"wrote {', '.join(filter(os.path.exists, outputs.paths()))}")
    note_dropped(arguments.output, finished.dropped)
    return exit_code_of(finished, arguments.output)


def run_job(job: Job, outputs: Outputs, progress: Progress) -> FinishedJob:
    """Run a job and write its outputs; an interruption leaves the mesh reached so far.

    Parameters
    ----------
    job
        The job.
    outputs
        The files to write, checked before.
    progress
        Shows what goes on.

    Raises
    ------
    MeshError, OptionError
        If the run cannot begin.
    WriteError
        If a file cannot be written: before the run, where that can be known.
    KeyboardInterrupt
        If interrupted before there is anything to keep.
    """
    progress.show(f"trying {outputs.mesh}")
    _try_writing(outputs.mesh, job)
    progress.show("preparing")
    run = job.start()
    stopped_by = _iterate(job, run, outputs, progress)
    if not run.history:
        raise stopped_by or KeyboardInterrupt
    try:
        with uninterrupted():
            progress.show(f"writing {outputs.mesh}")
            result = run.result()
            dropped = _write_or_fall_back(outputs.mesh, job, result.mesh)
            try:
                job.keep(run, result)
                _write_report_and_pictures(job, result, outputs, progress)
            except WriteError as problem:
                stopped_by = stopped_by or problem
    except KeyboardInterrupt as problem:  # it came while all was written
        stopped_by = stopped_by or problem
    return FinishedJob(result, dropped, stopped_by)


def exit_code_of(finished: FinishedJob, output: str) -> int:
    """The exit code of a job; what ended it early, if anything, is printed."""
    if finished.stopped_by is None:
        return 0
    reached = f"the mesh of iteration {finished.result.report.iterations} is in {output}"
    if isinstance(finished.stopped_by, KeyboardInterrupt):
        print_line(f"interrupted: {reached}", error=True)
        return 130
    print_line(f"error: {finished.stopped_by or 'not enough memory'}; {reached}", error=True)
    return 1


def _try_writing(path: str, job: Job) -> None:
    """Write the input beside `path` and remove it: what a format, or a disk, cannot hold shows before the run."""
    place = Path(os.path.realpath(path))
    with temporary_folder_beside(place) as folder:
        trial = folder / place.name
        try:
            job.kind.write(trial, job.placeholder())
        except WriteError as problem:
            raise WriteError(str(problem).replace(str(trial), path)) from problem


def _iterate(job: Job, run: Any, outputs: Outputs, progress: Progress) -> BaseException | None:
    """Run to the end, with history and frames; returns what ended it early."""
    with ExitStack() as stack:
        history = None if outputs.history is None else stack.enter_context(HistoryFile(outputs.history))
        frames = None if outputs.frames is None else stack.enter_context(Series(outputs.frames))
        last_frame = -1
        try:
            with as_interruption():
                for record in run:
                    with uninterrupted():
                        if history is not None:
                            history.add(record)
                        if frames is not None and record.iteration % outputs.every == 0:
                            last_frame = record.iteration
                            frames.add(last_frame, job.snapshot(run))
                        job.keep(run)
                    progress.show(str(record))
                if frames is not None and run.history and last_frame != run.history[-1].iteration:
                    with uninterrupted():
                        frames.add(run.history[-1].iteration, job.snapshot(run))
        except (KeyboardInterrupt, OSError, MemoryError) as problem:
            # What was reached is worth keeping, also when a disk is full.
            return problem
    return None


def _write_or_fall_back(path: str, job: Job, mesh: Any) -> list[str]:
    """Write the mesh; if that fails after all, save it in the folder for temporary files and raise."""
    try:
        return job.kind.write(path, mesh)
    except WriteError as problem:
        fallback = Path(tempfile.mkdtemp(prefix="hexconformal-")) / _FALLBACK_NAME
        job.kind.write(fallback, mesh)
        raise WriteError(f"{problem}; the mesh was saved as {fallback}") from problem


def _write_report_and_pictures(job: Job, result: Any, outputs: Outputs, progress: Progress) -> None:
    if outputs.report is not None:
        write_text(outputs.report, result.report.to_json() + "\n")
    drawings = (
        (outputs.plot, job.kind.histogram),
        (outputs.picture, job.kind.before_after),
        (outputs.worst_picture, job.kind.worst_cells),
    )
    for path, draw in drawings:
        if path is not None:
            progress.show(f"drawing {path}")
            draw(path, job.mesh, job.mesh.replaced(result.points))
    if outputs.html is not None:
        progress.show(f"writing {outputs.html}")
        write_result_page(outputs.html, result, outputs.frames, job.kind)
