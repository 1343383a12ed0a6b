"""Nodes and elements that a deck generates: *NGEN and *ELGEN."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError
from .deck import ElementBlock, NodeBlock, Scope
from .statements import Section, System, WorkLimit

__all__ = ["Generator"]

Ints = NDArray[np.int64]

_LIMIT = 20_000_000


class Generator:
    """Generates nodes and elements of a deck, and not without end."""

    def __init__(self) -> None:
        self._limit = WorkLimit(_LIMIT, "generated nodes and elements")
        self._scope: Scope | None = None
        self._seen = [0, 0]
        self._points: dict[int, NDArray[np.float64]] = {}
        self._cells: dict[int, tuple[ElementBlock, int]] = {}

    def nodes(self, scope: Scope, section: Section) -> tuple[NodeBlock, Ints]:
        """Nodes of *NGEN on straight lines between others, and the labels of these and of their ends.

        Raises
        ------
        ReadError
            If the ends are not there, or the line is curved.
        """
        if section.options.get("LINE", ""):
            raise ReadError(
                f"*{section.title} with LINE={section.options['LINE']} is not supported: write the nodes out"
            )
        self._look_at(scope)
        labels, points, ends = [np.empty(0, dtype=np.int64)], [np.empty((0, 3))], []
        for row in _rows(section):
            first, last, step = [*row[:2], *row[2:3], 1][:3] if len(row) > 1 else (0, 0, 0)
            if step == 0 or (last - first) % step or (last - first) // step < 1:
                raise ReadError(
                    f"*{section.title} must list two nodes and a step that leads from one to the other: {row}"
                )
            count = (last - first) // step
            self._limit.spend(count)
            missing = [label for label in (first, last) if label not in self._points]
            if missing:
                raise ReadError(f"*{section.title} refers to the node {missing[0]}, which is not there")
            share = np.arange(1, count)[:, None] / count
            start, end = self._points[first], self._points[last]
            labels.append(first + step * np.arange(1, count))
            points.append(start + share * (end - start))
            # A later line may start from a node of this one.
            self._points.update(zip(labels[-1].tolist(), points[-1], strict=True))
            ends += [first, last]
        system = System("R", scope.frame)
        made = np.concatenate(labels)
        coordinates = system.from_points(np.concatenate(points), np.zeros((len(made), 3)))
        return NodeBlock(section, made, coordinates, system, True), np.union1d(made, np.array(ends, dtype=np.int64))

    def elements(self, scope: Scope, section: Section) -> tuple[list[ElementBlock], Ints]:
        """Elements of *ELGEN, and the labels of these and of those that they are made after.

        Raises
        ------
        ReadError
            If an element to go by is not there.
        """
        self._look_at(scope)
        blocks, labels = [], [np.empty(0, dtype=np.int64)]
        for row in _rows(section):
            if row[0] not in self._cells:
                raise ReadError(f"*{section.title} refers to the element {row[0]}, which is not there")
            block, place = self._cells[row[0]]
            offsets = np.zeros((1, 2), dtype=np.int64)
            for start in (1, 4, 7):
                given = row[start : start + 3]
                count, *steps = [*given, *[1, 1, 1][len(given) :]]
                if count < 1:
                    raise ReadError(f"*{section.title} must count 1 element or more in a row: {row}")
                self._limit.spend(count * len(offsets))
                new = np.arange(count)[:, None, None] * np.array(steps, dtype=np.int64)
                offsets = (new + offsets).reshape(-1, 2)
            nodes = block.nodes[place] + offsets[1:, :1]
            made = ElementBlock(block.name, block.cell_type, row[0] + offsets[1:, 1], nodes)
            blocks.append(made)
            labels.append(row[0] + offsets[:, 1])
        return blocks, np.concatenate(labels)

    def _look_at(self, scope: Scope) -> None:
        """Take in what nodes and elements came since the last time."""
        if scope is not self._scope:
            self._scope, self._seen, self._points, self._cells = scope, [0, 0], {}, {}
        for nodes in scope.nodes[self._seen[0] :]:
            points = nodes.system.to_points(nodes.coordinates)
            self._points.update(zip(nodes.labels.tolist(), points, strict=True))
        for block in scope.elements[self._seen[1] :]:
            self._cells.update((label, (block, place)) for place, label in enumerate(block.labels.tolist()))
        self._seen = [len(scope.nodes), len(scope.elements)]


def _rows(section: Section) -> list[list[int]]:
    """The records of a section; those that end with a comma go on in the next line."""
    rows: list[list[int]] = []
    goes_on = False
    for line in section.data:
        numbers = [int(part) for part in line.replace(",", " ").split()]
        if goes_on:
            rows[-1] += numbers
        else:
            rows.append(numbers)
        goes_on = line.endswith(",")
    return [row for row in rows if row]
