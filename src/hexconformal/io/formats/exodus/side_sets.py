"""Tagged faces as sides of the solid cells that they bound."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .blocks import CellGroup
from .elements import SHELLS, SIDES

__all__ = ["SideTable"]

Ints = NDArray[np.int64]


class SideTable:
    """The sides that tagged triangles and quadrilaterals of a meshio.Mesh are.

    Attributes
    ----------
    groups
        Those groups whose cells are all sides of solid cells.
    """

    def __init__(self, mesh: Any, groups: list[CellGroup]) -> None:
        self._mesh = mesh
        # Per meshio block of faces: block, row and side of the solid cell.
        self._found: dict[int, Ints] = {}
        wanted = [group for group in groups if group.tag and group.kind in SHELLS]
        if wanted:
            self._match(sorted({number for group in wanted for number in group.rows}))
        self.groups = [g for g in wanted if all((self._found[k][rows] >= 0).all() for k, rows in g.rows.items())]

    def tagged(self) -> list[CellGroup]:
        """Groups of one tag, whatever the types of their cells, as one."""
        merged: dict[int, CellGroup] = {}
        for group in self.groups:
            rows = merged.setdefault(group.tag, CellGroup("", group.tag, group.name, {}, 2)).rows
            rows.update(group.rows)
        return list(merged.values())

    def of(self, rows: dict[int, Ints], places: list[Ints]) -> tuple[Ints, Ints]:
        """Elements and sides, counted from 0, of rows of blocks of faces."""
        table = np.concatenate([self._found[number][part] for number, part in rows.items() if len(part)])
        elements = np.empty(len(table), dtype=np.int64)
        for block in np.unique(table[:, 0]).tolist():
            mine = table[:, 0] == block
            elements[mine] = places[block][table[mine, 1]]
        return elements, table[:, 2]

    def _match(self, numbers: list[int]) -> None:
        keys, origins = [], []
        for number, block in enumerate(self._mesh.cells):
            if block.dim == 3:
                for side, corners in enumerate(SIDES[block.type]):
                    keys.append(_key(np.asarray(block.data)[:, list(corners)]))
                    count = len(block.data)
                    origins.append(np.stack([np.full(count, number), np.arange(count), np.full(count, side)], axis=1))
        solid, where = np.concatenate(keys), np.concatenate(origins)
        for number in numbers:
            block = self._mesh.cells[number]
            own = _key(np.asarray(block.data)[:, : 3 if block.type.startswith("tri") else 4])
            _, first, inverse = np.unique(np.concatenate([solid, own]), axis=0, return_index=True, return_inverse=True)
            place = first[inverse.ravel()[len(solid) :]]
            self._found[number] = np.where((place < len(solid))[:, None], where[np.minimum(place, len(solid) - 1)], -1)


def _key(corners: Ints) -> Ints:
    """(k, 4) corners of faces in ascending order, -1 before those of triangles."""
    return np.pad(np.sort(corners, axis=1), ((0, 0), (4 - corners.shape[1], 0)), constant_values=-1)
