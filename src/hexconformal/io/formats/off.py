"""Object File Format (.off): points and faces as text."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...common import ReadError
from ..format_tools.polygons import Polygons, polygon_format
from ..format_tools.rewriting import decoded, encoded, put_words

__all__ = ["OFF"]


def _read(path: Path) -> Polygons:
    """Read an Object File Format file."""
    text = path.read_text(encoding="utf-8", errors="replace")
    rows = [words for line in text.splitlines() if (words := line.partition("#")[0].split())]
    head = rows.pop(0) if rows else [""]
    if not head[0].endswith("OFF"):
        raise ReadError("it does not begin with OFF")
    if head[0].lstrip("STCN") != "OFF" or "BINARY" in head:
        raise ReadError(f"{' '.join(head)} is not supported: only text with three coordinates of a point")
    counts = head[1:] or (rows.pop(0) if rows else [])
    if len(counts) < 2:
        raise ReadError("the numbers of points and faces are missing")
    n, m = int(counts[0]), int(counts[1])
    if len(rows) < n + m:
        raise ReadError(f"{n} points and {m} faces are announced, {len(rows)} lines are there")
    if any(len(row) <= int(row[0]) for row in rows[n : n + m]):
        # Faces that go over several lines have no colours.
        words, at = [word for row in rows[n:] for word in row], 0
        rows = rows[:n]
        for _ in range(m):
            rows.append(words[at : at + 1 + int(words[at])] if at < len(words) else ["1"])
            at += len(rows[-1])
    faces = [[int(word) for word in row[1 : 1 + int(row[0])]] for row in rows[n : n + m]]
    if any(len(face) < int(row[0]) for face, row in zip(faces, rows[n:], strict=False)):
        raise ReadError("a face is shorter than it says")
    coloured = (
        sum(len(row) > 3 for row in rows[:n]),
        sum(len(row) > len(f) + 1 for row, f in zip(rows[n:], faces, strict=False)),
    )
    numbers = zip(coloured, ("points", "faces"), strict=True)
    model = tuple(f"colours or normals of {count} {what}" for count, what in numbers if count)
    return Polygons.from_lists([[float(word) for word in row[:3]] for row in rows[:n]], faces, model)


def _put_points(data: bytes, points: NDArray[np.float64]) -> tuple[bytes, list[str]]:
    """The file with other places of its points; comments, colours and faces stay as they are."""
    lines = decoded(data).splitlines(keepends=True)
    filled = [number for number, line in enumerate(lines) if line.partition("#")[0].strip()]
    head = lines[filled[0]].partition("#")[0].split()
    first = 1 if len(head) > 1 else 2
    old = [lines[number].split()[:3] for number in filled[first : first + len(points)]]
    moved = not np.array_equal(np.array(old, dtype=np.float64), points)
    for number, row in zip(filled[first:], points.tolist(), strict=False):
        lines[number] = put_words(lines[number], 0, [repr(x) for x in row])
    stale = [f"{len(points)} normals, which are those of the file: the surface moved"]
    return encoded("".join(lines)), stale if "N" in head[0][:-3] and moved else []


def _write(target: Path, polygons: Polygons) -> list[str]:
    """Write an Object File Format file."""
    lines = ["OFF", f"{len(polygons.points)} {len(polygons.sizes)} 0"]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in polygons.points.tolist()]
    lines += [" ".join(str(i) for i in [len(face), *face]) for face in polygons.face_lists()]
    target.write_text("\n".join(lines) + "\n", encoding="ascii")
    return polygons.array_names()


OFF = polygon_format("off", _read, _write, _put_points)
