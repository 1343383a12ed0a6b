"""XML files of VTK: counts, sizes and references that VTK would end the process of, or fill the memory with."""

from __future__ import annotations

import base64
import binascii
import re
from pathlib import Path

import numpy as np

from ....common import ReadError
from .references import referenced_file
from .xml_checks import parse_xml

__all__ = ["MOST_IMPLICIT_POINTS", "check_vtk_xml", "pieces_of"]

MOST_IMPLICIT_POINTS = 1 << 24  # those of images are in no file: so many there may be in any case

# Bytes that a compressed byte may stand for.
_MOST_EXPANSION = {"vtkZLibDataCompressor": 1100, "vtkLZ4DataCompressor": 300, "vtkLZMADataCompressor": 8000}
_ALLOWANCE = 1 << 20  # bytes that a file may stand for in any case
_APPENDED = b"<AppendedData"
_SIZES = {"Int8": 1, "UInt8": 1, "String": 1, "Bit": 1, "Int16": 2, "UInt16": 2, "Int32": 4, "UInt32": 4, "Float32": 4}
# Whose number of tuples an array has, by the element it is in.
_PER_POINT, _PER_CELL = ("PointData", "Points"), ("CellData", "Verts", "Lines", "Strips", "Polys", "Cells")


def check_vtk_xml(path: Path) -> int:
    """Raise a ReadError if an XML file announces more than its size can hold, or names files that it must not.

    Returns
    -------
    The bytes that its arrays will have, at most.
    """
    check = _Check(path)
    if not path.suffix.lower().startswith(".pvt"):
        return check.announced
    pieces = [referenced_file(path, name) for name in check.pieces]
    if len({piece.resolve() for piece in pieces}) < len(pieces):
        raise ReadError("its pieces must be different files")
    wrong = [piece.name for piece in pieces if piece.suffix.lower() != path.suffix.lower().replace("p", "", 1)]
    if wrong:
        raise ReadError(f"its pieces must be files of their own kind, not {wrong[0]!r}")
    checks = [_Check(piece) for piece in pieces]
    tuples = sum(max(piece.points, piece.cells) for piece in checks)
    if 8 * tuples * check.components > sum(piece.most for piece in checks):
        raise ReadError("it announces more components than its pieces can hold")
    return sum(piece.announced for piece in checks)


def pieces_of(path: Path) -> list[Path]:
    """The files that an XML file names as its pieces."""
    return [path.parent / name for name in _Check(path).pieces] if path.suffix.lower().startswith(".pvt") else []


