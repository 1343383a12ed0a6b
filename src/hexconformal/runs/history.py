"""The history of a run: a CSV file with a row per record."""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from dataclasses import astuple, fields
from typing import Any

from ..common import OptionError, WriteError

__all__ = ["HistoryFile", "rows_until"]


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
    >>> from hexconformal import Record
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
        self._has_header = bool(rows)
        for row in rows:
            self._add(row)

    def __enter__(self) -> HistoryFile:
        return self

    def __exit__(self, *problem: Any) -> None:
        try:
            self._file.close()
        except OSError as failed:
            raise WriteError(f"cannot write {self._path}: {failed}") from failed

    def add(self, record: Any) -> None:
        """Append an iteration, a dataclass; the names of its fields are the header."""
        if not self._has_header:
            self._add([field.name for field in fields(record)])
            self._has_header = True
        self._add(astuple(record))

    def _add(self, row: Any) -> None:
        try:
            self._rows.writerow(row)
            self._file.flush()
        except OSError as problem:
            raise WriteError(f"cannot write {self._path}: {problem}") from problem


def rows_until(path: str | os.PathLike[str], record: type, step: int) -> list[list[str]]:
    """The header and the rows of a history up to a step, to go on with.

    Parameters
    ----------
    path
        The file.
    record
        The dataclass of its rows, `step` being the first field.
    step
        The last one that counts.

    Raises
    ------
    OptionError
        If it cannot be read, or is the history of something else.
    """
    try:
        with open(path, newline="", encoding="utf-8") as file:
            head, *rows = list(csv.reader(file)) or [[]]
    except (OSError, ValueError) as problem:
        raise OptionError(f"cannot go on with the history {path}: {problem}") from problem
    names = [field.name for field in fields(record)]
    if head and head != names:
        raise OptionError(f"{path} is the history of another kind of run")
    return [names, *(row for row in rows if len(row) == len(names) and int(row[0]) <= step)]
