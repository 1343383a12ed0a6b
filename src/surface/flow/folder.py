"""A flow in a folder: frames, history, plots, and a checkpoint after every step to go on from."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from hexconformal.errors import OptionError, WriteError
from hexconformal.interrupt import uninterrupted
from hexconformal.progress import HistoryFile
from hexconformal.series import Series

from ..convert import as_pyvista
from ..io import write
from .checkpoint import load, save
from .evolve import Evolution, Moment
from .options import Record
from .plots import plot_history

__all__ = ["Folder"]


@dataclass(frozen=True)
class Folder:
    """Where a run is written.

    Attributes
    ----------
    path
        The folder; it is made if it is not there.
    """

    path: Path

    @property
    def frames(self) -> Path:
        """The series that ParaView plays."""
        return self.path / "run.pvd"

    @property
    def history(self) -> Path:
        """A row per step."""
        return self.path / "history.csv"

    @property
    def checkpoint(self) -> Path:
        """Where the run stands."""
        return self.path / "checkpoint.npz"

    @property
    def last(self) -> Path:
        """The surface at the end."""
        return self.path / "last.vtu"

    @property
    def plot(self) -> Path:
        """Energy, reduced volume, angles, time and time step against the number of steps."""
        return self.path / "history.png"

    def prepare(self, resume: bool, overwrite: bool) -> None:
        """Make the folder, or see that the run in it may be gone on with, or replaced.

        Raises
        ------
        OptionError
            If there is a run already and neither is asked for, or none to go on with.
        WriteError
            If the folder cannot be made.
        """
        there = self.checkpoint.exists()
        if resume and not there:
            raise OptionError(f"there is no run in {self.path} to resume: {self.checkpoint.name} is missing")
        if there and not (resume or overwrite):
            raise OptionError(f"{self.path} holds a run: --resume goes on with it, --overwrite starts anew")
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as problem:
            raise WriteError(f"cannot make the folder {self.path}: {problem}") from problem

    def follow(self, run: Evolution, resume: bool, every: int, told: Callable[[Record], None]) -> BaseException | None:
        """Follow a flow to its end and write everything; returns what ended it early.

        Parameters
        ----------
        run
            The flow, not begun.
        resume
            Go on from the checkpoint.
        every
            A frame every so many steps, and at output times.
        told
            Called with every record.

        Raises
        ------
        OptionError
            If the checkpoint belongs to another run.
        ReadError
            If it cannot be read.
        WriteError
            If something cannot be written.
        """
        rows: list[list[str]] = []
        if resume:
            load(self.checkpoint, run)
            rows = _rows_until(self.history, run.step)
        moment: Moment | None = None
        stopped: BaseException | None = None
        with HistoryFile(self.history, rows) as history, Series(self.frames, run.time if resume else None) as series:
            try:
                for moment in run:
                    record = moment.record
                    with uninterrupted():
                        history.add(record)
                        if record.step % every == 0 or record.time in run.stepping.outputs:
                            series.add(record.time, as_pyvista(moment.surface_mesh))
                        # Last: what it counts as done is written.
                        save(self.checkpoint, run)
                    told(record)
            except KeyboardInterrupt as problem:
                stopped = problem
            with uninterrupted():
                if moment is not None:
                    if series.frames and series.frames[-1][0] < moment.record.time:
                        series.add(moment.record.time, as_pyvista(moment.surface_mesh))
                    write(self.last, moment.surface_mesh)
        plot_history(self.plot, self.history)
        return stopped


def _rows_until(path: Path, step: int) -> list[list[str]]:
    """The header and the rows of a history up to a step."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            head, *rows = list(csv.reader(file))
    except (OSError, ValueError) as problem:
        raise OptionError(f"cannot go on with the history {path}: {problem}") from problem
    if head != [field.name for field in fields(Record)]:
        raise OptionError(f"{path} is no history of a flow")
    return [head, *(row for row in rows if len(row) == len(head) and int(row[0]) <= step)]


def folder(path: Any) -> Folder:
    """The folder at a path."""
    return Folder(Path(os.fspath(path)))
