"""Cells sorted by type and tag, as element blocks and side sets need them.

Exodus' blocks have one type of elements each. Which of them are one region is told by a property of theirs, as the
format has it for what users say of blocks (the manual's ex_put_prop): the same number, and further blocks are named as
the first is, with the name of their elements behind it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...format_tools.tags import tag_names

__all__ = ["REGION", "CellGroup", "cell_groups", "with_ids"]

REGION = "REGION"  # the property

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
    dimension
        Of the type.
    id
        The number that the file gives to the group.
    region
        The same number for groups of one dimension and tag, from 1 on.
    """

    kind: str
    tag: int
    name: str
    rows: dict[int, Ints]
    dimension: int
    id: int = 0
    region: int = 0

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
            group = groups.setdefault((block.type, tag), CellGroup(block.type, tag, name, {}, block.dim))
            group.rows[number] = np.flatnonzero(values == tag)
    return list(groups.values())


def with_ids(groups: list[CellGroup]) -> list[CellGroup]:
    """Give each group its tag for an id, or a free number where that is taken, or not positive; and its region."""
    free = max([0, *(group.tag for group in groups)]) + 1
    taken: set[int] = set()
    regions: dict[tuple[int, int], int] = {}
    for group in groups:
        group.region = regions.setdefault((group.dimension, group.tag), len(regions) + 1)
        group.id = group.tag
        if group.tag <= 0 or group.tag in taken:
            group.id, free = free, free + 1
        taken.add(group.id)
    return groups
