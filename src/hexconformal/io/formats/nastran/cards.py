"""Cards of bulk data, put together from lines in free, small and large fields and their continuations."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from ....common import ReadError

__all__ = ["Card", "Line", "bulk_cards", "split_line"]

_BEGIN = re.compile(r"\s*BEGIN[\s,]+(BULK|SUPER)\b", re.IGNORECASE)
_END = re.compile(r"\s*ENDDATA", re.IGNORECASE)
_COLUMNS = 8  # of a small field; a large one has twice as many


@dataclass(frozen=True)
class Line:
    """One line: the fields between the first, which names it, and the last, which names its continuation.

    Attributes
    ----------
    free
        Whether commas separate its fields.
    width
        8, or 16 for large fields.
    head, tail
        The first field, and the last one.
    fields
        The others: 8, or 4 large ones.
    """

    free: bool
    width: int
    head: str
    fields: list[str]
    tail: str


@dataclass
class Card:
    """An entry of bulk data.

    Attributes
    ----------
    name
        In capitals, without a star.
    fields
        All of its data, in order.
    lines
        The numbers of its lines, from 0, and the lines.
    """

    name: str
    fields: list[str] = field(default_factory=list)
    lines: list[tuple[int, Line]] = field(default_factory=list)

    def add(self, number: int, line: Line) -> None:
        self.lines.append((number, line))
        self.fields += line.fields

    def integer(self, place: int, default: int | None = None) -> int:
        """The integer in a field; raises a ReadError if there is none, and no default for an empty one."""
        text = self.fields[place] if place < len(self.fields) else ""
        if not text and default is not None:
            return default
        if not re.fullmatch(r"[+-]?\d+", text):
            where = f"line {self.lines[0][0] + 1}"
            raise ReadError(f"{where}: field {place + 2} of {self.name} must be an integer, not {text!r}")
        return int(text)


def split_line(text: str) -> Line:
    """The fields of a line without its comment.

    >>> split_line("GRID,7,,1.0,2.0,3.0").fields
    ['7', '', '1.0', '2.0', '3.0', '', '', '']
    >>> split_line("*E1     1.5             ").fields
    ['1.5', '', '', '']
    """
    if "," in text:
        head, *parts = (part.strip() for part in text.split(","))
        count = 4 if "*" in head else 8
        if any(parts[count + 1 :]):
            raise ReadError(f"a line has more fields than {count + 2}: {text.strip()[:40]!r}")
        tail = parts[count] if len(parts) > count else ""
        return Line(True, 64 // count, head, (parts[:count] + [""] * count)[:count], tail)
    text = text.expandtabs(_COLUMNS)
    head, body, tail = text[:8].strip(), text[8:72], text[72:80].strip()
    width = 2 * _COLUMNS if "*" in head else _COLUMNS
    return Line(False, width, head, [body[k : k + width].strip() for k in range(0, 64, width)], tail)


def bulk_cards(text: str) -> Iterator[Card]:
    """The cards of the bulk data in a deck, in order; all of the text is taken for it if nothing says where it begins.

    Raises
    ------
    ReadError
        If there are several parts, other files to include, or cards that repeat others.
    """
    lines = text.splitlines()
    begins = {number: line.partition("$")[0].strip() for number, line in enumerate(lines) if _BEGIN.match(line)}
    if len(begins) > 1 or any("SUPER" in line.upper() for line in begins.values()):
        raise ReadError(f"decks of several parts are not supported: {', '.join(begins.values())}")
    card: Card | None = None
    waiting = _Continuations()
    cards: list[Card] = []
    for number in range(min(begins) + 1 if begins else 0, len(lines)):
        if _END.match(lines[number]):
            break
        body = lines[number].partition("$")[0].rstrip()
        if not body.strip() or (body.startswith(("#", "//")) and not begins):
            continue
        if body.lstrip()[:7].upper() == "INCLUDE":
            raise ReadError("the deck includes other files: put them into one")
        line = split_line(body)
        if line.head.startswith("="):
            raise ReadError(f"line {number + 1}: cards that repeat others ({line.head}) are not supported")
        if line.head == "" or line.head[0] in "+*":
            card = waiting.parent(line.head, card)
            if card is None:
                raise ReadError(f"line {number + 1} continues no card")
        else:
            card = Card(line.head.rstrip("*").strip().upper())
            cards.append(card)
        card.add(number, line)
        waiting.note(line.tail, card)
    yield from cards


class _Continuations:
    """The cards that wait for a line of a certain name."""

    def __init__(self) -> None:
        self._cards: dict[str, Card] = {}

    def note(self, tail: str, card: Card) -> None:
        key = tail.lstrip("+*").strip()
        if key:
            self._cards[key] = card

    def parent(self, head: str, last: Card | None) -> Card | None:
        """The card that a continuation belongs to: the one that names it, or else the last one."""
        return self._cards.pop(head.lstrip("+*").strip(), last)
