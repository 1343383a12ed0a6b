"""Some rows of the arrays of a .vtu file, read without the others: how ranks share a file."""

from __future__ import annotations

import base64
import binascii
import mmap
import re
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import ReadError

__all__ = ["VtuRows"]

_TYPES = {"Float32": "f4", "Float64": "f8"} | {
    f"{sign}Int{8 * size}": f"{kind}{size}" for sign, kind in (("", "i"), ("U", "u")) for size in (1, 2, 4, 8)
}
_SECTIONS = ("PointData", "CellData", "Points", "Cells")
_HEAD = 4096  # bytes of a tag, at most


@dataclass(frozen=True)
class _Array:
    """Where an array is: its row type, and where its bytes begin, encoded or not."""

    dtype: Any
    components: int
    start: int
    encoded: bool


class VtuRows:
    """The arrays of a .vtu file of one piece, in binary form (inline or appended, base64 or raw, zlib or none).

    The file is mapped, not read: what is asked for is decoded, nothing else.

    Parameters
    ----------
    path
        The file.

    Attributes
    ----------
    points, cells
        Numbers of its points and cells.

    Raises
    ------
    ReadError
        If it is another kind of file, or ends early.
    """

    def __init__(self, path: Path) -> None:
        with path.open("rb") as file:
            self._map = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        root, place = self._tag(b"<VTKFile", 0)
        if root.get("type") != "UnstructuredGrid":
            raise ReadError("it is no unstructured grid")
        self._order = {"LittleEndian": "<", "BigEndian": ">"}.get(root.get("byte_order", ""), "<")
        self._header = self._order + {"UInt64": "u8"}.get(root.get("header_type", ""), "u4")
        if root.get("compressor", "vtkZLibDataCompressor") != "vtkZLibDataCompressor":
            raise ReadError(f"compressor {root['compressor']!r} is not known")
        self._compressed = "compressor" in root
        appended = self._map.find(b"<AppendedData", place)
        end = appended if appended >= 0 else len(self._map)
        piece, place = self._tag(b"<Piece", place)
        if self._map.find(b"<Piece", place, end) >= 0:
            raise ReadError("it has several pieces")
        self.points, self.cells = (int(piece.get(f"NumberOf{what}", 0)) for what in ("Points", "Cells"))
        self._appended, self._raw = 0, False
        if appended >= 0:
            tag, place_of_data = self._tag(b"<AppendedData", appended)
            self._appended = self._map.find(b"_", place_of_data) + 1
            self._raw = tag.get("encoding") == "raw"
        self._arrays: dict[str, dict[str, _Array]] = {section: {} for section in _SECTIONS}
        self._find_arrays(place, end)

    def names(self, section: str) -> list[str]:
        """Names of the arrays of "PointData" or "CellData"."""
        return list(self._arrays[section])

    def rows(self, section: str, name: str, first: int, last: int) -> NDArray[Any]:
        """Rows first to last of an array; of "Points" whatever its name.

        Raises
        ------
        ReadError
            If there is none of that name, or the file ends early.
        """
        arrays = self._arrays[section]
        array = arrays.get(name) if section != "Points" else next(iter(arrays.values()), None)
        if array is None:
            raise ReadError(f"the file is malformed or truncated (there is no array {name!r} in {section})")
        width = array.dtype.itemsize * array.components
        try:
            data = self._bytes(array, first * width, last * width)
        except (binascii.Error, ValueError, zlib.error, IndexError) as problem:
            raise ReadError(f"the file is malformed or truncated (array {name!r}: {problem})") from problem
        if len(data) != (last - first) * width:
            raise ReadError(f"the file is malformed or truncated (array {name!r} is too short)")
        found = np.frombuffer(data, array.dtype).astype(array.dtype.newbyteorder("="))
        return found if array.components == 1 else found.reshape(-1, array.components)

    # ---------------------------------------------------------------------------------------- structure
    def _tag(self, name: bytes, place: int) -> tuple[dict[str, str], int]:
        """The attributes of the next tag of a name, and where it ends."""
        start = self._map.find(name, place)
        end = self._map.find(b">", start, start + _HEAD)
        if start < 0 or end < 0:
            raise ReadError(f"the file is malformed or truncated (there is no {name.decode()}>)")
        text = self._map[start:end].decode("utf-8", "replace")
        return dict(re.findall(r"""([\w:]+)\s*=\s*["']([^"']*)["']""", text)), end + 1

    def _find_arrays(self, place: int, end: int) -> None:
        for section in _SECTIONS:
            found = re.compile(rf"<{section}(\s[^>]*)?(/?)>".encode()).search(self._map, place, end)
            if found is None or found[2]:
                continue
            at, last = found.end(), self._map.find(f"</{section}>".encode(), found.end(), end)
            while (at := self._map.find(b"<DataArray", at, last)) >= 0:
                given, at = self._tag(b"<DataArray", at)
                self._arrays[section][given.get("Name", section)] = self._placed(given, at)

    def _placed(self, given: dict[str, str], at: int) -> _Array:
        form, kind = given.get("format"), given.get("type", "")
        if kind not in _TYPES or form not in ("binary", "appended"):
            raise ReadError(f"array {given.get('Name')!r} of {kind} is not in binary form")
        dtype = np.dtype(self._order + _TYPES[kind])
        components = int(given.get("NumberOfComponents", 1) or 1)
        if form == "appended":
            return _Array(dtype, components, self._appended + int(given.get("offset", 0)), not self._raw)
        while self._map[at : at + 1].isspace():
            at += 1
        return _Array(dtype, components, at, True)

    # --------------------------------------------------------------------------------------------- bytes
    def _bytes(self, array: _Array, first: int, last: int) -> bytes:
        """Bytes first to last of the array, decoded."""
        width = int(self._header[-1])
        if not self._compressed:
            alone = 4 * -(-width // 3)  # characters of a header that is encoded by itself, as VTK does
            padding = b"=" * (-width % 3)
            head = self._map[array.start : array.start + alone].rstrip(b"=") + padding
            if array.encoded and head == self._map[array.start : array.start + alone]:
                return self._part(array, alone, first, last)
            return self._part(array, 0, width + first, width + last)
        blocks, size, _ = self._numbers(array, 0, 3)
        if blocks == 0 or first >= last:
            return b""
        if blocks * width > len(self._map):
            raise ValueError(f"it announces {blocks} blocks")
        lengths = self._numbers(array, 3, 3 + blocks)
        ends = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
        # The header is encoded by itself.
        header = (3 + blocks) * width
        start = 4 * -(-header // 3) if array.encoded else header
        here, until = first // size, min(-(-last // size), blocks)
        packed = self._part(array, start, int(ends[here]), int(ends[until]))
        parts = [
            zlib.decompressobj().decompress(packed[ends[k] - ends[here] : ends[k + 1] - ends[here]], size)
            for k in range(here, until)
        ]
        return b"".join(parts)[first - here * size : last - here * size]

    def _numbers(self, array: _Array, first: int, last: int) -> list[int]:
        """Numbers of the header of a compressed array."""
        width = int(self._header[-1])
        data = self._part(array, 0, first * width, last * width)
        found = [int(number) for number in np.frombuffer(data, self._header)]
        if len(found) != last - first:
            raise ValueError("its header is too short")
        return found

    def _part(self, array: _Array, skipped: int, first: int, last: int) -> bytes:
        """Bytes first to last of what begins behind some skipped ones of the file, decoded where it is encoded."""
        start = array.start + skipped
        if not array.encoded:
            return self._map[start + first : start + last]
        begin, end = first // 3, -(-last // 3)
        text = self._map[start + 4 * begin : start + 4 * end]
        # What is encoded may end within: the last group, or what follows it, is padding.
        text = text.split(b"<")[0].strip()
        return base64.b64decode(text + b"=" * (-len(text) % 4))[first - 3 * begin : last - 3 * begin]
