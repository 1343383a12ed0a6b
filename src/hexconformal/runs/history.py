"""The history of a run: a CSV file with a row per record."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from dataclasses import astuple, fields
from typing import Any

from ..common import OptionError, WriteError, first_ids, write_text

__all__ = ["HistoryFile", "rows_until"]


class HistoryFile:
    """A CSV file with a row per iteration, each on disk as soon as it is known.

    Parameters
    ----------
    path
        The file; one that is there is replaced.
    rows
        What it begins with, for a run that goes on: the header and older rows. They are there at every moment.

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
    0,input,24.0,1.0,0.0,0.5,0.75,0,0.125,0,0.0,0.0
    """

    def __init__(self, path: str | os.PathLike[str], rows: Sequence[Sequence[str]] = ()) -> None:
        self._path = path
        self._has_header = bool(rows)
        if rows:
            text = io.StringIO()
            csv.writer(text, lineterminator="\n").writerows(rows)
            write_text(path, text.getvalue())
        try:
            self._file = open(path, "a" if rows else "w", newline="", encoding="utf-8")  # noqa: SIM115 (see __exit__)
        except OSError as problem:
            raise WriteError(f"cannot write {path}: {problem}") from problem
        self._rows = csv.writer(self._file, lineterminator="\n")

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
        If it cannot be read, is the history of something else, or lacks steps.
    """
    names = [field.name for field in fields(record)]
    try:
        with open(path, newline="", encoding="utf-8") as file:
            head, *rows = list(csv.reader(file)) or [[]]
        if head and head != names:
            raise OptionError(f"{path} is the history of another kind of run")
        kept = [row for row in rows if len(row) == len(names) and int(row[0]) <= step]
    except (OSError, ValueError, csv.Error) as problem:
        if isinstance(problem, OptionError):
            raise
        raise OptionError(f"cannot go on with the history {path}: {problem}") from problem
    missing = sorted(set(range(1, step + 1)) - {int(row[0]) for row in kept})
    if missing:
        raise OptionError(f"cannot go on with the history {path}: steps without a row: {first_ids(missing)}")
    return [names, *kept]
