"""MFEM's meshes (MFEM mesh v1.0 and later): linear elements with attributes, and their boundary."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError

__all__ = ["mesh_text", "put_points", "read_text"]

# By MFEM's number of a geometry: the meshio name, and the number of nodes, which are in VTK's order.
_GEOMETRIES = {
    0: ("vertex", 1),
    1: ("line", 2),
    2: ("triangle", 3),
    3: ("quad", 4),
    4: ("tetra", 4),
    5: ("hexahedron", 8),
    6: ("wedge", 6),
    7: ("pyramid", 5),
}
_CODES = {name: code for code, (name, _) in _GEOMETRIES.items()}
_ADVICE = "let MFEM save the mesh conforming and linear (Mesh::SetCurvature(1)) as MFEM mesh v1.0"


def read_text(text: str) -> Any:
    """The meshio.Mesh of a file: elements first, then the boundary; ``attribute`` on both.

    Raises
    ------
    ReadError
        If it is malformed or truncated, or curved, non-conforming or otherwise of a kind that is not supported.
    """
    import meshio

    first = text.lstrip().split("\n", 1)[0].strip()
    if not re.fullmatch(r"MFEM mesh v1\.[023]", first):
        raise ReadError(f"{first!r} is not supported: {_ADVICE}")
    words = _words(text)
    rows = [*_elements(words, "elements"), *_elements(words, "boundary")]
    blocks: list[tuple[str, list[list[int]], list[int]]] = []
    for attribute, code, nodes in rows:
        name = _GEOMETRIES[code][0]
        if not blocks or blocks[-1][0] != name:
            blocks.append((name, [], []))
        blocks[-1][1].append(nodes)
        blocks[-1][2].append(attribute)
    start, end, by_component = _coordinates(text)
    values = np.array(_without_comments(text[start:end]).split(), dtype=np.float64)
    points = values.reshape(3, -1).T if by_component else values.reshape(-1, 3)
    return meshio.Mesh(
        points.copy(),
        [(name, np.array(nodes, dtype=np.int64)) for name, nodes, _ in blocks],
        cell_data={"attribute": [np.array(attributes, dtype=np.int64) for _, _, attributes in blocks]},
    )


def put_points(text: str, points: NDArray[np.float64]) -> str:
    """The text with other places of its vertices; all else stays as it is."""
    start, end, by_component = _coordinates(text)
    rows = points.T.ravel()[:, None] if by_component else points
    body = "\n".join(" ".join(repr(x) for x in row) for row in rows.tolist())
    return f"{text[:start].rstrip()}\n{body}\n{text[end:]}"


def mesh_text(points: NDArray[np.float64], blocks: list[tuple[str, NDArray[np.int64], NDArray[np.int64]]]) -> str:
    """A new file: points, and blocks of cells (type, nodes, attributes)."""
    lines = ["MFEM mesh v1.0", "", "dimension", "3"]
    solids = ("tetra", "hexahedron", "wedge", "pyramid")
    for title, wanted in (("elements", True), ("boundary", False)):
        rows = [
            f"{attribute} {_CODES[name]} {' '.join(map(str, row))}"
            for name, nodes, attributes in blocks
            if (name in solids) == wanted
            for attribute, row in zip(attributes.tolist(), nodes.tolist(), strict=True)
        ]
        lines += ["", title, str(len(rows)), *rows]
    lines += ["", "vertices", str(len(points)), "3", *(" ".join(map(repr, row)) for row in points.tolist())]
    return "\n".join(lines) + "\n"


def _without_comments(text: str) -> str:
    return re.sub(r"#.*", "", text)


def _words(text: str) -> list[str]:
    return _without_comments(text).split()


def _elements(words: list[str], title: str) -> list[tuple[int, int, list[int]]]:
    """Attribute, geometry and nodes of the elements of a section."""
    if title not in words:
        raise ReadError(f"it has no section {title!r}")
    place, rows = words.index(title) + 2, []
    try:
        for _ in range(int(words[place - 1])):
            attribute, code = int(words[place]), int(words[place + 1])
            if code not in _GEOMETRIES:
                raise ReadError(f"elements of geometry {code} are not supported")
            width = _GEOMETRIES[code][1]
            nodes = [int(word) for word in words[place + 2 : place + 2 + width]]
            if len(nodes) < width:
                raise IndexError
            rows.append((attribute, code, nodes))
            place += 2 + width
    except IndexError:
        raise ReadError(f"it is truncated in section {title!r}") from None
    return rows


def _coordinates(text: str) -> tuple[int, int, bool]:
    """Where the coordinates start and end, and whether all x come first, then all y."""
    match = re.search(r"(?m)^vertices\s+(\d+)\s+", text)
    if match is None:
        raise ReadError("it has no section 'vertices'")
    count = int(match[1])
    nodes = re.search(
        r"(?m)^nodes\s+FiniteElementSpace\s+FiniteElementCollection:\s*(\S+)\s+VDim:\s*(\d+)\s+Ordering:\s*([01])\s",
        text,
    )
    if nodes is not None:
        if not re.fullmatch(r"(H1_3D_P1|Linear)", nodes[1]) or nodes[2] != "3":
            raise ReadError(f"nodes of {nodes[1]} with VDim {nodes[2]} are not supported: {_ADVICE}")
        return *_span_of_numbers(text, nodes.end(), 3 * count), nodes[3] == "0"
    dimension = re.compile(r"(\d+)\s").match(text, match.end())
    if dimension is None or dimension[1] != "3":
        raise ReadError("its vertices must have three coordinates")
    return *_span_of_numbers(text, dimension.end(), 3 * count), False


def _span_of_numbers(text: str, start: int, count: int) -> tuple[int, int]:
    place, found = start, 0
    word = re.compile(r"\s*(?:#[^\n]*\n\s*)*([-+.\deEinfaINFA]+)(?=\s|$)")
    while found < count:
        match = word.match(text, place)
        if match is None:
            raise ReadError(f"it is truncated: {count} coordinates are announced, {found} are there")
        place, found = match.end(), found + 1
    return start, place
