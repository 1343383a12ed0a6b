"""Wavefront files (.obj): vertices and faces as text."""

from __future__ import annotations

from pathlib import Path

from ..format_tools.polygons import Polygons, polygon_format

__all__ = ["OBJ"]


def _read(path: Path) -> Polygons:
    """Read a Wavefront file: its vertices and faces."""
    points: list[list[float]] = []
    faces: list[list[int]] = []
    ignored: dict[str, None] = {}
    names = {"vt": "texture coordinates", "vn": "normals", "g": "groups", "usemtl": "materials", "l": "lines"}
    # A backslash continues a line.
    for line in path.read_text(encoding="utf-8", errors="replace").replace("\\\n", " ").splitlines():
        word, *rest = line.partition("#")[0].split() or [""]
        if word == "v":
            points.append([float(x) for x in rest[:3]])
        elif word == "f":
            ids = [int(corner.partition("/")[0]) for corner in rest]
            # They count from 1, or back from the last vertex so far.
            faces.append([i - 1 if i > 0 else len(points) + i if i < 0 else -1 for i in ids])
        elif word in names:
            ignored[names[word]] = None
    return Polygons.from_lists(
        points, faces, (f"{', '.join(ignored)} of the .obj file are left out",) if ignored else ()
    )


def _write(target: Path, polygons: Polygons) -> list[str]:
    """Write a Wavefront file."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in polygons.points.tolist()]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in polygons.face_lists()]
    target.write_text("\n".join(lines) + "\n", encoding="ascii")
    return polygons.array_names()


OBJ = polygon_format("obj", _read, _write)
