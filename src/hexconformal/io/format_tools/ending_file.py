"""Files for parsers that go on reading lines at the end of a file, for ever: there they are stopped."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ...common import ReadError

__all__ = ["open_ending_file"]

_MOST_LINES_BEYOND = 100


class _EndingText(io.TextIOWrapper):
    _beyond = 0

    def readline(self, *size: Any) -> str:  # type: ignore[override]
        line = super().readline(*size)
        self._beyond = _count_beyond(self._beyond, line)
        return line


class _EndingBytes(io.BufferedReader):
    _beyond = 0

    def readline(self, *size: Any) -> bytes:
        line = super().readline(*size)
        self._beyond = _count_beyond(self._beyond, line)
        return line


def _count_beyond(before: int, line: str | bytes) -> int:
    if line:
        return 0
    if before >= _MOST_LINES_BEYOND:
        raise ReadError("the file is truncated: it ends where more must come")
    return before + 1


@contextmanager
def open_ending_file(path: str | Path, mode: str = "r") -> Iterator[Any]:
    """A file to read, of text or bytes, which raises a ReadError if lines are read again and again beyond its end."""
    if "b" in mode:
        with _EndingBytes(io.FileIO(path)) as file:
            yield file
    else:
        with _EndingText(io.BufferedReader(io.FileIO(path)), encoding="utf-8", errors="surrogateescape") as text:
            yield text
