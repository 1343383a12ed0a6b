"""What is seen of a run while it goes on: a live line in the terminal, and a row per iteration in a file."""

from __future__ import annotations

import csv
import logging
import os
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import astuple, fields
from typing import Any

from .errors import WriteError
from .options import Record

__all__ = ["HistoryFile", "Progress", "line"]


def line(record: Record) -> str:
    """One iteration in one line.

    Examples
    --------
    >>> line(Record(7, "lbfgs", 4.685, 0.01336, 1.0, 0.98728, 0.99937, 0, 1.36))
    '7 lbfgs  energy 4.685e+00  gradient 1.3e-02  min 0.9873  mean 0.9994  inverted 0  1.4 s'
    """
    return (
        f"{record.iteration} {record.phase}  energy {record.energy:.3e}  gradient {record.gradient:.1e}"
        f"  min {record.min_scaled_jacobian:.4f}  mean {record.mean_scaled_jacobian:.4f}"
        f"  inverted {record.inverted}  {record.seconds:.1f} s"
    )


class Progress:
    """A line on stderr that says what is going on, where stderr is a terminal; nothing anywhere else.

    Parameters
    ----------
    quiet
        Say nothing at all.

    Examples
    --------
    >>> with Progress(quiet=True) as progress:
    ...     progress.say("reading part.vtu")
    """

    def __init__(self, quiet: bool = False) -> None:
        self._status: Any = None
        self._stack = ExitStack()
        self._quiet = quiet
        self._wanted = not quiet and sys.stderr.isatty()

    def __enter__(self) -> Progress:
        if self._quiet:
            log = logging.getLogger("hexconformal")
            self._stack.callback(log.setLevel, log.level)
            log.setLevel(logging.ERROR)
        if self._wanted:
            from rich.console import Console

            self._status = self._stack.enter_context(Console(stderr=True).status("", spinner="line"))
        return self

    def __exit__(self, *problem: Any) -> None:
        self._stack.close()
        self._status = None

    def say(self, text: str) -> None:
        """Show a text in the place of the last one."""
        if self._status is not None:
            from rich.text import Text

            self._status.update(Text(text, no_wrap=True, overflow="ellipsis"))


class HistoryFile:
    """A CSV file with a row per iteration, each on disk as soon as it is known.

    Parameters
    ----------
    path
        The file; one that is there is replaced.
    rows
        What it begins with, for a run that goes on: the header and older rows.

    Raises
    ------
    WriteError
        If it cannot be written.

    Examples
    --------
    >>> with HistoryFile("run.csv") as history:
    ...     history.add(Record(0, "input", 24.0, 1.0, 0.0, 0.5, 0.75, 0, 0.125))
    >>> print(open("run.csv").read().splitlines()[1])
    0,input,24.0,1.0,0.0,0.5,0.75,0,0.125
    """

    def __init__(self, path: str | os.PathLike[str], rows: Sequence[Sequence[str]] = ()) -> None:
        self._path = path
        try:
            self._file = open(path, "w", newline="", encoding="utf-8")  # noqa: SIM115 (closed by __exit__)
        except OSError as problem:
            raise WriteError(f"cannot write {path}: {problem}") from problem
        self._rows = csv.writer(self._file, lineterminator="\n")
        self._begun = bool(rows)
        for row in rows:
            self._add(row)

    def __enter__(self) -> HistoryFile:
        return self

    def __exit__(self, *problem: Any) -> None:
        self._file.close()

    def add(self, record: Any) -> None:
        """Append an iteration, a dataclass; the names of its fields are the header."""
        if not self._begun:
            self._add([field.name for field in fields(record)])
            self._begun = True
        self._add(astuple(record))

    def _add(self, row: Any) -> None:
        try:
            self._rows.writerow(row)
            self._file.flush()
        except OSError as problem:
            raise WriteError(f"cannot write {self._path}: {problem}") from problem
