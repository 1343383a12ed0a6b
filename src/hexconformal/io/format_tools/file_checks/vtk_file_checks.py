"""Damage of legacy files that VTK does not see, or dies of: looked for before its reader gets the file."""

from __future__ import annotations

import re
from pathlib import Path

from ....common import ReadError
from .reader_trial import try_reader

__all__ = ["check_last_array", "check_reader_survives"]

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


def check_reader_survives(path: Path) -> None:
    """Raise a ReadError if VTK's reader of legacy files dies of this one, in a process of its own."""
    try_reader(_READING, path, "VTK")


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
