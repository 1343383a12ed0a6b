"""Polygon files (.ply, Turk 1994), text and binary, with all arrays on points and faces."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ...common import ReadError
from ..format_tools.polygons import Polygons, polygon_format

__all__ = ["PLY"]

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
_NAMES = {code: name for name, code in list(_TYPES.items())[:8]}
_CORNERS = ("vertex_indices", "vertex_index")


@dataclass
class _Element:
    """Part of a file: its name, number of rows, and properties (name, type of the count of a list or "", type)."""

    name: str
    count: int
    properties: list[tuple[str, str, str]]


def _read(path: Path) -> Polygons:
    """Read a polygon file."""
    data = path.read_bytes()
    match = re.match(rb"ply\s.*?^end_header[ \t]*\r?\n", data, re.DOTALL | re.MULTILINE)
    if match is None:
        raise ReadError("no ply file, or only the beginning of one")
    order, elements = _header(match[0].decode("ascii", "replace"))
    if order:
        body: Any = _Binary(data, match.end(), order)
    else:
        body = _Text(data[match.end() :].split())
    columns = {element.name: body.columns(element) for element in elements}
    vertex, face = columns.pop("vertex", {}), columns.pop("face", {})
    corners = next((face.pop(name) for name in _CORNERS if name in face), None)
    if corners is None or not {"x", "y", "z"} <= vertex.keys():
        raise ReadError("it has no vertices (x, y, z), or no faces (vertex_indices)")
    points = np.stack([vertex.pop(name) for name in "xyz"], axis=1).astype(np.float64)
    lists = [f"{name!r}" for part in (vertex, face) for name in part if isinstance(part[name], tuple)]
    left = [*columns, *lists]
    sizes, nodes = corners
    return Polygons(
        points,
        sizes,
        nodes,
        {name: values for name, values in vertex.items() if not isinstance(values, tuple)},
        {name: values for name, values in face.items() if not isinstance(values, tuple)},
        (f"left out of the .ply file: {', '.join(left)}",) if left else (),
    )


def _header(text: str) -> tuple[str, list[_Element]]:
    order, elements = None, []
    for line in text.splitlines()[1:-1]:
        words = line.split()
        if not words or words[0] in ("comment", "obj_info"):
            continue
        try:
            if words[0] == "format":
                order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[words[1]]
            elif words[0] == "element":
                elements.append(_Element(words[1], int(words[2]), []))
            elif words[:2] == ["property", "list"]:
                elements[-1].properties.append((words[4], _TYPES[words[2]], _TYPES[words[3]]))
            elif words[0] == "property":
                elements[-1].properties.append((words[2], "", _TYPES[words[1]]))
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

    def columns(self, element: _Element) -> dict[str, Any]:
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
                result[name] = sizes, numbers[_within(at + 1, sizes)].astype(kind).astype(np.int64)
            else:
                result[name] = values.astype(kind)
        return result


class _Binary:
    """The bytes of a binary file."""

    def __init__(self, data: bytes, place: int, order: str) -> None:
        self._bytes, self._place, self._order = data, place, order
        self._data = np.frombuffer(data, np.uint8)

    def columns(self, element: _Element) -> dict[str, Any]:
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


def _write(target: Path, polygons: Polygons) -> list[str]:
    """Write a binary polygon file."""
    lost: list[str] = []
    vertex = {name: polygons.points[:, i] for i, name in enumerate("xyz")}
    vertex |= _scalars(polygons.point_data, "point", lost)
    face = _scalars(polygons.cell_data, "cell", lost)
    head = ["ply", "format binary_little_endian 1.0"]
    head += [f"element vertex {len(polygons.points)}", *map(_property, vertex, vertex.values())]
    head += [f"element face {len(polygons.sizes)}", "property list uchar int vertex_indices"]
    head += [*map(_property, face, face.values()), "end_header", ""]
    starts, rows = polygons.starts, []
    for size in np.unique(polygons.sizes).tolist():
        mine = np.flatnonzero(polygons.sizes == size)
        corners = {str(i): polygons.nodes[starts[mine] + i].astype("i4") for i in range(size)}
        counted = {"count": np.full(len(mine), size, dtype="u1"), **corners}
        rows.append((mine, _records({**counted, **{name: values[mine] for name, values in face.items()}})))
    # Rows of different length: each goes where those before it end.
    width = np.empty(len(polygons.sizes), dtype=np.int64)
    for mine, records in rows:
        width[mine] = records.shape[1]
    offsets = np.cumsum(width) - width
    body = np.empty(int(width.sum()), dtype=np.uint8)
    for mine, records in rows:
        body[offsets[mine][:, None] + np.arange(records.shape[1])] = records
    with target.open("wb") as file:
        file.write("\n".join(head).encode("ascii"))
        file.write(_records(vertex).tobytes())
        file.write(body.tobytes())
    return lost


def _records(columns: dict[str, Any]) -> Any:
    """(rows, bytes) of arrays side by side."""
    dtype = np.dtype([(str(i), values.dtype.newbyteorder("<")) for i, values in enumerate(columns.values())])
    result = np.empty(len(next(iter(columns.values()))), dtype=dtype)
    for i, values in enumerate(columns.values()):
        result[str(i)] = values
    return result.view(np.uint8).reshape(len(result), -1)


def _property(name: str, values: Any) -> str:
    return f"property {_NAMES[values.dtype.str[1:]]} {name}"


def _scalars(data: dict[str, Any], what: str, lost: list[str]) -> dict[str, Any]:
    """Arrays as columns of a type and name the format knows."""
    result: dict[str, Any] = {}
    for name, values in data.items():
        values = np.asarray(values)
        key = re.sub(r"[^\x21-\x7e]+", "_", name)
        if values.dtype.kind == "b":
            values = values.astype(np.uint8)
        if values.dtype.kind in "iu" and values.dtype.itemsize == 8:
            small = values.astype(np.int32)
            values = small if np.array_equal(small, values) else values.astype(np.float64)
        if values.dtype.kind not in "iuf" or values.dtype.itemsize > 8 or key in (*_CORNERS, "x", "y", "z"):
            lost.append(f"{what} array {name!r}")
        elif values.ndim == 1:
            result[key] = values if values.dtype != np.float16 else values.astype(np.float32)
        else:
            flat = values.reshape(len(values), -1)
            result |= {f"{key}_{i}": flat[:, i] for i in range(flat.shape[1])}
            lost.append(f"the shape of the {what} array {name!r} (kept as {key}_0, {key}_1, ...)")
    return result


PLY = polygon_format("ply", _read, _write)
