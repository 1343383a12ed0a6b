"""The lines of a deck: keywords with their options, and the data that follow them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from io import StringIO
from itertools import pairwise

__all__ = ["Section", "keyword_line", "line_ending", "sections", "split_fields", "split_keyword", "split_lines"]


@dataclass(frozen=True)
class Section:
    """A keyword and its data.

    Attributes
    ----------
    title
        The keyword as it is shown: in capitals, with one space between words.
    keyword
        The same without spaces, since CalculiX takes *ENDSTEP for *END STEP.
    options
        Their values by names in capitals; "" where there is none.
    head, body, end
        Lines of the deck that belong to it: from `head`, where the keyword is, to before `end`; data from `body` on.
    numbers
        Numbers of the lines with data.
    data
        These lines, without blanks around them.
    """

    title: str
    keyword: str
    options: dict[str, str]
    head: int
    body: int
    end: int
    numbers: list[int]
    data: list[str]


def split_lines(text: str) -> list[str]:
    """The lines of a text with their endings, which stay as they are."""
    return list(StringIO(text, newline=""))


def line_ending(line: str) -> str:
    """How a line ends; as most do, if it is the last one and unfinished."""
    return line[len(line.rstrip("\r\n")) :] or "\n"


def sections(lines: list[str]) -> Iterator[Section]:
    """The sections of a deck, in order; what precedes the first keyword, and comments, belong to none."""
    starts = [number for number, line in enumerate(lines) if _is_keyword(line)]
    for head, end in pairwise([*starts, len(lines)]):
        first, text = head + 1, lines[head].strip(" \t\r\n\ufeff")
        while text.endswith(",") and first < end:
            if not lines[first].lstrip().startswith("**"):
                text += lines[first].strip()
            first += 1
        pairs = ((number, lines[number].strip()) for number in range(first, end))
        kept = [(number, line) for number, line in pairs if line and not line.startswith("**")]
        title, options = split_keyword(text)
        keyword = title.replace(" ", "")
        yield Section(title, keyword, options, head, first, end, [n for n, _ in kept], [line for _, line in kept])


def _is_keyword(line: str) -> bool:
    start = line.lstrip(" \t\ufeff")
    return start.startswith("*") and not start.startswith("**")


def split_keyword(line: str) -> tuple[str, dict[str, str]]:
    """The keyword of a line, and its options.

    >>> split_keyword('*Nset, nset="Left, top", generate')
    ('NSET', {'NSET': 'Left, top', 'GENERATE': ''})
    """
    keyword, *options = split_fields(line.lstrip().lstrip("*"))
    pairs = [option.partition("=") for option in options if option]
    values = {"".join(key.split()).upper(): value.strip().strip('"') for key, _, value in pairs}
    return " ".join(keyword.upper().split()), values


def split_fields(line: str) -> list[str]:
    """The parts of a line between commas that no quotes enclose."""
    parts = line.split(",")
    if '"' in line:
        whole: list[str] = []
        is_open = False
        for part in parts:
            if is_open:
                whole[-1] += "," + part
            else:
                whole.append(part)
            is_open ^= part.count('"') % 2 == 1
        parts = whole
    return [part.strip() for part in parts]


def keyword_line(title: str, options: dict[str, str]) -> str:
    """A keyword with its options, as a line without an end.

    >>> keyword_line("NSET", {"NSET": "Left side", "GENERATE": ""})
    '*NSET, NSET="Left side", GENERATE'
    """

    def quoted(value: str) -> str:
        return f'"{value}"' if "," in value or " " in value else value

    return ", ".join([f"*{title}", *(f"{key}={quoted(value)}" if value else key for key, value in options.items())])
