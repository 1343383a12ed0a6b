"""The header and the numbers of a polygon file (.ply), as text and binary."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ....common import ReadError

__all__ = ["TYPES", "TYPE_NAMES", "Element", "Header", "file_body", "file_header"]

_LARGEST = 2**31  # numbers of points, more than any file of text has

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
TYPE_NAMES = {code: name for name, code in list(TYPES.items())[:8]}


@dataclass
class Element:
    """Part of a file: its name, number of rows, and properties (name, type of the count of a list or "", type)."""

    name: str
    count: int
    properties: list[tuple[str, str, str]]


@dataclass
class Header:
    """The order of bytes ("<", ">", or "" for text), the elements in their order, and where the numbers start."""

    order: str
    elements: list[Element]
    end: int


def file_header(data: bytes) -> Header:
    """The header of a file.

    Raises
    ------
    ReadError
        If there is none, or it makes no sense.
    """
    match = re.match(rb"ply\s.*?^end_header[ \t]*\r?\n", data, re.DOTALL | re.MULTILINE)
    if match is None:
        raise ReadError("no ply file, or only the beginning of one")
    return Header(*_header(match[0].decode("ascii", "replace")), match.end())


def file_body(data: bytes, header: Header) -> Any:
    """What gives the columns of the elements of a file, in their order."""
    return _Binary(data, header.end, header.order) if header.order else _Text(data[header.end :].split())


def _header(text: str) -> tuple[str, list[Element]]:
    order, elements = None, []
    for line in text.splitlines()[1:-1]:
        words = line.split()
        if not words or words[0] in ("comment", "obj_info"):
            continue
        try:
            if words[0] == "format":
                order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[words[1]]
            elif words[0] == "element":
                elements.append(Element(words[1], int(words[2]), []))
            elif words[:2] == ["property", "list"]:
                elements[-1].properties.append((words[4], TYPES[words[2]], TYPES[words[3]]))
            elif words[0] == "property":
                elements[-1].properties.append((words[2], "", TYPES[words[1]]))
            else:
                raise KeyError(words[0])
        except (KeyError, IndexError, ValueError) as problem:
            raise ReadError(f"its header has a line that makes no sense: {line!r}") from problem
    if order is None:
        raise ReadError("its header does not tell the format")
    return order, elements


class _Text:
    """The numbers of a text file."""

    def __init__(self, words: list[bytes]) -> None:
        self._numbers = np.array(words, dtype=np.float64)
        self._place = 0

    def columns(self, element: Element) -> dict[str, Any]:
        """The properties of an element: an array each, of a list ``(sizes, values)``."""
        properties, numbers, place = element.properties, self._numbers, self._place
        starts = np.empty((element.count, len(properties)), dtype=np.int64)
        if not any(of for _, of, _ in properties):
            width = len(properties)
            starts[:] = place + width * np.arange(element.count)[:, None] + np.arange(width)
            place += width * element.count
        else:
            for row in range(element.count):
                for column, (_, of, _) in enumerate(properties):
                    starts[row, column] = place
                    place += 1 + (int(numbers[place]) if of and place < len(numbers) else 0)
        if place > len(numbers):
            raise ReadError(f"it is truncated: {place} numbers are announced, {len(numbers)} are there")
        self._place = place
        result: dict[str, Any] = {}
        for column, (name, of, kind) in enumerate(properties):
            at = starts[:, column]
            values = numbers[at]
            if of:
                sizes = values.astype(np.int64)
                listed = numbers[_within(at + 1, sizes)]
                if not (np.abs(listed) < _LARGEST).all():
                    raise ReadError(f"the lists of {name} must have numbers of points, not {listed.max():g}")
                result[name] = sizes, listed.astype(np.int64)
            else:
                result[name] = values.astype(kind)
        return result


class _Binary:
    """The bytes of a binary file."""

    def __init__(self, data: bytes, place: int, order: str) -> None:
        self._bytes, self._place, self._order = data, place, order
        self._data = np.frombuffer(data, np.uint8)

    def columns(self, element: Element) -> dict[str, Any]:
        """The properties of an element: an array each, of a list ``(sizes, values)``."""
        properties = element.properties
        widths = [(np.dtype(of or kind).itemsize, np.dtype(kind).itemsize if of else 0) for _, of, kind in properties]
        starts = np.empty((element.count, len(properties)), dtype=np.int64)
        place = self._place
        if not any(of for _, of, _ in properties):
            offsets = np.cumsum([0, *(own for own, _ in widths)])
            starts[:] = place + offsets[-1] * np.arange(element.count)[:, None] + offsets[:-1]
            place += int(offsets[-1]) * element.count
        else:
            order: Literal["little", "big"] = "little" if self._order == "<" else "big"
            for row in range(element.count):
                for column, (own, each) in enumerate(widths):
                    starts[row, column] = place
                    place += own + (int.from_bytes(self._bytes[place : place + own], order) * each if each else 0)
        if place > len(self._data):
            raise ReadError(f"it is truncated: {place} bytes are announced, {len(self._data)} are there")
        self._place = place
        result: dict[str, Any] = {}
        for column, (name, of, kind) in enumerate(properties):
            at, (own, each) = starts[:, column], widths[column]
            values = self._values(at, of or kind)
            if of:
                sizes = values.astype(np.int64)
                inside = _within(np.zeros_like(at), sizes)
                result[name] = sizes, self._values(np.repeat(at + own, sizes) + each * inside, kind).astype(np.int64)
            else:
                result[name] = values
        return result

    def _values(self, places: Any, kind: str) -> Any:
        size = np.dtype(kind).itemsize
        raw = np.ascontiguousarray(self._data[places[:, None] + np.arange(size)])
        return raw.view(self._order + kind).ravel().astype(kind)


def _within(starts: Any, sizes: Any) -> Any:
    """Places start, start + 1, ... of every list, one list after the other."""
    return np.repeat(starts, sizes) + np.arange(int(sizes.sum())) - np.repeat(np.cumsum(sizes) - sizes, sizes)
