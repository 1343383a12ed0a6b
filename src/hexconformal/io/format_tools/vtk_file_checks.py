"""Damage of files that VTK does not see, or dies of: looked for before its readers get the file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...common import ReadError, python_can_be_started, run_python

__all__ = ["check_counts", "check_last_array", "check_reader_survives"]

_COUNTS = re.compile(rb"\b(?:NumberOf\w+|\w*Extent)\s*=\s*[\"']([^\"']*)[\"']")
_PIECES = re.compile(rb"<Piece[^>]*\bSource\s*=\s*[\"']([^\"']+)[\"']")
_MOST_IMAGE_POINTS = 2**34
_MOST_EXPANSION = 1100  # bytes that a compressed byte may stand for; zlib has 1032
_READING = """
import sys
from vtkmodules.vtkIOLegacy import vtkDataSetReader
reader = vtkDataSetReader()
for name in dir(reader):
    if name.startswith("ReadAll") and name.endswith("On"):
        getattr(reader, name)()
reader.SetFileName(sys.argv[1])
reader.Update()
"""
_TIME_LIMIT = 60.0, 1e-6  # seconds for reading a file in a process of its own: at least, and for every byte


def check_counts(path: Path) -> None:
    """Raise a ReadError if an XML file announces more than its size can hold: VTK would end the process."""
    data = path.read_bytes()
    head = data[: data.find(b"<AppendedData") % (len(data) + 1)]
    for match in _COUNTS.finditer(head):
        what = match[0].decode("ascii", "replace")
        try:
            numbers = [int(word) for word in match[1].split()] or [0]
        except ValueError:
            raise ReadError(f"counts must be numbers: {what}") from None
        if b"Extent" in match[0]:
            # Points of an image need no bytes of the file.
            too_many = float(np.prod(np.abs(np.diff(numbers)[::2]) + 1.0)) > _MOST_IMAGE_POINTS
        else:
            too_many = min(numbers) < 0 or max(numbers) > _MOST_EXPANSION * len(data)
        if too_many:
            raise ReadError(f"it announces more than a file of its size can hold: {what}")
    for piece in _PIECES.findall(head):
        place = path.parent / piece.decode("utf-8", "replace")
        if path.suffix.lower().startswith(".pvt") and place.is_file():
            check_counts(place)


def check_reader_survives(path: Path) -> None:
    """Raise a ReadError if VTK's reader of legacy files dies of this one, in a process of its own."""
    if not python_can_be_started():
        return
    limit = _TIME_LIMIT[0] + _TIME_LIMIT[1] * path.stat().st_size
    code = run_python(_READING, str(path), seconds=limit)
    if code is None:
        raise ReadError("the file is malformed: VTK does not come to an end with it")
    if code not in (0, 1, 2):
        raise ReadError("the file is malformed: VTK crashes on it")


def check_last_array(path: Path) -> None:
    """Raise a ReadError if the last array of a legacy text file is too short: VTK makes up what it lacks at its end."""
    data = path.read_bytes()
    if b"".join(data.split(b"\n", 3)[2:3]).strip().upper() != b"ASCII":
        return
    header = re.compile(
        rb"^(?:(?P<n>POINT_DATA|CELL_DATA)\s+(?P<count>\d+)|FIELD\s+\S+\s+(?P<fields>\d+)"
        rb"|(?P<vector>VECTORS|NORMALS|TENSORS|SCALARS)\s+\S+\s+\w+(?:[ \t]+(?P<width>\d+))?"
        rb"|(?P<points>POINTS)\s+(?P<number>\d+)\s+\w+"
        rb"|(?P<name>\S+) (?P<rows>\d+) (?P<columns>\d+) (?P<type>[a-z]\w*))"
        rb"[ \t]*\r?$",
        re.MULTILINE,
    )
    count, fields, expected, end, text = 0, 0, 0, 0, False
    for match in header.finditer(data):
        end = match.end()
        if match["n"]:
            count, expected = int(match["count"]), 0
        elif match["fields"]:
            fields, expected = int(match["fields"]), 0
        elif match["vector"]:
            width = {b"VECTORS": 3, b"NORMALS": 3, b"TENSORS": 9}.get(match["vector"].upper(), int(match["width"] or 1))
            expected = count * width
        elif match["points"]:
            expected = 3 * int(match["number"])
        else:
            fields, expected = fields - 1, int(match["rows"]) * int(match["columns"])
            text = match["type"] == b"string"
    tail = re.sub(rb"(?m)^(LOOKUP_TABLE|METADATA|INFORMATION|NAME|DATA)\b.*$", b"", data[end:])
    if fields > 0 or (not text and len(tail.split()) < expected):
        raise ReadError("the file is truncated: its last array is shorter than its header says")
