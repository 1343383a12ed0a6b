"""A run in a folder: frames, history, and a checkpoint after every step to go on from."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from ..common import (
    OptionError,
    OutputPlace,
    ReadError,
    WriteError,
    agreed,
    as_interruption,
    interruption_waits,
    require_distinct_places,
    same_file,
    uninterrupted,
)
from .history import HistoryFile, rows_until
from .series import Series, frames_folder, series_place
from .state_files import StateFiles, damage_told

__all__ = ["FolderRun", "RunFolder", "RunState"]

_STEP, _TIME = 0, 1  # the first two fields of every record


@dataclass(frozen=True)
class RunState:
    """The state of a run after a step.

    Attributes
    ----------
    step, time
        Reached.
    frame
        The mesh then, as a series takes it.
    record
        A row of the history; None where there is nothing to say.
    refused
        Whether the step could not be made: it is reported, and the run ends with what was before it.
    """

    step: int
    time: float
    frame: Callable[[], Any]
    record: Any = None
    refused: bool = False


class FolderRun(Protocol):
    """A run that can be followed in a folder: iterate over its states."""

    version: int  # of what `state` holds
    other_runs: str  # what the checkpoint of another run belongs to, in words

    @property
    def record(self) -> type:
        """The dataclass of the rows of the history; its first fields are step and time."""

    @property
    def step(self) -> int:
        """Number of steps done."""

    @property
    def time(self) -> float:
        """Time reached."""

    @property
    def fingerprint(self) -> str:
        """That of a checkpoint to go on with must be the same."""

    def __iter__(self) -> Iterator[RunState]: ...

    def wants_frame(self, time: float) -> bool:
        """Whether there must be a frame at a time, whatever the number of the step."""

    def frame(self) -> Any:
        """The mesh after the last step that was made completely, as a series takes it."""

    def state(self) -> Mapping[str, Any]:
        """The state of the run, as arrays and numbers by name."""

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from there."""

    def write(self, path: Path) -> None:
        """Write the mesh at the end."""


