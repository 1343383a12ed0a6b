"""Stereolithography files (.stl), text and binary; written in binary."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import ReadError, WriteError, first_ids
from ..format_tools.polygons import Polygons, polygon_format
from ..format_tools.rewriting import decoded, encoded, put_words

__all__ = ["STL"]

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def _read(path: Path) -> Polygons:
    """Read a stereolithography file; its triangles repeat their points, which are joined where they are equal."""
    data = path.read_bytes()
    points, corners = _joined(_corners(data))
    groups = _solids(data) if _is_text(data) else {}
    model = (f"solids {', '.join(groups)}",) if groups else ()
    return Polygons(points, np.full(len(corners) // 3, 3), corners, model=model, groups=groups)


def _solids(data: bytes) -> dict[str, list[range]]:
    """Runs of facets by the names of the solids that they are in."""
    groups: dict[str, list[range]] = {}
    name, start, count = "", 0, 0
    for match in re.finditer(rb"(?im)^[ \t]*(?:(facet)\b|(?:end)?solid\b[ \t]*([^\r\n]*))", data):
        if match[1]:
            count += 1
            continue
        if name and count > start:
            groups.setdefault(name, []).append(range(start, count))
        is_head = not match[0].lstrip().lower().startswith(b"end")
        name, start = decoded(match[2]).strip() if is_head else "", count
    return groups


def _put_points(data: bytes, points: NDArray[np.float64]) -> tuple[bytes, list[str]]:
    """The file with other places of its points, and the normals of these; names and attributes stay as they are."""
    _, corners = _joined(_corners(data))
    facets = _facets(points[corners].reshape(-1, 3, 3))
    if not _is_text(data):
        result = np.frombuffer(data, _FACET, len(facets), 84).copy()
        result["corners"], result["normal"] = facets["corners"], facets["normal"]
        return data[:84] + result.tobytes(), ["digits beyond single precision"]
    vertices, normals = iter(points[corners].tolist()), iter(facets["normal"].tolist())
    lines = []
    for line in decoded(data).splitlines(keepends=True):
        word = (line.split(maxsplit=1) or [""])[0].lower()
        if word in ("vertex", "facet"):
            new = next(vertices) if word == "vertex" else next(normals)
            line = put_words(
                line, 1 if word == "vertex" else 2, [repr(x) if word == "vertex" else f"{x:.7g}" for x in new]
            )
        lines.append(line)
    return encoded("".join(lines)), []


def _is_text(data: bytes) -> bool:
    return len(data) != 84 + int.from_bytes(data[80:84], "little") * _FACET.itemsize


def _corners(data: bytes) -> NDArray[np.float64]:
    """(3 m, 3) corners of all triangles."""
    count = int.from_bytes(data[80:84], "little")
    if not _is_text(data):
        with np.errstate(invalid="ignore"):  # a NaN is found later
            return np.frombuffer(data, _FACET, count, 84)["corners"].reshape(-1, 3).astype(np.float64)
    if data.lstrip()[:5].lower() != b"solid" or b"facet" not in data:
        raise ReadError(f"it is {len(data)} bytes long, {84 + count * _FACET.itemsize} are announced")
    rows = [words for line in data.decode("ascii", "replace").splitlines() if (words := line.split())]
    if rows[-1][0].lower() != "endsolid":
        raise ReadError("its end is missing")
    corners = np.array([row[1:4] for row in rows if row[0].lower() == "vertex"], dtype=np.float64)
    if len(corners) % 3:
        raise ReadError("a facet is incomplete")
    return corners


def _joined(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Different points in the order in which they first appear, and which of them each corner is."""
    points, first, inverse = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    return points[order], place[inverse.ravel()]


def _facets(corners: NDArray[np.float64]) -> NDArray[Any]:
    """The records of triangles (m, 3, 3) with their normals."""
    facets = np.zeros(len(corners), dtype=_FACET)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    facets["corners"], facets["normal"] = corners, normals / np.where(lengths > 0, lengths, 1.0)
    return facets


def _write(target: Path, polygons: Polygons) -> list[str]:
    """Write a binary stereolithography file."""
    quads = np.flatnonzero(polygons.sizes != 3)
    if len(quads):
        raise WriteError(f"an .stl file holds triangles only, and these cells are quadrilaterals: {first_ids(quads)}")
    facets = _facets(polygons.points[polygons.nodes.reshape(-1, 3)])
    target.write_bytes(b"triangles".ljust(80) + len(facets).to_bytes(4, "little") + facets.tobytes())
    return ["digits beyond single precision", *polygons.array_names()]


STL = polygon_format("stl", _read, _write, _put_points)