class _Check:
    """Reads the elements of a file, and raises a ReadError at the first that it cannot be.

    Attributes
    ----------
    most
        Bytes that it may stand for.
    points, cells
        Of all pieces.
    announced
        Bytes of all its arrays.
    components
        The sum of those that arrays of pieces in other files have.
    pieces
        Names of these files.
    """

    def __init__(self, path: Path) -> None:
        self._data = path.read_bytes()
        # VTK, too, takes the first of these words for the beginning of what is no XML any more.
        end = self._data.find(_APPENDED)
        self._appended = self._data[end:] if end >= 0 else b""
        self.points = self.cells = self.components = 0
        self.pieces: list[str] = []
        self._piece = (0, 0)
        self.announced = 0
        self._section: list[str] = []
        self._head, self._wanted = "", 0
        self._factor, self._header, self._order = 1, "u4", "<"
        self.most = len(self._data) + _ALLOWANCE
        self._raw, self._start = False, 0
        if self._appended:
            opening = re.match(rb"<AppendedData\b([^>]*)>\s*_", self._appended)
            if opening is None:
                raise ReadError("the file is malformed or truncated (its appended data do not begin)")
            self._raw, self._start = b"raw" in opening[1], opening.end()
        parse_xml(self._data[:end] if end >= 0 else self._data, self._begin, self._end, end < 0, self._text)

    def _begin(self, name: str, given: dict[str, str]) -> None:
        self._section.append(name)
        if name == "VTKFile":
            self._factor = _MOST_EXPANSION.get(given.get("compressor", ""), 1)
            self.most = self._factor * len(self._data) + _ALLOWANCE
            self._header = "u8" if given.get("header_type") == "UInt64" else "u4"
            self._order = ">" if given.get("byte_order") == "BigEndian" else "<"
            if "compressor" in given and given["compressor"] not in _MOST_EXPANSION:
                raise ReadError(f"its compressor {given['compressor']!r} is not known")
            self._compressed = "compressor" in given
        counts = {key: _counts(key, value) for key, value in given.items() if _is_count(key)}
        if name == "Piece":
            if "Source" in given:
                self.pieces.append(given["Source"])
            self._begin_piece(counts)
        elif name == "PDataArray":
            self.components += int(*counts.get("NumberOfComponents", [1]))
        elif name in ("DataArray", "Array"):
            self._begin_array(given, counts)
        for key, numbers in counts.items():
            sides = np.abs(np.diff(numbers)[::2]) + 1.0
            most = max(MOST_IMPLICIT_POINTS, self.most) if "Extent" in key else self.most
            if (float(np.prod(sides)) if "Extent" in key else max(numbers)) > most:
                self._refuse(f'{key}="{given[key]}"')

    def _begin_piece(self, counts: dict[str, list[int]]) -> None:
        """Note the numbers of points and cells of a piece."""
        points = max(counts.get("NumberOfPoints", [0]))
        cells = sum(max(value) for key, value in counts.items() if key != "NumberOfPoints" and "Extent" not in key)
        if "Extent" in counts and len(counts["Extent"]) == 6:
            sides = np.abs(np.diff(counts["Extent"])[::2]).astype(float)
            points, cells = int(np.prod(sides + 1)), int(np.prod(np.maximum(sides, 1)))
        self._piece = points, cells
        self.points, self.cells = self.points + points, self.cells + cells

    def _begin_array(self, given: dict[str, str], counts: dict[str, list[int]]) -> None:
        """Add up what arrays announce, and prepare for the header of one."""
        around = self._section[-2] if len(self._section) > 1 else ""
        tuples = max(counts.get("NumberOfTuples", [0]))
        if around in _PER_POINT:
            tuples = max(tuples, self._piece[0])
        elif around in _PER_CELL and (around == "CellData" or given.get("Name") != "connectivity"):
            tuples = max(tuples, self._piece[1])
        self.announced += tuples * max(counts.get("NumberOfComponents", [1])) * _SIZES.get(given.get("type", ""), 8)
        if self.announced > self.most:
            self._refuse(f"array {given.get('Name', around)!r}")
        self._head, self._wanted = "", 0
        if given.get("format") == "binary":
            self._wanted = self._encoded(3 if self._compressed else 1)
        elif given.get("format") == "appended":
            self._check_appended(*_counts("offset", given.get("offset", "0")))

    def _text(self, piece: str) -> bool:
        """Collect the encoded header of an array."""
        if self._wanted:
            self._head += "".join(piece.split())
            while 0 < self._wanted <= len(self._head):
                self._wanted = self._check_header(_decoded(self._head[: self._wanted]))
        return self._wanted > 0

    def _end(self, name: str) -> None:
        self._section.pop()
        if name in ("DataArray", "Array") and self._wanted and self._head:
            raise ReadError("the file is malformed or truncated (an array ends within its header)")
        self._wanted = 0

    def _check_appended(self, offset: int) -> None:
        place = self._start + offset
        if place >= len(self._appended):
            raise ReadError(f"the file is malformed or truncated (nothing is at offset {offset})")
        count = 3 if self._compressed else 1
        while count:
            end = place + (self._bytes(count) if self._raw else self._encoded(count))
            part = self._appended[place:end]
            wanted = self._check_header(part if self._raw else _decoded(part.decode("ascii", "replace")))
            count = wanted and self._blocks + 3

    def _check_header(self, header: bytes) -> int:
        """Check sizes; returns how many encoded characters are needed to see all of them, 0 if these were all."""
        width = int(self._header[1])
        numbers = np.frombuffer(header[: len(header) // width * width], self._order + self._header).astype(object)
        if len(numbers) < (3 if self._compressed else 1):
            raise ReadError("the file is malformed or truncated (an array ends within its header)")
        if not self._compressed:
            if numbers[0] > len(self._data):
                self._refuse(f"an array of {numbers[0]} bytes")
            return 0
        blocks, size, last, *packed = numbers
        self._blocks = int(blocks)
        if blocks * width > len(self._data) or size > self.most or last > size:
            self._refuse(f"an array of {blocks} blocks of {size} bytes")
        if len(packed) < blocks:
            return self._encoded(3 + self._blocks)
        if sum(packed[: self._blocks]) > len(self._data) or blocks * size > self.most + size:
            self._refuse(f"an array of {blocks} blocks of {size} bytes")
        return 0

    def _bytes(self, count: int) -> int:
        return count * int(self._header[1])

    def _encoded(self, count: int) -> int:
        return 4 * -(-self._bytes(count) // 3)

    def _refuse(self, what: str) -> None:
        raise ReadError(f"it announces more than a file of its size can hold: {what}")


def _is_count(key: str) -> bool:
    return key.startswith("NumberOf") or key.endswith("Extent")


def _counts(key: str, value: str) -> list[int]:
    try:
        numbers = [int(word) for word in value.split()] or [0]
    except ValueError:
        raise ReadError(f'counts must be numbers: {key}="{value[:40]}"') from None
    if not key.endswith("Extent") and min(numbers) < 0:
        raise ReadError(f'counts must not be negative: {key}="{value[:40]}"')
    return numbers


def _decoded(text: str) -> bytes:
    try:
        return base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        raise ReadError("the file is malformed or truncated (an array is not encoded soundly)") from None
