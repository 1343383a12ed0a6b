"""Tables as lines of text."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice

__all__ = ["aligned"]

_WIDEST = 28  # letters of a name


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]], most: int, rest: str = "") -> list[str]:
    """Rows of a table as lines, the first column to the left, the others to the right, under their heads.

    Parameters
    ----------
    head
        Names of the columns.
    rows
        Texts, as many as there are columns.
    most
        Rows that are shown; the others are counted.
    rest
        Said of those that are counted: where they are.

    Examples
    --------
    >>> print(*aligned(("region", "cells"), [("steel", "8"), ("rubber", "12"), ("air", "4")], 2), sep="\\n")
    region  cells
    steel       8
    rubber     12
    and 1 more
    """
    shown = [list(head), *(list(row) for row in islice(rows, most))]
    for row in shown:
        row[0] = "".join(filter(str.isprintable, row[0]))
        row[0] = row[0] if len(row[0]) <= _WIDEST else row[0][: _WIDEST - 3] + "..."
    widths = [max(map(len, column)) for column in zip(*shown, strict=True)]
    lines = [
        "  ".join(
            [row[0].ljust(widths[0]), *(text.rjust(width) for text, width in zip(row[1:], widths[1:], strict=True))]
        )
        for row in shown
    ]
    return [*lines, f"and {len(rows) - most} more{rest}"] if len(rows) > most else lines
