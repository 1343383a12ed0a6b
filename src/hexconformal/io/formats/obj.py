"""Wavefront files (.obj): vertices and faces as text."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...common import WriteError
from ..format_tools.polygons import Polygons, polygon_format
from ..format_tools.rewriting import decoded, encoded, put_words

__all__ = ["OBJ"]


# What a mesh does not hold: it stays in a file that is written as it came.
_KEPT = {"vt": "texture coordinates", "vn": "normals", "g": "groups", "usemtl": "uses of materials", "l": "lines"}


def _read(path: Path) -> Polygons:
    """Read a Wavefront file: its vertices and faces."""
    points: list[list[float]] = []
    faces: list[list[int]] = []
    others: dict[str, int] = {}
    groups = {"o": _Groups(), "g": _Groups()}
    # A backslash continues a line.
    for line in decoded(path.read_bytes()).replace("\\\r\n", " ").replace("\\\n", " ").splitlines():
        word, *rest = line.partition("#")[0].split() or [""]
        if word == "v":
            points.append([float(x) for x in rest[:3]])
        elif word == "f":
            ids = [int(corner.partition("/")[0]) for corner in rest]
            # They count from 1, or back from the last vertex so far.
            faces.append([i - 1 if i > 0 else len(points) + i if i < 0 else -1 for i in ids])
        elif word in groups:
            groups[word].begin(rest if word == "g" else [" ".join(rest)], len(faces))
        if word in _KEPT:
            others[word] = others.get(word, 0) + 1
    polygons = Polygons.from_lists(points, faces, tuple(f"{count} {_KEPT[word]}" for word, count in others.items()))
    for found in groups.values():
        found.begin([], len(faces))
        for name, runs in found.runs.items():
            polygons.groups.setdefault(name, []).extend(runs)
    return polygons


class _Groups:
    """Runs of faces by the names of the groups that they are in."""

    def __init__(self) -> None:
        self.runs: dict[str, list[range]] = {}
        self._names: set[str] = set()
        self._start = 0

    def begin(self, names: list[str], count: int) -> None:
        """After `count` faces others follow, which are in these groups."""
        for name in self._names if count > self._start else ():
            self.runs.setdefault(name, []).append(range(self._start, count))
        self._names, self._start = {name for name in names if name}, count


def _put_points(data: bytes, points: NDArray[np.float64]) -> tuple[bytes, list[str]]:
    """The file with other places of its vertices; all else stays as it is."""
    rows = iter(points.tolist())
    result, normals, moved, inside = [], 0, False, False
    for line in decoded(data).splitlines(keepends=True):
        word = "" if inside else (line.split(maxsplit=1) or [""])[0]
        inside = line.rstrip("\r\n").endswith("\\")
        normals += word == "vn"
        if word == "v":
            if inside:
                raise WriteError("vertices that go on after a backslash cannot be replaced: join their lines")
            new = next(rows)
            moved = moved or [float(x) for x in line.split()[1:4]] != new
            line = put_words(line, 1, [repr(x) for x in new])
        result.append(line)
    stale = [f"{normals} normals, which are those of the file: the surface moved"] if normals and moved else []
    return encoded("".join(result)), stale


def _write(target: Path, polygons: Polygons) -> list[str]:
    """Write a Wavefront file."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in polygons.points.tolist()]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in polygons.face_lists()]
    target.write_text("\n".join(lines) + "\n", encoding="ascii")
    return polygons.array_names()


OBJ = polygon_format("obj", _read, _write, _put_points)
