"""The sections of a file of Gmsh, and the numbers in them, as text and binary."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError

__all__ = ["Encoding", "Numbers", "Section", "file_encoding", "file_sections"]


@dataclass(frozen=True)
class Encoding:
    """The version of a file, whether it is text, bytes of a count, and the order of bytes ("<" or ">")."""

    version: str
    ascii: bool
    size_bytes: int = 8
    byte_order: str = "<"

    def dtype(self, kind: str) -> np.dtype[Any]:
        """The type of an "int", a "size" or a "double" in a binary file."""
        return np.dtype(self.byte_order + {"int": "i4", "size": f"u{self.size_bytes}", "double": "f8"}[kind])

    def encoded(self, kind: str, rows: Any) -> bytes:
        """Rows of numbers as they stand in a file, each row on a line of text."""
        rows = np.atleast_2d(rows)
        if not self.ascii:
            return rows.astype(self.dtype(kind)).tobytes()
        spelled = _shortest if kind == "double" else str
        return "".join(" ".join(map(spelled, row)) + "\n" for row in rows.tolist()).encode()


@dataclass(frozen=True)
class Section:
    """A section ($Name to $EndName): its name, where it starts and ends, and where its body does."""

    name: str
    start: int
    body_start: int
    body_end: int
    end: int


def file_encoding(data: bytes) -> Encoding:
    """What the $MeshFormat of a file says.

    Raises
    ------
    ReadError
        If it says nothing that is known.
    """
    match = re.search(rb"\$MeshFormat\s+(\S+)\s+([01])\s+([48])[ \t]*\r?\n", data)
    if match is None:
        raise ReadError("its $MeshFormat must tell a version, 0 (text) or 1 (binary), and 4 or 8 bytes of a count")
    encoding = Encoding(match[1].decode("ascii", "replace"), match[2] == b"0", int(match[3]))
    if encoding.ascii:
        return encoding
    one = data[match.end() : match.end() + 4]
    orders = {(1).to_bytes(4, "little"): "<", (1).to_bytes(4, "big"): ">"}
    if one not in orders:
        raise ReadError("its $MeshFormat must end with a binary 1")
    return replace(encoding, byte_order=orders[one])


def file_sections(data: bytes) -> list[Section]:
    """The sections of a file in their order.

    Raises
    ------
    ReadError
        If one is not closed.

    Examples
    --------
    >>> [section.name for section in file_sections(b"$Nodes\\n0\\n$EndNodes\\n$Comments\\nab\\n$EndComments\\n")]
    ['Nodes', 'Comments']
    """
    opening = re.compile(rb"^[ \t]*\$(\w+)[ \t]*\r?\n", re.MULTILINE)
    found, place = [], 0
    while match := opening.search(data, place):
        name = match[1].decode("ascii", "replace")
        closing = re.compile(rb"\$End" + match[1] + rb"\b[^\n]*\n?").search(data, match.end())
        if closing is None:
            raise ReadError(f"it is truncated: ${name} is not closed by $End{name}")
        place = closing.end()
        found.append(Section(name, match.start(), match.end(), closing.start(), place))
    return found


class Numbers:
    """The numbers of a section's body one after the other, whether they are text or binary."""

    def __init__(self, body: bytes, encoding: Encoding, name: str) -> None:
        self._encoding, self._name, self._place = encoding, name, 0
        self._body = body
        self._words = _numbers_of_text(body, name) if encoding.ascii else np.empty(0)

    def take(self, kind: str, count: int) -> NDArray[Any]:
        """The next numbers, of kind "int", "size" or "double", as int64 or float64."""
        result_type = np.float64 if kind == "double" else np.int64
        width = 1 if self._encoding.ascii else self._encoding.dtype(kind).itemsize
        end = self._place + int(count) * width
        if count < 0 or end > (len(self._words) if self._encoding.ascii else len(self._body)):
            raise ReadError(f"${self._name} is truncated: it announces more numbers than it holds")
        if self._encoding.ascii:
            values = self._words[self._place : end]
        else:
            values = np.frombuffer(self._body, self._encoding.dtype(kind), int(count), self._place)
        self._place = end
        return values.astype(result_type)

    def one(self, kind: str) -> int:
        """The next number, an "int" or a "size"."""
        return int(self.take(kind, 1)[0])

    def records(self, dtype: np.dtype[Any], count: int) -> NDArray[Any]:
        """The next records of a binary file."""
        end = self._place + count * dtype.itemsize
        if count < 0 or end > len(self._body):
            raise ReadError(f"${self._name} is truncated: it announces more numbers than it holds")
        result = np.frombuffer(self._body, dtype, count, self._place)
        self._place = end
        return result

    def rest(self) -> NDArray[np.int64]:
        """All further numbers of a text file."""
        result = self._words[self._place :].astype(np.int64)
        self._place = len(self._words)
        return result

    def text_count(self) -> int:
        """The next number, a count that is a line of text in binary files too."""
        if self._encoding.ascii:
            return self.one("size")
        line, newline, _ = self._body[self._place : self._place + 64].partition(b"\n")
        if not newline or not line.strip().isdigit():
            raise ReadError(f"${self._name} must begin with a count")
        self._place += len(line) + 1
        return int(line)


def _numbers_of_text(body: bytes, name: str) -> NDArray[np.float64]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(body.decode("ascii"), dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError) as problem:
            raise ReadError(f"${name} holds something that is no number") from problem


def _shortest(value: float) -> str:
    # As Gmsh writes whole numbers.
    return repr(value).removesuffix(".0")
