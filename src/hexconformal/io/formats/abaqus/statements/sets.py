"""Sets of nodes and elements: what their lines list, and which nodes or elements these are."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .....common import ReadError, first_ids
from .lines import Section, split_fields

__all__ = ["LabelIndex", "SetKey", "SetMember", "WorkLimit", "read_members", "resolve"]

Ints = NDArray[np.int64]
# Number of the member of the mesh; "NSET", "ELSET", or "SURFACE" with a side; name in capitals.
SetKey = tuple[int, str, str]


@dataclass(frozen=True, eq=False)
class SetMember:
    """What a set lists.

    Attributes
    ----------
    labels
        Of nodes or elements.
    ranges
        First, last and step of labels.
    names
        Of other sets, or labels with the name of an instance before them.
    elements
        Name of a set of elements whose nodes belong to it.
    instance
        Name of the instance that all this is in.
    """

    labels: Ints
    ranges: tuple[tuple[int, int, int], ...] = ()
    names: tuple[str, ...] = ()
    elements: str = ""
    instance: str = ""


def read_members(section: Section) -> SetMember:
    """What the lines of *NSET or *ELSET list."""
    options = section.options
    instance = options.get("INSTANCE", "")
    labels: list[int] = []
    names: dict[str, None] = {}
    if "GENERATE" in options:
        rows = {tuple(int(part) for part in line.replace(",", " ").split()) for line in section.data}
        ranges = sorted({(row[0], row[1] if len(row) > 1 else row[0], row[2] if len(row) > 2 else 1) for row in rows})
        if any(step < 1 for _, _, step in ranges):
            raise ReadError(f"the steps of *{section.title}, GENERATE must be 1 or more")
        return SetMember(np.empty(0, dtype=np.int64), tuple(ranges), instance=instance)
    for line in section.data:
        for part in split_fields(line):
            if part.isdecimal():
                labels.append(int(part))
            elif part:
                names[part.strip('"')] = None
    elements = options.get("ELSET", "") if section.keyword == "NSET" else ""
    return SetMember(np.array(labels, dtype=np.int64), (), tuple(names), elements, instance)


class WorkLimit:
    """A limit of what a deck may make a reader do, so that no small one takes hours or all memory."""

    def __init__(self, limit: int, what: str) -> None:
        self._left, self._limit, self._what = limit, limit, what

    def spend(self, amount: int) -> None:
        """Count something; raises a ReadError beyond the limit."""
        self._left -= amount
        if self._left < 0:
            raise ReadError(f"{self._what} must not be more than {self._limit}, as far as this deck is long")


class LabelIndex:
    """Rows of nodes or elements by their labels.

    Parameters
    ----------
    labels
        (k,)
    rows
        (k,)
    what
        What they are, for messages.

    Raises
    ------
    ReadError
        If a label is there twice.
    """

    def __init__(self, labels: Ints, rows: Ints, what: str) -> None:
        order = np.argsort(labels, kind="stable")
        self.labels, self.rows, self.what = labels[order], rows[order], what
        twice = self.labels[1:][self.labels[1:] == self.labels[:-1]]
        if len(twice):
            raise ReadError(f"{what} numbered twice: {first_ids(twice)}")

    def of_all(self, labels: Ints) -> Ints:
        """Rows of labels that all must be there."""
        if len(self.labels) == 0:
            raise ReadError(f"{self.what} that are referred to, but not there: {first_ids(np.unique(labels))}")
        places = np.minimum(np.searchsorted(self.labels, labels), len(self.labels) - 1)
        missing = np.unique(labels[self.labels[places] != labels])
        if len(missing):
            raise ReadError(f"{self.what} that are referred to, but not there: {first_ids(missing)}")
        return np.asarray(self.rows[places])

    def of_present(self, labels: Ints) -> Ints:
        """Rows of those of the labels that are there."""
        places = np.searchsorted(self.labels, labels)
        places[places == len(self.labels)] = 0
        return self.rows[places[self.labels[places] == labels]] if len(self.labels) else self.labels

    def of_ranges(self, ranges: Iterable[tuple[int, int, int]], limit: WorkLimit) -> Ints:
        """Rows of labels in ranges; those that are there are looked at, not the ranges, which may be endless."""
        found = [np.empty(0, dtype=np.int64)]
        for first, last, step in _joined(ranges):
            start, end = np.searchsorted(self.labels, [first, last + 1])
            limit.spend(1 + int(end - start))
            labels = self.labels[start:end]
            found.append(self.rows[start:end][(labels - first) % step == 0])
        return np.concatenate(found)


def _joined(ranges: Iterable[tuple[int, int, int]]) -> list[tuple[int, int, int]]:
    """Ranges of the same step and phase that overlap or adjoin, as one.

    >>> _joined([(1, 9, 1), (5, 20, 1), (1, 9, 2), (11, 13, 2), (2, 8, 2)])
    [(1, 20, 1), (2, 8, 2), (1, 13, 2)]
    """
    result: list[tuple[int, int, int]] = []
    for step, _, first, last in sorted((step, first % step, first, last) for first, last, step in ranges):
        before = result[-1] if result else (0, -1, 0)
        if before[2] == step and (first - before[0]) % step == 0 and first <= before[1] + step:
            result[-1] = (before[0], max(before[1], last), step)
        else:
            result.append((first, last, step))
    return result


def resolve(
    keys: Iterable[SetKey],
    references: Callable[[SetKey], list[SetKey]],
    combine: Callable[[SetKey, list[Ints]], Ints],
) -> dict[SetKey, Ints]:
    """Sets that refer to one another, each once.

    Parameters
    ----------
    keys
        Sets that are wanted.
    references
        Those that a set refers to.
    combine
        Rows of a set, given those of the sets it refers to.

    Raises
    ------
    ReadError
        If a set refers to itself.
    """
    done: dict[SetKey, Ints] = {}
    opened: set[SetKey] = set()
    stack = list(keys)
    while stack:
        key = stack[-1]
        needed = [] if key in done else references(key)
        missing = [other for other in needed if other not in done]
        if key in done or not missing:
            if key not in done:
                done[key] = combine(key, [done[other] for other in needed])
            stack.pop()
        elif opened.intersection(missing):
            raise ReadError(f"the set {key[2]!r} refers to itself")
        else:
            opened.add(key)
            stack.extend(missing)
    return done
