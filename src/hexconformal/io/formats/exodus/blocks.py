"""Cells sorted by type and tag, as element blocks and side sets need them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...format_tools.tags import tag_names

__all__ = ["CellGroup", "cell_groups", "with_ids"]

Ints = NDArray[np.int64]


@dataclass(eq=False)
class CellGroup:
    """Cells of one type and tag.

    Attributes
    ----------
    kind
        The type of cell.
    tag, name
        0 and empty if they have none.
    rows
        By the number of their meshio block, their rows in it.
    id
        The number that the file gives to the group.
    """

    kind: str
    tag: int
    name: str
    rows: dict[int, Ints]
    id: int = 0

    @property
    def size(self) -> int:
        return sum(len(rows) for rows in self.rows.values())


def cell_groups(mesh: Any, tags: list[Ints]) -> list[CellGroup]:
    """The cells of a meshio.Mesh by type and tag, in the order in which they appear."""
    names = tag_names(mesh)
    groups: dict[tuple[str, int], CellGroup] = {}
    for number, (block, values) in enumerate(zip(mesh.cells, tags, strict=True)):
        found, first = np.unique(values, return_index=True)
        for tag in found[np.argsort(first)].tolist():
            name = names.get((block.dim, tag), "")
            group = groups.setdefault((block.type, tag), CellGroup(block.type, tag, name, {}))
            group.rows[number] = np.flatnonzero(values == tag)
    return list(groups.values())


def with_ids(groups: list[CellGroup]) -> list[CellGroup]:
    """Give each group its tag for an id, or a free number where that is taken, or not positive."""
    free = max([0, *(group.tag for group in groups)]) + 1
    taken: set[int] = set()
    for group in groups:
        group.id = group.tag
        if group.tag <= 0 or group.tag in taken:
            group.id, free = free, free + 1
        taken.add(group.id)
    return groups
