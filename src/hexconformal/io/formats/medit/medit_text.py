"""Medit's meshes as text: keywords, each with a count and numbers; those that are not known are passed over."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError

__all__ = ["MeditContents", "put_points", "read_text"]

_CELLS = {
    "Edges": ("line", 2),
    "Triangles": ("triangle", 3),
    "Quadrilaterals": ("quad", 4),
    "Tetrahedra": ("tetra", 4),
    "Prisms": ("wedge", 6),
    "Pentahedra": ("wedge", 6),
    "Pyramids": ("pyramid", 5),
    "Hexahedra": ("hexahedron", 8),
    "Hexaedra": ("hexahedron", 8),
}
# What must stay where it is: by keyword, what its numbers count.
_REQUIRED = {
    "Corners": "Vertices",
    "RequiredVertices": "Vertices",
    "RequiredEdges": "Edges",
    "RequiredTriangles": "Triangles",
    "RequiredQuadrilaterals": "Quadrilaterals",
}


@dataclass
class MeditContents:
    """A meshio.Mesh, which of its points must stay, and what says so, in words."""

    mesh: Any
    held: NDArray[np.bool_]
    notes: tuple[str, ...]


def read_text(text: str) -> MeditContents:
    """The mesh of a file.

    Raises
    ------
    ReadError
        If it is malformed or truncated.
    """
    import meshio

    version, dimension, numbers = _sections(text)
    if "Vertices" not in numbers:
        raise ReadError("it has no Vertices")
    kind = np.float32 if version < 2 else np.float64
    table = _table(numbers, "Vertices", dimension + 1)
    cells, refs, blocks = [], [], {}
    for keyword, (_, width) in _CELLS.items():
        if keyword in numbers:
            rows = _table(numbers, keyword, width + 1).astype(np.int64)
            blocks[keyword] = rows[:, :width] - 1
    order = [keyword for keyword in numbers if keyword in blocks]
    for keyword in order:
        name, width = _CELLS[keyword]
        cells.append((name, blocks[keyword]))
        refs.append(_table(numbers, keyword, width + 1)[:, width].astype(np.int64))
    held, notes = np.zeros(len(table), dtype=bool), []
    for keyword, of in _REQUIRED.items():
        if keyword in numbers:
            ids = _table(numbers, keyword, 1)[:, 0].astype(np.int64) - 1
            owners = np.arange(len(table))[:, None] if of == "Vertices" else blocks.get(of, np.empty((0, 1), np.int64))
            if len(ids) and (ids.min() < 0 or ids.max() >= len(owners)):
                raise ReadError(f"{keyword} must be numbers of {of}")
            nodes = owners[ids].ravel()
            held[nodes[(nodes >= 0) & (nodes < len(held))]] = True
            notes.append(f"{len(ids)} {keyword}: their nodes are held")
    if "Ridges" in numbers:
        notes.append(
            f"{len(_table(numbers, 'Ridges', 1))} Ridges stay in the file: sharp edges are found by their angle"
        )
    mesh = meshio.Mesh(
        table[:, :dimension].astype(kind),
        cells,
        point_data={"medit:ref": table[:, dimension].astype(np.int64)},
        cell_data={"medit:ref": refs},
    )
    return MeditContents(mesh, held, tuple(notes))


def put_points(text: str, points: NDArray[np.float64]) -> str:
    """The text with other places of its vertices; all else stays as it is."""
    _, dimension, numbers = _sections(text)
    refs = _table(numbers, "Vertices", dimension + 1)[:, dimension].astype(np.int64).tolist()
    start, end = next(span for name, span in _spans(text) if name == "Vertices")
    if np.array_equal(_table(numbers, "Vertices", dimension + 1)[:, :dimension], points[:, :dimension]):
        return text
    rows = zip(points[:, :dimension].tolist(), refs, strict=True)
    lines = [" ".join([*(repr(x) for x in row), str(ref)]) for row, ref in rows]
    text = re.sub(r"(MeshVersionFormatted\s+)[01]\b", r"\g<1>2", text[:start]) + text[start:]
    return text[:start] + "\n".join(["", str(len(lines)), *lines, ""]) + text[end:].lstrip("\n")


def _sections(text: str) -> tuple[int, int, dict[str, NDArray[np.float64]]]:
    """Version, dimension, and the numbers of every keyword."""
    numbers: dict[str, NDArray[np.float64]] = {}
    for keyword, (start, end) in _spans(text):
        body = re.sub(r"#.*", "", text[start:end])
        words = np.array(body.split(), dtype=np.float64)
        if keyword in numbers and len(numbers[keyword]) * len(words):
            # Sections of one keyword go on with what was there: their counts add up.
            before = numbers[keyword]
            words = np.concatenate([before[:1] + words[:1], before[1:], words[1:]])
        numbers[keyword] = words
    try:
        return int(numbers["MeshVersionFormatted"][0]), int(numbers["Dimension"][0]), numbers
    except (KeyError, IndexError):
        raise ReadError("it does not tell MeshVersionFormatted and Dimension") from None


def _spans(text: str) -> list[tuple[str, tuple[int, int]]]:
    """Every keyword, and where its numbers start and end."""
    bare = re.sub(r"#.*", lambda comment: " " * len(comment[0]), text)
    # The exponent of a number, or the letters of nan, are no keyword.
    found = [match for match in re.finditer(r"(?m)(?:^|(?<=\s))[A-Za-z]\w*", bare) if match[0].lower() not in _NUMBERS]
    ends = [match.start() for match in found[1:]] + [len(text)]
    return [(match[0], (match.end(), end)) for match, end in zip(found, ends, strict=True)]


_NUMBERS = ("nan", "inf", "infinity")


def _table(numbers: dict[str, NDArray[np.float64]], keyword: str, width: int) -> NDArray[np.float64]:
    values = numbers[keyword]
    if not len(values) or not 0 <= values[0] <= len(values) or len(values) < 1 + int(values[0]) * width:
        raise ReadError(f"{keyword} is truncated, or does not begin with a count")
    count = int(values[0])
    return values[1 : 1 + count * width].reshape(count, width)
