"""Stereolithography files (.stl), text and binary; written in binary."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...common import ReadError, WriteError, first_ids
from ..format_tools.polygons import Polygons, polygon_format

__all__ = ["STL"]

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def _read(path: Path) -> Polygons:
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
    order = np.argsort(first)  # that in which they first appear
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    return Polygons(points[order], np.full(len(corners) // 3, 3), place[inverse.ravel()])


def _write(target: Path, polygons: Polygons) -> list[str]:
    """Write a binary stereolithography file."""
    quads = np.flatnonzero(polygons.sizes != 3)
    if len(quads):
        raise WriteError(f"an .stl file holds triangles only, and these cells are quadrilaterals: {first_ids(quads)}")
    facets = np.zeros(len(polygons.sizes), dtype=_FACET)
    corners = polygons.points[polygons.nodes.reshape(-1, 3)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    facets["corners"], facets["normal"] = corners, normals / np.where(lengths > 0, lengths, 1.0)
    target.write_bytes(b"triangles".ljust(80) + len(facets).to_bytes(4, "little") + facets.tobytes())
    return ["digits beyond single precision", *polygons.array_names()]


STL = polygon_format("stl", _read, _write)
