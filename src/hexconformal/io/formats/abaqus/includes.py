"""Files that a deck includes: their text is put in its place."""

from __future__ import annotations

from pathlib import Path

from ....common import ReadError, first_names
from ...format_tools.file_checks.references import referenced_file
from .statements import keyword_line, line_ending, sections, split_lines

__all__ = ["files_of_deck", "with_included_files"]

_MESH_KEYWORDS = ("NODE", "ELEMENT", "NSET", "ELSET", "NGEN", "ELGEN", "SYSTEM")
_DEPTH, _COUNT = 5, 1000  # Abaqus itself allows five levels
_REPEATS, _FREE = 4, 1_000_000  # how often the text of a file may be repeated; characters that are no matter


def files_of_deck(path: Path) -> list[Path]:
    """The files that a deck includes, and those that it refers to."""
    text = _text_of(path)
    includer = _Includer(path, len(text))
    includer.expanded(text, 0)
    return [path.parent / name for name in (*includer.read, *includer.others)]


def with_included_files(path: Path) -> tuple[str, list[str]]:
    """The text of a deck with that of the files that it includes, and remarks on these.

    Raises
    ------
    ReadError
        If a file is missing, lies outside the folder of the deck and that is not allowed, or the files include one
        another without end.
    """
    text = _text_of(path)
    includer = _Includer(path, len(text))
    whole = includer.expanded(text, 0)
    notes = []
    if includer.read:
        notes.append(f"the text of included files is put into the deck: {first_names(includer.read)}")
    if includer.others:
        notes.append(f"files that the deck refers to stay where they are: {first_names(includer.others)}")
    return whole, notes


class _Includer:
    def __init__(self, deck: Path, size: int) -> None:
        self.read: dict[str, int] = {}
        self.others: dict[str, None] = {}
        self._deck = deck
        self._size, self._count, self._own_size = size, 0, size

    def expanded(self, text: str, depth: int) -> str:
        if "=" not in text or "INPUT" not in text.upper():
            return text
        lines = split_lines(text)
        for section in sections(lines):
            name = section.options.get("INPUT", "")
            if not name:
                continue
            if section.keyword not in ("INCLUDE", *_MESH_KEYWORDS):
                self.others[name] = None
                continue
            included = self.expanded(self._included(name, depth), depth + 1)
            ending = line_ending(lines[section.head])
            head = ""
            if section.keyword != "INCLUDE":
                options = {key: value for key, value in section.options.items() if key != "INPUT"}
                head = keyword_line(section.title, options) + ending
            for number in range(section.head, section.body):
                if not lines[number].lstrip().startswith("**"):
                    lines[number] = ""
            lines[section.head] = head + included + ("" if included.endswith(("\n", "\r")) else ending)
        return "".join(lines)

    def _included(self, name: str, depth: int) -> str:
        path = referenced_file(self._deck, name)
        self._count += 1
        if depth >= _DEPTH or self._count > _COUNT:
            raise ReadError(f"files are included in one another too deep, or too often: {name!r}; put them into one")
        text = _text_of(path)
        self.read[name] = len(text)
        self._size += len(text)
        if self._size > _REPEATS * (self._own_size + sum(self.read.values())) + _FREE:
            raise ReadError(f"the same files are included again and again: {name!r}; put them into one")
        return text


def _text_of(path: Path) -> str:
    """The text of a file; bytes that are no UTF-8, and endings of lines, come out as they came in."""
    return path.read_bytes().decode("utf-8", "surrogateescape")
