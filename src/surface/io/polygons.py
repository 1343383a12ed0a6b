"""Points and polygons, as .obj, .off and .stl files hold them, in their order."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hexconformal.common import MeshError, ReadError, WriteError, first_ids

from ..mesh import Floats, Ints

__all__ = ["Polygons", "read_obj", "read_off", "read_stl", "write_obj", "write_off", "write_stl"]

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@dataclass
class Polygons:
    """Points (n, 3); polygons as ``sizes`` (m,) and all their ``nodes`` in a row; arrays on both; remarks."""

    points: Floats
    sizes: Ints
    nodes: Ints
    point_data: dict[str, Any] = field(default_factory=dict)
    cell_data: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def starts(self) -> Ints:
        """(m,) where the nodes of each polygon start."""
        return np.cumsum(self.sizes) - self.sizes

    def grid(self) -> Any:
        """An unstructured grid of pyvista.

        Raises
        ------
        MeshError
            If a polygon has fewer than three corners or more than four, or one that is no point.
        """
        import pyvista as pv

        odd = np.flatnonzero((self.sizes < 3) | (self.sizes > 4))
        if len(odd):
            raise MeshError(
                f"faces that are neither triangles nor quadrilaterals: {first_ids(odd)}; split them into triangles"
            )
        if len(self.sizes) == 0:
            raise MeshError("there are no triangles or quadrilaterals")
        lost = (self.nodes < 0) | (self.nodes >= len(self.points))
        if lost.any():
            cells = np.unique(np.repeat(np.arange(len(self.sizes)), self.sizes)[lost])
            raise MeshError(f"cells with node ids outside 0..{len(self.points) - 1}: {first_ids(cells)}")
        types = np.where(self.sizes == 3, 5, 9).astype(np.uint8)
        grid = pv.UnstructuredGrid(np.insert(self.nodes, self.starts, self.sizes), types, self.points)
        for name, values in self.point_data.items():
            grid.point_data.set_array(values, name)
        for name, values in self.cell_data.items():
            grid.cell_data.set_array(values, name)
        return grid

    def lists(self) -> list[list[int]]:
        """The nodes of each polygon."""
        nodes = iter(self.nodes.tolist())
        return [list(itertools.islice(nodes, size)) for size in self.sizes.tolist()]

    def arrays(self) -> list[str]:
        """The names of its arrays, in words."""
        return [f"point array {name!r}" for name in self.point_data] + [
            f"cell array {name!r}" for name in self.cell_data
        ]


def _joined(points: list[Any], faces: list[list[int]], notes: tuple[str, ...] = ()) -> Polygons:
    sizes = np.array([len(face) for face in faces], dtype=np.int64)
    nodes = np.fromiter(itertools.chain.from_iterable(faces), np.int64, int(sizes.sum()))
    return Polygons(np.array(points, dtype=np.float64).reshape(-1, 3), sizes, nodes, notes=notes)


def read_obj(path: Path) -> Polygons:
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
    return _joined(points, faces, (f"{', '.join(ignored)} of the .obj file are left out",) if ignored else ())


def write_obj(target: Path, surface: Polygons) -> list[str]:
    """Write a Wavefront file."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in surface.points.tolist()]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in surface.lists()]
    target.write_text("\n".join(lines) + "\n", encoding="ascii")
    return surface.arrays()


def read_off(path: Path) -> Polygons:
    """Read an Object File Format file; colours are left out."""
    text = path.read_text(encoding="utf-8", errors="replace")
    rows = [words for line in text.splitlines() if (words := line.partition("#")[0].split())]
    head = rows.pop(0) if rows else [""]
    if not head[0].endswith("OFF"):
        raise ReadError("it does not begin with OFF")
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
    return _joined([[float(word) for word in row[:3]] for row in rows[:n]], faces)


def write_off(target: Path, surface: Polygons) -> list[str]:
    """Write an Object File Format file."""
    lines = ["OFF", f"{len(surface.points)} {len(surface.sizes)} 0"]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in surface.points.tolist()]
    lines += [" ".join(str(i) for i in [len(face), *face]) for face in surface.lists()]
    target.write_text("\n".join(lines) + "\n", encoding="ascii")
    return surface.arrays()


def read_stl(path: Path) -> Polygons:
    """Read a stereolithography file; its triangles repeat their points, which are joined where they are equal."""
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    if len(data) == 84 + count * _FACET.itemsize:
        with np.errstate(invalid="ignore"):  # a NaN is found later
            corners = np.frombuffer(data, _FACET, count, 84)["corners"].reshape(-1, 3).astype(np.float64)
    elif data.lstrip()[:5].lower() == b"solid" and b"facet" in data:
        rows = [words for line in data.decode("ascii", "replace").splitlines() if (words := line.split())]
        if rows[-1][0].lower() != "endsolid":
            raise ReadError("its end is missing")
        corners = np.array([row[1:4] for row in rows if row[0].lower() == "vertex"], dtype=np.float64)
    else:
        raise ReadError(f"it is {len(data)} bytes long, {84 + count * _FACET.itemsize} are announced")
    if len(corners) % 3:
        raise ReadError("a facet is incomplete")
    points, first, inverse = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    count = len(corners) // 3
    return Polygons(points[order], np.full(count, 3), place[inverse.ravel()])


def write_stl(target: Path, surface: Polygons) -> list[str]:
    """Write a binary stereolithography file."""
    quads = np.flatnonzero(surface.sizes != 3)
    if len(quads):
        raise WriteError(f"an .stl file holds triangles only, and these cells are quadrilaterals: {first_ids(quads)}")
    facets = np.zeros(len(surface.sizes), dtype=_FACET)
    corners = surface.points[surface.nodes.reshape(-1, 3)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    facets["corners"], facets["normal"] = corners, normals / np.where(lengths > 0, lengths, 1.0)
    target.write_bytes(b"triangles".ljust(80) + len(facets).to_bytes(4, "little") + facets.tobytes())
    return ["digits beyond single precision", *surface.arrays()]
