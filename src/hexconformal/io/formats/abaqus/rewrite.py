"""New coordinates in the text of a deck; all else stays as it is."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .deck import Deck, NodeBlock, Scope
from .members import Member, members_of
from .statements import Section, format_real, keyword_line, line_ending

__all__ = ["rewritten"]

Field = NDArray[np.float64]


def rewritten(deck: Deck, lines: list[str], points: Field) -> tuple[str, list[str]]:
    """The text of a deck with other points, and what could not be kept, in words.

    Parameters
    ----------
    deck
        The deck as it was read.
    lines
        Its lines.
    points
        (n, 3) points in the order of the mesh.
    """
    edits, rounding, notes = _Edits(), _Rounding(), []
    members = members_of(deck)
    ends = np.cumsum([len(member.labels) for member in members])
    of_parts: dict[int, list[tuple[Member, _Edits]]] = {}
    for member, mine in zip(members, np.split(points, ends[:-1]), strict=True):
        editor = _Editor(member, mine, lines, rounding)
        for scope in member.scopes:
            if member.instance is not None and scope is member.instance.part:
                of_parts.setdefault(id(scope), []).append((member, editor.edits(scope)))
            else:
                edits.add(editor.edits(scope))
        if editor.written_out:
            notes.append(f"*NGEN ({editor.written_out} nodes that it makes are written out)")
    for instances in of_parts.values():
        if all(edited == instances[0][1] for _, edited in instances):
            edits.add(instances[0][1])
        else:
            notes.append(_split(deck, lines, edits, instances))
    if rounding.count:
        notes.append(f"the last digits of the coordinates of {rounding.count} nodes (up to {rounding.largest:.1g})")
    return edits.applied(lines, 0, len(lines)), notes


@dataclass
class _Rounding:
    """How many nodes are not exactly where they should be, and how far away the farthest is."""

    count: int = 0
    largest: float = 0.0

    def add(self, wanted: Field, written: Field) -> None:
        """Compare points (n, 3)."""
        with np.errstate(invalid="ignore"):
            away = np.abs(wanted - written).max(axis=1, initial=0.0)
        self.count += int((away > 0).sum())
        self.largest = max(self.largest, float(away.max(initial=0.0)))


@dataclass
class _Edits:
    """New text for lines, and text that comes after lines, by their numbers."""

    lines: dict[int, str] = field(default_factory=dict)
    after: dict[int, str] = field(default_factory=dict)

    def add(self, other: _Edits) -> None:
        """Take in what is done elsewhere."""
        self.lines |= other.lines
        self.after |= other.after

    def applied(self, lines: list[str], head: int, end: int) -> str:
        """The text of lines from `head` to before `end`."""
        return "".join(self.lines.get(n, lines[n]) + self.after.get(n, "") for n in range(head, end))


class _Editor:
    """Puts the points (n, 3) of a member into the lines that its nodes are on."""

    def __init__(self, member: Member, points: Field, lines: list[str], rounding: _Rounding) -> None:
        self._place, self._lines, self._rounding = member.place, lines, rounding
        starts = np.cumsum([0, *(len(block.labels) for block in member.nodes)])
        self._points = {
            id(block): points[start:end]
            for block, start, end in zip(member.nodes, starts[:-1], starts[1:], strict=True)
        }
        self._has_moved = not np.array_equal(points, member.points)
        self.written_out = 0

    def edits(self, scope: Scope) -> _Edits:
        """What changes in the lines of a scope."""
        edits = _Edits()
        for block in scope.nodes if self._has_moved else ():
            points = self._points[id(block)]
            before = self._place.apply(block.system.to_points(block.coordinates))
            moved = np.flatnonzero((points != before).any(axis=1) | block.generated)
            wanted = block.system.from_points(self._place.invert(points[moved]), block.coordinates[moved])
            texts = [[format_real(value) for value in row] for row in wanted.tolist()]
            if block.generated:
                self._write_out(block, texts, edits)
            else:
                for row, node in zip(texts, moved.tolist(), strict=True):
                    number = block.section.numbers[node]
                    edits.lines[number] = _with_coordinates(self._lines[number], row, block.coordinates[node])
            written = np.array(texts, dtype=np.float64).reshape(-1, 3)
            self._rounding.add(points[moved], self._place.apply(block.system.to_points(written)))
        return edits

    def _write_out(self, block: NodeBlock, texts: list[list[str]], edits: _Edits) -> None:
        """Nodes in the place of the statement that generates them, which becomes a comment."""
        section = block.section
        for number in (*range(section.head, section.body), *section.numbers):
            edits.lines[number] = f"** {self._lines[number]}"
        ending = line_ending(self._lines[section.head])
        name = section.options.get("NSET", "")
        new = [keyword_line("NODE", {"NSET": name} if name else {})]
        new += [f"{label}, {', '.join(row)}" for label, row in zip(block.labels.tolist(), texts, strict=True)]
        if name:
            ends = [line.replace(",", " ").split()[:2] for line in section.data]
            new += [keyword_line("NSET", {"NSET": name}), *(", ".join(pair) for pair in ends)]
        last = max((section.body - 1, *section.numbers))
        break_before = "" if self._lines[last].endswith(("\n", "\r")) else ending
        edits.after[last] = break_before + ending.join(new) + ending
        self.written_out += len(texts)


def _with_coordinates(line: str, texts: list[str], before: Field) -> str:
    """A line of a node with other coordinates; those that are the same, and all else, stay as they are."""
    body = line.rstrip("\r\n")
    fields = body.split(",")
    fields += [""] * (4 - len(fields))
    for axis, text in enumerate(texts, 1):
        if float(text) != before[axis - 1]:
            fields[axis] = f" {text}".rjust(len(fields[axis]))
    return ",".join(fields) + line[len(body) :]


def _split(deck: Deck, lines: list[str], edits: _Edits, instances: list[tuple[Member, _Edits]]) -> str:
    """Give each instance of a part, whose shapes differ now, a part of its own: copies that follow the first."""
    (first, first_edits), *others = instances
    part, copies = first.scopes[0], []
    head = _section_of(part)
    for member, edited in others:
        name = f"{part.name}-{member.name}"
        while name.upper() in deck.parts:
            name += "-1"
        copy = _Edits(dict(edited.lines), dict(edited.after))
        _rename(copy, lines, head, "NAME", name)
        copies.append(copy.applied(lines, head.head, part.end))
        _rename(edits, lines, _section_of(member.scopes[1]), "PART", name)
    edits.add(first_edits)
    edits.after[part.end - 1] = "".join(copies)
    return f"the part {part.name!r} as one (each of its {len(instances)} instances has one of its own now)"


def _section_of(scope: Scope) -> Section:
    """The keyword that a part or an instance begins with."""
    assert scope.section is not None
    return scope.section


def _rename(edits: _Edits, lines: list[str], section: Section, option: str, name: str) -> None:
    """Give an option of a keyword another value."""
    edits.lines.update(dict.fromkeys(range(section.head, section.body), ""))
    options = {**section.options, option: name}
    edits.lines[section.head] = keyword_line(section.title, options) + line_ending(lines[section.head])
