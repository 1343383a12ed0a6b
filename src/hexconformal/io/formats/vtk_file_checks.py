"""What VTK does not see in a damaged file, or dies of: looked for before and after its readers have it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ...common import MeshError, ReadError, first_ids
from ..vtk_mesh import cell_table

__all__ = ["require_announced", "require_cells", "require_survival", "require_whole"]

_NUMBERS = re.compile(rb"\b(?:NumberOf\w+|\w*Extent)\s*=\s*[\"']([^\"']*)[\"']")
_PIECES = re.compile(rb"<Piece[^>]*\bSource\s*=\s*[\"']([^\"']+)[\"']")
_ENTRIES = 2**34  # points of an image
_RATIO = 1100  # bytes that a compressed byte may stand for; zlib has 1032
_SIZES = {1: 1, 3: 2, 5: 3, 8: 4, 9: 4, 10: 4, 11: 8, 12: 8, 13: 6, 14: 5, 15: 10, 16: 12}
_SIZES |= {21: 3, 22: 6, 23: 8, 24: 10, 25: 20, 26: 15, 27: 13, 28: 9, 29: 27}
_TRIAL = """
import sys
from vtkmodules.vtkIOLegacy import vtkDataSetReader
reader = vtkDataSetReader()
for name in dir(reader):
    if name.startswith("ReadAll") and name.endswith("On"):
        getattr(reader, name)()
reader.SetFileName(sys.argv[1])
reader.Update()
"""
_PATIENCE = 60.0, 1e-6  # seconds for a trial, and for every byte of the file


def require_announced(path: Path) -> None:
    """Raise a ReadError if an XML file announces more than its size can hold: VTK would end the process."""
    data = path.read_bytes()
    head = data[: data.find(b"<AppendedData") % (len(data) + 1)]
    for match in _NUMBERS.finditer(head):
        what = match[0].decode("ascii", "replace")
        try:
            numbers = [int(word) for word in match[1].split()] or [0]
        except ValueError:
            raise ReadError(f"it has a count that is no number: {what}") from None
        if b"Extent" in match[0]:
            # Points of an image need no bytes of the file.
            too_many = float(np.prod(np.abs(np.diff(numbers)[::2]) + 1.0)) > _ENTRIES
        else:
            too_many = min(numbers) < 0 or max(numbers) > _RATIO * len(data)
        if too_many:
            raise ReadError(f"it announces more than it can hold: {what}")
    for piece in _PIECES.findall(head):
        place = path.parent / piece.decode("utf-8", "replace")
        if path.suffix.lower().startswith(".pvt") and place.is_file():
            require_announced(place)


def require_survival(path: Path) -> None:
    """Raise a ReadError if VTK's reader of legacy files dies of this one, in a process of its own."""
    # Inside another program the interpreter may not be what can be started.
    if not Path(sys.executable or "none").name.lower().startswith(("python", "pypy")):
        return
    patience = _PATIENCE[0] + _PATIENCE[1] * path.stat().st_size
    command = [sys.executable, "-c", _TRIAL, str(path)]
    try:
        code = subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=patience
        ).returncode
    except subprocess.TimeoutExpired:
        raise ReadError("the file is malformed: VTK does not come to an end with it") from None
    if code not in (0, 1, 2):
        raise ReadError("the file is malformed: VTK crashes on it")


def require_whole(path: Path) -> None:
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


def require_cells(dataset: Any) -> None:
    """Raise a MeshError if cells of a VTK dataset have a wrong number of nodes, or nodes that are no points.

    VTK itself follows them wherever they lead.
    """
    count = dataset.GetNumberOfPoints()
    if dataset.IsA("vtkPolyData"):
        tables = [dataset.GetVerts(), dataset.GetLines(), dataset.GetPolys(), dataset.GetStrips()]
    elif dataset.IsA("vtkUnstructuredGrid"):
        tables = [dataset.GetCells()]
    else:
        tables = []
        if dataset.IsA("vtkStructuredGrid") and np.prod(dataset.dimensions) != count:
            raise MeshError(f"{count} points are not those of a grid of {dataset.dimensions}")
    for cells in tables:
        offsets, nodes = cell_table(cells)
        sizes = np.diff(offsets)
        if len(offsets) and (offsets[0] != 0 or (sizes < 0).any() or offsets[-1] > len(nodes)):
            raise MeshError("the sizes of its cells make no sense")
        bad = (nodes < 0) | (nodes >= count)
        if bad.any():
            ids = np.searchsorted(offsets, np.flatnonzero(bad), side="right") - 1
            raise MeshError(f"cells with node ids outside 0..{count - 1}: {first_ids(np.unique(ids))}")
    if dataset.IsA("vtkUnstructuredGrid"):
        wanted = np.array([_SIZES.get(code, 0) for code in range(256)])[dataset.celltypes]
        if len(wanted) != len(sizes):
            raise MeshError(f"{len(wanted)} types are given for {len(sizes)} cells")
        odd = np.flatnonzero((wanted > 0) & (wanted != sizes))
        if len(odd):
            raise MeshError(f"cells whose number of nodes is not that of their type: {first_ids(odd)}")