@dataclass(frozen=True)
class RunFolder:
    """The folder that a run is written to.

    Attributes
    ----------
    path
        The folder; it is made if it is not there.
    series
        The .pvd file, None for run.pvd in the folder.
    comm
        The ranks, all of which must do the same with it; they are interrupted between steps, while signals wait. None:
        one process.
    """

    path: Path
    series: Path | None = None
    comm: Any = None

    @property
    def frames(self) -> Path:
        """The series that ParaView plays."""
        return self.path / "run.pvd" if self.series is None else self.series

    @property
    def history(self) -> Path:
        """A row per step."""
        return self.path / "history.csv"

    @property
    def checkpoint(self) -> Path:
        """The state of the run."""
        return self.path / "checkpoint.npz"

    @property
    def last(self) -> Path:
        """The mesh at the end."""
        return self.path / ("last.vtu" if self.comm is None else "last.pvtu")

    @property
    def _other_last(self) -> Path:
        """What ranks call the mesh at the end, where this is one process, or the other way round."""
        return self.path / ("last.pvtu" if self.comm is None else "last.vtu")

    @property
    def plot(self) -> Path:
        """The history drawn, by a command that does so."""
        return self.path / "history.png"

    def prepare(self, resume: bool, overwrite: bool, inputs: Mapping[Path, str]) -> None:
        """Make the folder, or see that the run in it may be gone on with, or replaced.

        Raises
        ------
        OptionError
            If there is a run already, or a file of a name that it would write, and neither is asked for; if there is
            no run to go on with; or if one of `inputs`, the files that are read with what they are, would be replaced.
        WriteError
            If the folder cannot be made.
        """
        with agreed(self.comm, named=False):
            if self._is_first:
                self._prepare(resume, overwrite, inputs)

    @property
    def _is_first(self) -> bool:
        """Whether this rank writes what there is once."""
        return self.comm is None or self.comm.rank == 0

    def _prepare(self, resume: bool, overwrite: bool, inputs: Mapping[Path, str]) -> None:
        if self.path.is_file():
            raise WriteError(f"cannot make the folder {self.path}: it is a file")
        places = [OutputPlace(path) for path in (self.history, self.plot, self.checkpoint)]
        require_distinct_places([*places, OutputPlace(self.last, self._is_of_last), series_place(self.frames)], inputs)
        there = self.checkpoint.exists()
        if resume and not there:
            raise OptionError(f"there is no run in {self.path} to resume: {self.checkpoint.name} is missing")
        if there and not (resume or overwrite):
            raise OptionError(f"{self.path} holds a run: --resume goes on with it, --overwrite starts anew")
        written = (self.history, self.plot, self.last, self.frames, frames_folder(self.frames))
        own = self._has_no_checkpoint_yet()
        taken = [str(path) for path in written if path.exists() and not (own and path.parent == self.path)]
        if taken and not (resume or overwrite):
            raise OptionError(f"{', '.join(taken)} would be replaced: choose another folder, or add --overwrite")
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as problem:
            raise WriteError(f"cannot make the folder {self.path}: {problem}") from problem

    def _is_of_last(self, other: Path) -> bool:
        """Whether a path is that of a piece of the mesh at the end, or of an older one that is removed with it."""
        if same_file(self._other_last, other):
            return True
        if self.comm is None:
            return False
        from ..ranks import piece_path  # not loaded in one process

        return any(same_file(piece_path(self.last, rank), other) for rank in range(self.comm.size))

    def _has_no_checkpoint_yet(self) -> bool:
        """True if the files were left by a run that was killed before its first checkpoint."""
        if not self.history.is_file() or any(path.exists() for path in (self.checkpoint, self.last, self.plot)):
            return False
        with open(self.history, encoding="utf-8", errors="replace") as file:
            lines = [file.readline() for _ in range(3)]
        # The names of the record's fields, of which the first is the step, and one row at the most.
        return not lines[2] and (not lines[0] or lines[0].startswith("step,"))

    def follow(self, run: FolderRun, resume: bool, every: int, report: Callable[[str], None]) -> BaseException | None:
        """Follow a run to its end and write everything; returns what interrupted it, None if nothing did.

        Parameters
        ----------
        run
            Not begun.
        resume
            Go on from the checkpoint.
        every
            A frame every so many steps, where one is wanted, and at the end.
        report
            Called with every record in a line, on ranks by the first.

        Raises
        ------
        OptionError
            If the checkpoint belongs to another run, or the history does not go as far.
        ReadError
            If it cannot be read.
        WriteError
            If something cannot be written.
        KeyboardInterrupt
            If interrupted before there is anything to go on from.
        """
        files = StateFiles(self.checkpoint, run.version, run.other_runs, self.comm)
        fingerprint = run.fingerprint
        rows = self._resume(run, files, fingerprint) if resume else []
        steps = {float(row[_TIME]): int(row[_STEP]) for row in rows[1:]} | {0.0: 0}

        def belongs(time: float) -> bool:
            # One at which a run was left before, between those of the series, does not.
            return run.wants_frame(time) or steps.get(time, 1) % every == 0

        begun, stopped = resume, None
        until = run.time if resume else None
        with ExitStack() as stack:
            with agreed(self.comm, named=False):
                history = stack.enter_context(HistoryFile(self.history, rows)) if self._is_first else None
            series = stack.enter_context(Series(self.frames, until, belongs, self.comm))
            try:
                with as_interruption():
                    for state in run:
                        with uninterrupted():
                            with agreed(self.comm, named=False):
                                if state.record is not None and history is not None:
                                    history.add(state.record)
                            if not state.refused:
                                if run.wants_frame(state.time) or state.step % every == 0:
                                    series.add(state.time, state.frame())
                                # Last: what it counts as done is written.
                                files.save(fingerprint, run.state())
                                begun = True
                        if state.record is not None and self._is_first:
                            report(str(state.record))
                        if state.refused:
                            break
                        if self._is_interrupted():
                            raise KeyboardInterrupt
            except KeyboardInterrupt as problem:
                stopped = problem
            if not begun:
                raise stopped or KeyboardInterrupt
            try:
                with uninterrupted():
                    # A run that goes on later has no frame where it was left.
                    if stopped is None and (not series.frames or series.frames[-1][0] < run.time):
                        series.add(run.time, run.frame())
                    run.write(self.last)
                    with agreed(self.comm, named=False):
                        if self._is_first:
                            self._other_last.unlink(missing_ok=True)  # of the run before it went on in another way
            except KeyboardInterrupt as problem:
                stopped = stopped or problem
        return stopped

    def _is_interrupted(self) -> bool:
        """On ranks, whether an interruption of one of them waits; one process has been interrupted then."""
        return self.comm is not None and self.comm.allreduce(int(interruption_waits())) > 0

    def _resume(self, run: FolderRun, files: StateFiles, fingerprint: str) -> list[list[str]]:
        """Set a run to where its checkpoint stands; returns the rows of the history until there."""
        state = files.load(fingerprint)
        damage: ReadError | None = None
        try:
            with damage_told(self.checkpoint):
                run.resume(state)
        except ReadError as problem:  # by all ranks at the same place: they have the same names
            damage = problem
        with agreed(self.comm, named=False):
            if damage is not None:
                raise damage
        rows: list[list[str]] = []
        with agreed(self.comm, named=False):
            if self._is_first:
                rows = rows_until(self.history, run.record, run.step)
        return rows if self.comm is None else list(self.comm.bcast(rows))
