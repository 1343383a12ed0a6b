"""Polygon files (.ply, Turk 1994), text and binary, with all arrays on points and faces."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError
from ...format_tools.polygons import Polygons, polygon_format
from ...format_tools.rewriting import decoded, encoded, put_words
from .contents import TYPE_NAMES, file_body, file_header

__all__ = ["PLY"]

_CORNERS = ("vertex_indices", "vertex_index")


def _read(path: Path) -> Polygons:
    """Read a polygon file."""
    data = path.read_bytes()
    header = file_header(data)
    body = file_body(data, header)
    columns = {element.name: body.columns(element) for element in header.elements}
    vertex, face = columns.pop("vertex", {}), columns.pop("face", {})
    corners = next((face.pop(name) for name in _CORNERS if name in face), None)
    if corners is None or not {"x", "y", "z"} <= vertex.keys():
        raise ReadError("it has no vertices (x, y, z), or no faces (vertex_indices)")
    points = np.stack([vertex.pop(name) for name in "xyz"], axis=1).astype(np.float64)
    lists = [
        f"{len(part[name][0])} {name!r} of {what}"
        for what, part in (("points", vertex), ("faces", face))
        for name in part
        if isinstance(part[name], tuple)
    ]
    left = [*(f"{element.count} {element.name}" for element in header.elements if element.name in columns), *lists]
    sizes, nodes = corners
    return Polygons(
        points,
        sizes,
        nodes,
        {name: values for name, values in vertex.items() if not isinstance(values, tuple)},
        {name: values for name, values in face.items() if not isinstance(values, tuple)},
        tuple(left),
    )


def _put_points(data: bytes, points: NDArray[np.float64]) -> tuple[bytes, list[str]] | None:
    """The file with other places of its points, in double precision if they need it; None if points have lists."""
    header = file_header(data)
    vertex = header.elements[0]
    if vertex.name != "vertex" or any(of for _, of, _ in vertex.properties):
        return None
    names = [name for name, _, _ in vertex.properties]
    kinds = {name: kind for name, _, kind in vertex.properties}
    old = np.stack([file_body(data, header).columns(vertex)[name] for name in "xyz"], axis=1)
    exact = all(np.array_equal(points[:, k].astype(kinds[name]), points[:, k]) for k, name in enumerate("xyz"))
    new_kinds = kinds if exact else {**kinds, **dict.fromkeys("xyz", "f8")}
    head = data[: header.end]
    if not exact:
        head = re.sub(rb"(?m)^(\s*property\s+)\w+(\s+[xyz]\s*)$", rb"\1double\2", head)
    if header.order:
        record = [np.dtype([(name, header.order + kind[name]) for name in names]) for kind in (kinds, new_kinds)]
        rows = np.frombuffer(data, record[0], vertex.count, header.end)
        result = np.empty(len(rows), record[1])
        for name in names:
            result[name] = points[:, "xyz".index(name)] if name in ("x", "y", "z") else rows[name]
        rest = data[header.end + rows.nbytes :]
        body = result.tobytes() + rest
    else:
        lines = decoded(data[header.end :]).splitlines(keepends=True)
        if any(len(line.split()) != len(names) for line in lines[: vertex.count]):
            return None
        for number, row in enumerate(points.tolist()):
            for name, value in zip("xyz", row, strict=True):
                lines[number] = put_words(lines[number], names.index(name), [repr(value)])
        body = encoded("".join(lines))
    stale = {"nx", "ny", "nz"} <= set(names) and not np.array_equal(old, points)
    return head + body, [f"{len(points)} normals, which are those of the file: the surface moved"] if stale else []


def _write(target: Path, polygons: Polygons) -> list[str]:
    """Write a polygon file: as text where faces have arrays, since some readers (meshio) misread binary ones."""
    lost: list[str] = []
    vertex = {name: polygons.points[:, i] for i, name in enumerate("xyz")}
    vertex |= _scalars(polygons.point_data, "point", lost)
    face = _scalars(polygons.cell_data, "cell", lost)
    head = ["ply", "format ascii 1.0" if face else "format binary_little_endian 1.0"]
    head += [f"element vertex {len(polygons.points)}", *map(_property, vertex, vertex.values())]
    head += [f"element face {len(polygons.sizes)}", "property list uchar int vertex_indices"]
    head += [*map(_property, face, face.values()), "end_header", ""]
    if face:
        target.write_text("\n".join([*head[:-1], *_text_lines(vertex, polygons, face)]) + "\n", encoding="ascii")
        return lost
    starts, rows = polygons.starts, []
    for size in np.unique(polygons.sizes).tolist():
        mine = np.flatnonzero(polygons.sizes == size)
        corners = {str(i): polygons.nodes[starts[mine] + i].astype("i4") for i in range(size)}
        rows.append((mine, _records({"count": np.full(len(mine), size, dtype="u1"), **corners})))
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


def _text_lines(vertex: dict[str, Any], polygons: Polygons, face: dict[str, Any]) -> Iterator[str]:
    """Lines of points and of faces."""
    for point in zip(*(values.tolist() for values in vertex.values()), strict=True):
        yield " ".join(map(repr, point))
    for nodes, *values in zip(polygons.face_lists(), *(array.tolist() for array in face.values()), strict=True):
        yield " ".join(map(repr, [len(nodes), *nodes, *values]))


def _records(columns: dict[str, Any]) -> Any:
    """(rows, bytes) of arrays side by side."""
    dtype = np.dtype([(str(i), values.dtype.newbyteorder("<")) for i, values in enumerate(columns.values())])
    result = np.empty(len(next(iter(columns.values()))), dtype=dtype)
    for i, values in enumerate(columns.values()):
        result[str(i)] = values
    return result.view(np.uint8).reshape(len(result), -1)


def _property(name: str, values: Any) -> str:
    return f"property {TYPE_NAMES[values.dtype.str[1:]]} {name}"


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
        if values.dtype.str[1:] in ("i1", "i2", "u2"):
            values = values.astype(np.int32)  # types that not every reader knows
        if values.dtype.kind not in "iuf" or values.dtype.itemsize > 8 or key in (*_CORNERS, "x", "y", "z"):
            lost.append(f"{what} array {name!r}")
        elif values.ndim == 1:
            result[key] = values if values.dtype != np.float16 else values.astype(np.float32)
        else:
            flat = values.reshape(len(values), -1)
            result |= {f"{key}_{i}": flat[:, i] for i in range(flat.shape[1])}
            lost.append(f"the shape of the {what} array {name!r} (kept as {key}_0, {key}_1, ...)")
    return result


PLY = polygon_format("ply", _read, _write, _put_points, holds_arrays=True)
