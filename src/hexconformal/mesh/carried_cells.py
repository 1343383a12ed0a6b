"""Cells of lower dimension that a mesh carries along beside its hexahedra."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .regions import SURFACE_ARRAYS

__all__ = ["CarriedCells", "telling_tags"]

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class CarriedCells:
    """Cells with the same number of corners: vertices, lines, triangles or quadrilaterals.

    Attributes
    ----------
    nodes
        (k, j) their corners.
    arrays
        (k,) values by name.
    sets
        Masks (k,) by the name of a set or group.
    """

    nodes: Ints
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    sets: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)

    def behind(self, triangles: CarriedCells) -> CarriedCells:
        """Quadrilaterals behind triangles, which have their last node twice, with the arrays that both have."""
        if len(triangles.nodes) == 0:
            return self
        if len(self.nodes) == 0:
            return replace(triangles, nodes=triangles.nodes[:, [0, 1, 2, 2]])
        one, other = len(triangles.nodes), len(self.nodes)
        both = [name for name in triangles.arrays if name in self.arrays]
        sets = {
            name: np.concatenate([
                triangles.sets.get(name, np.zeros(one, dtype=bool)), self.sets.get(name, np.zeros(other, dtype=bool))
            ])
            for name in {**triangles.sets, **self.sets}
        }  # fmt: skip
        return CarriedCells(
            np.concatenate([triangles.nodes[:, [0, 1, 2, 2]], self.nodes]),
            {name: np.concatenate([triangles.arrays[name], self.arrays[name]]) for name in both},
            sets,
        )


def telling_tags(cells: CarriedCells, rows: Ints) -> tuple[str, Ints] | None:
    """The first array of integers with a name that stands for tags, and with more than one value.

    Looked for are ``gmsh:geometrical``, ``CellEntityIds``, ``gmsh:physical``, ``medit:ref``, ``cell_tags`` and the
    like.

    Parameters
    ----------
    cells
        What the mesh carries.
    rows
        (r,) the cells that are looked at.

    Returns
    -------
    The name, and (r,) values; None if there is none.

    Examples
    --------
    >>> cells = CarriedCells(np.zeros((2, 4), int), {"gmsh:geometrical": np.array([5, 5]), "tag": np.array([3, 4])})
    >>> telling_tags(cells, np.array([0, 1]))
    ('tag', array([3, 4]))
    """
    for name in SURFACE_ARRAYS:
        values = cells.arrays.get(name)
        if values is None or len(rows) == 0 or values.ndim != 1 or not np.array_equal(values, np.rint(values)):
            continue
        tags = values[rows].astype(np.int64)
        if (tags != tags[0]).any():
            return name, tags
    return None
