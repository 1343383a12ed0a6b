"""Abaqus and CalculiX decks (.inp): their mesh is read, and new coordinates are put into the text around it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import ReadError, first_ids
from ..cell_types import NODE_COUNTS
from ..format_tools.capabilities import Capabilities, supported_part
from ..format_tools.format import Format
from ..format_tools.meshio_files import checked_contents, parsing, refuse_namesake, write_with_meshio
from ..source_file import FileContents, SourceFile

__all__ = ["ABAQUS"]

_CAPABILITIES = Capabilities(
    cell_types="line line3 triangle triangle6 quad quad8 quad9 tetra tetra10 wedge hexahedron hexahedron20",
    point_sets=True,
    cell_sets=True,
)
_AVS_UCD = rb"(#.*\s+)*\d+([ \t]+\d+){4}\s*\n", "this is an AVS UCD file: give it the extension .avs"

# meshio writes the last name it knows for a type: a hybrid brick, an axisymmetric pore pressure quadrilateral.
_PLAIN_TYPES = {"C3D8RH": "C3D8", "CAX4P": "S4", "R3D3": "S3", "B33H": "B31", "C3D10MH": "C3D10", "C3D20RH": "C3D20"}
# Type of cell by the beginning of an element's name; what follows (R, H, I, T, ...) is about its formulation.
_TYPES = {
    r"([AD]?C|F)3D8": "hexahedron",
    r"[AD]?C3D20": "hexahedron20",
    r"[AD]?C3D27": "hexahedron27",
    r"([AD]?C|F)3D4": "tetra",
    r"[AD]?C3D10": "tetra10",
    r"([AD]?C|F)3D6": "wedge",
    r"[AD]?C3D15": "wedge15",
    r"[AD]?C3D5": "pyramid",
    r"(S|CPS|CPE|CAX|M3D|R3D|SFM3D|DS)4": "quad",
    r"(S|CPS|CPE|CAX|M3D|SFM3D|DS)8": "quad8",
    r"(S|STRI|CPS|CPE|CAX|M3D|R3D|SFM3D|DS)3": "triangle",
    r"(STRI65|(CPS|CPE|CAX|M3D|SFM3D)6)": "triangle6",
    r"T[23]D2|B21|B31|B33": "line",
}


def _read(path: Path) -> FileContents:
    with parsing("abaqus") as output:
        refuse_namesake(path, *_AVS_UCD)
        text = path.read_text(encoding="utf-8", errors="surrogateescape")
        mesh, notes = _parsed(text)
    contents = checked_contents(mesh, SourceFile(path, "abaqus", text=text), output)
    return replace(contents, notes=tuple(notes))


def _write(target: Path, mesh: Any) -> list[str]:
    out, lost = supported_part(mesh, "abaqus", _CAPABILITIES)
    write_with_meshio(target, out, "abaqus")
    text = target.read_text()
    target.write_text(re.sub(r"(?<=TYPE=)\w+", lambda match: _PLAIN_TYPES.get(match[0], match[0]), text))
    return lost


def _parsed(text: str) -> tuple[Any, list[str]]:
    """The nodes, elements and sets of a deck.

    Returns
    -------
    mesh
        meshio.Mesh with point_sets and cell_sets.
    notes
        What is set aside, in words.

    Raises
    ------
    ReadError
        If the deck is malformed, is spread over several files, or numbers nodes or elements twice (several parts).
    """
    import meshio

    ids: list[NDArray[np.int64]] = []
    points: list[NDArray[np.float64]] = []
    blocks: list[tuple[str, NDArray[np.int64], NDArray[np.int64]]] = []
    sets: dict[str, dict[str, list[Any]]] = {"NSET": {}, "ELSET": {}}
    notes = []
    for keyword, options, lines in _sections(text):
        if keyword == "INCLUDE":
            raise ReadError("the deck includes other files: put them into one")
        if keyword == "NODE" and lines:
            # Coordinates that are left out are zero; further numbers are directions.
            rows = [[field.strip() or "0" for field in f"{line},,,".split(",")[:4]] for line in lines]
            table = np.array(rows, dtype=np.float64)
            ids.append(table[:, 0].astype(np.int64))
            points.append(table[:, 1:])
            _extend(sets["NSET"], options.get("NSET"), ids[-1])
        elif keyword == "ELEMENT" and lines:
            name = _cell_type(options.get("TYPE", ""))
            if name is None:
                notes.append(f"elements of type {options.get('TYPE')} are set aside; they stay in the deck")
                _extend(sets["ELSET"], options.get("ELSET"), _numbers([]))
                continue
            numbers = _numbers(lines)
            width = 1 + NODE_COUNTS[name]
            if len(numbers) % width:
                raise ReadError(
                    f"elements of type {options['TYPE']} have {width - 1} nodes each: one has too few or too many, "
                    "or the file is truncated"
                )
            numbers = numbers.reshape(-1, width)
            if name == "wedge15":
                # meshio cannot hold them.
                name, numbers = "wedge", numbers[:, :7]
                notes.append(f"elements of type {options['TYPE']} are taken by their corners; they stay in the deck")
            blocks.append((name, numbers[:, 0], numbers[:, 1:]))
            _extend(sets["ELSET"], options.get("ELSET"), numbers[:, 0])
        elif keyword in sets and keyword in options:
            _extend(sets[keyword], options[keyword], _members(lines, "GENERATE" in options))
    if not points or not blocks:
        raise ReadError("the deck holds no nodes, or no elements of a known type")
    node_index = _IdIndex(np.concatenate(ids), "nodes")
    cell_index = _IdIndex(np.concatenate([numbers for _, numbers, _ in blocks]), "elements")
    ends = np.cumsum([len(numbers) for _, numbers, _ in blocks])
    cell_sets = {}
    for name in sets["ELSET"]:
        cells = cell_index.of_present(_resolved(sets["ELSET"], name))
        cell_sets[name] = np.split(cells, np.searchsorted(cells, ends[:-1]))
        cell_sets[name] = [part - (end - len(b[1])) for part, end, b in zip(cell_sets[name], ends, blocks, strict=True)]
    mesh = meshio.Mesh(
        np.concatenate(points),
        [(name, node_index.of_all(nodes)) for name, _, nodes in blocks],
        point_sets={name: node_index.of_present(_resolved(sets["NSET"], name)) for name in sets["NSET"]},
        cell_sets=cell_sets,
    )
    return mesh, notes


def _put_points(file: SourceFile, mesh: Any) -> tuple[bytes, list[str]]:
    """The deck with the coordinates of its nodes, in their order, replaced; all else stays as it is."""
    rows = iter(mesh.points.tolist())
    result = []
    inside = unfinished = False
    for line in file.text.splitlines(keepends=True):
        if line.lstrip().startswith("*"):
            inside = inside if line.lstrip().startswith("**") else _keyword(line)[0] == "NODE"
            unfinished = line.rstrip().endswith(",")
        elif unfinished:
            unfinished = line.rstrip().endswith(",")
        elif inside and line.strip():
            x, y, z = next(rows)
            fields = line.rstrip().rstrip(",").split(",")
            line = ",".join([fields[0], f" {x!r}", f" {y!r}", f" {z!r}", *fields[4:]]) + "\n"
        result.append(line)
    # Bytes that are not UTF-8 come out as they came in.
    return "".join(result).encode("utf-8", "surrogateescape"), []


def _sections(text: str) -> Iterator[tuple[str, dict[str, str], list[str]]]:
    """Keyword, its options, and the data lines that follow it."""
    stripped = (line.strip() for line in text.splitlines())
    lines = [line for line in stripped if line and not line.startswith("**")]
    starts = [number for number, line in enumerate(lines) if line.startswith("*")]
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        head, first = lines[start], start + 1
        while head.endswith(",") and first < end:
            head, first = head + lines[first], first + 1
        yield *_keyword(head), lines[first:end]


def _keyword(line: str) -> tuple[str, dict[str, str]]:
    keyword, *options = [part.strip() for part in line.lstrip()[1:].split(",")]
    pairs = [option.partition("=") for option in options if option]
    return keyword.upper(), {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}


def _cell_type(name: str) -> str | None:
    # A further digit would make it another element.
    matches = [kind for pattern, kind in _TYPES.items() if re.match(f"(?:{pattern})(?!\\d)", name.upper())]
    return matches[0] if matches else None


def _numbers(lines: list[str]) -> NDArray[np.int64]:
    return np.array([part for line in lines for part in line.replace(",", " ").split()], dtype=np.int64)


def _members(lines: list[str], generate: bool) -> list[Any]:
    """Ids, and names of other sets, that the lines of a set list."""
    if generate:
        ranges = [[int(part) for part in line.replace(",", " ").split()] for line in lines]
        return [np.arange(r[0], r[1] + 1, r[2] if len(r) > 2 else 1) for r in ranges]
    parts = [part.strip().strip('"') for line in lines for part in line.split(",") if part.strip()]
    numbers = [int(part) for part in parts if part.isdigit()]
    return [np.array(numbers, dtype=np.int64), *(part for part in parts if not part.isdigit())]


def _extend(sets: dict[str, list[Any]], name: str | None, members: Any) -> None:
    # A set that is named again grows; names do not differ in case alone.
    if name:
        known = {key.upper(): key for key in sets}
        sets.setdefault(known.get(name.upper(), name), []).extend(members if isinstance(members, list) else [members])


def _resolved(sets: dict[str, list[Any]], name: str, depth: int = 0) -> NDArray[np.int64]:
    known = {key.upper(): key for key in sets}
    parts = [np.empty(0, dtype=np.int64)]
    for member in sets[name]:
        if isinstance(member, str):
            if member.upper() not in known or depth > 50:
                raise ReadError(f"the set {name!r} refers to {member!r}, which is not a set")
            member = _resolved(sets, known[member.upper()], depth + 1)
        parts.append(member)
    return np.unique(np.concatenate(parts))


class _IdIndex:
    """The indices, in the order of the file, of nodes or elements by their ids."""

    def __init__(self, ids: NDArray[np.int64], what: str) -> None:
        self.order = np.argsort(ids, kind="stable")
        self.ids, self.what = ids[self.order], what
        twice = self.ids[1:][self.ids[1:] == self.ids[:-1]]
        if len(twice):
            raise ReadError(f"{what} numbered twice: {first_ids(twice)}; a deck of several parts must be made flat")

    def of_all(self, ids: NDArray[np.int64]) -> NDArray[np.int64]:
        """Indices of ids that all must be there."""
        places = np.minimum(np.searchsorted(self.ids, ids), len(self.ids) - 1)
        missing = np.unique(ids[self.ids[places] != ids])
        if len(missing):
            raise ReadError(f"{self.what} that are referred to, but not there: {first_ids(missing)}")
        return np.asarray(self.order[places])

    def of_present(self, ids: NDArray[np.int64]) -> NDArray[np.int64]:
        """Indices, sorted, of those of the ids that are there."""
        return np.sort(self.order[np.isin(self.ids, ids)])


ABAQUS = Format("abaqus", (".inp",), _read, _write, _CAPABILITIES, put_points=_put_points)
