"""A deck as it came, with other coordinates in its GRID cards, in the kind of fields that they had."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...source_file import SourceFile
from .cards import Card, Line, bulk_cards
from .read import Nodes
from .reals import format_real, parse_real

__all__ = ["put_points"]

_FIRST = 2  # place of the first coordinate among the fields of a GRID card
_LINE = 72  # columns of a line in free fields
_EXACT = 1e-14  # of the size of the mesh: rounding that is not worth a word


def put_points(file: SourceFile, mesh: Any) -> tuple[bytes, list[str]]:
    """The deck with the coordinates of the nodes that moved replaced; all else stays as it is."""
    lines = file.text.splitlines(keepends=True)
    nodes = Nodes(list(bulk_cards(file.text)))
    moved = np.flatnonzero((nodes.points(nodes.local) != mesh.points).any(axis=1))
    wanted, written = nodes.coordinates(mesh.points), nodes.local.copy()
    for node in moved.tolist():
        written[node] = _replace(lines, nodes.cards[node], wanted[node].tolist())
    rounding = np.abs(nodes.points(written) - mesh.points)[moved].max(initial=0.0)
    lost = []
    if rounding > _EXACT * float(np.ptp(mesh.points, axis=0).max()):
        lost = [f"digits of coordinates beyond the fields of the deck (rounded by up to {rounding:.1e})"]
    return "".join(lines).encode("utf-8", "surrogateescape"), lost


def _replace(lines: list[str], card: Card, values: list[float]) -> list[float]:
    """Put three coordinates into the lines of a card, and return them as they are written."""
    places = [(number, line, slot) for number, line in card.lines for slot in range(len(line.fields))]
    written = []
    for value, (number, line, slot) in zip(values, places[_FIRST : _FIRST + 3], strict=False):
        text = format_real(value, _room(lines[number], line))
        lines[number] = _with_field(lines[number], line, slot, text)
        written.append(parse_real(text))
    if len(written) < 3:
        # In large fields the third has a line of its own, which may be missing where it was zero.
        number, line = card.lines[-1]
        text = format_real(values[2], 16)
        body, end = _without_end(lines[number])
        lines[number] = body + (end or "\n") + (f"*,{text}" if line.free else f"*       {text:>16}") + end
        written.append(parse_real(text))
    return written


def _room(text: str, line: Line) -> int:
    """Characters that there are for each coordinate in a line."""
    if not line.free:
        return line.width
    fields = text.partition("$")[0].rstrip().split(",")
    coordinates = [field.strip() for field in fields[1:][_FIRST : _FIRST + 3]] if "*" not in line.head else fields[3:5]
    others = sum(len(field) + 1 for field in fields) - sum(map(len, coordinates))
    return max(8, min(16, (_LINE - others) // 3), *map(len, coordinates))


def _with_field(text: str, line: Line, slot: int, value: str) -> str:
    """A line with another value in one of its fields."""
    whole, end = _without_end(text)
    body, mark, comment = whole.partition("$")
    if line.free:
        fields = body.split(",")
        fields += [""] * (slot + 2 - len(fields))
        fields[slot + 1] = value
        return ",".join(fields) + mark + comment + end
    body = body.expandtabs(8)
    start = 8 + line.width * slot
    old = body[start : start + line.width]
    field = value.rjust(line.width) if old.startswith(" ") and old.strip() else value.ljust(line.width)
    return body[:start].ljust(start) + field + body[start + line.width :] + mark + comment + end


def _without_end(text: str) -> tuple[str, str]:
    body = text.rstrip("\r\n")
    return body, text[len(body) :]
