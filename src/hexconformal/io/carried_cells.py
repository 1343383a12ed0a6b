"""Cells of lower dimension in what a mesh is made from: vertices, lines, triangles and quadrilaterals by corners."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh import CarriedCells

__all__ = ["corners_of", "of_grid", "of_meshio"]

Ints = NDArray[np.int64]

# By number of corners. Cells of second and higher order, whose corners come first, are among them.
_MESHIO_TYPES = {
    1: r"vertex",
    2: r"line\d*|VTK_(LAGRANGE|BEZIER)_CURVE",
    3: r"triangle\d*|VTK_(LAGRANGE|BEZIER)_TRIANGLE",
    4: r"quad\d*|VTK_(LAGRANGE|BEZIER)_QUADRILATERAL",
}
_VTK_TYPES = {1: (1, 2), 2: (3, 4, 21, 35, 68, 75), 3: (5, 22, 34, 69, 76), 4: (8, 9, 23, 28, 30, 70, 77)}
_CHAINS = (2, 4)  # vertices and lines of VTK that may have any number of nodes: as many cells as it takes


def corners_of(name: str) -> int:
    """How many corners cells of a type have, by its name in meshio; 0 for cells of three dimensions and polygons.

    >>> corners_of("quad9"), corners_of("line"), corners_of("wedge")
    (4, 2, 0)
    """
    return next((count for count, types in _MESHIO_TYPES.items() if re.fullmatch(types, name)), 0)


def of_meshio(mesh: Any, corners: int) -> CarriedCells:
    """Those of a meshio.Mesh with so many corners; sets that Gmsh adds for itself are left out."""
    numbers = [k for k, block in enumerate(mesh.cells) if re.fullmatch(_MESHIO_TYPES[corners], block.type)]
    empty = np.empty((0, corners), dtype=np.int64)
    parts = [np.asarray(mesh.cells[k].data, dtype=np.int64)[:, :corners] for k in numbers]
    if not parts:
        return CarriedCells(empty)
    arrays = {
        name: np.concatenate([np.asarray(values[k]) for k in numbers])
        for name, values in mesh.cell_data.items()
        if len({np.shape(values[k])[1:] for k in numbers}) == 1
    }
    sets: dict[str, Any] = {}
    for name, rows in mesh.cell_sets.items():
        if not str(name).startswith("gmsh:"):
            masks = [_mask(rows[k] if k < len(rows) else None, len(mesh.cells[k].data)) for k in numbers]
            sets[str(name)] = np.concatenate(masks)
    for tag, names in getattr(mesh, "cell_tags", {}).items():  # the families of MED, each in several groups
        for name in names:
            sets[name] = sets.get(name, False) | (arrays["cell_tags"] == tag)
    return CarriedCells(np.concatenate(parts), arrays, sets)


def of_grid(
    types: NDArray[Any],
    offsets: Ints,
    nodes: Ints,
    corners: int,
    arrays: Mapping[str, Any],
) -> CarriedCells:
    """Those of a VTK grid with so many corners.

    Parameters
    ----------
    types
        (m,) VTK's numbers of the cells' types.
    offsets
        (m + 1,) where the nodes of each cell start.
    nodes
        Nodes of all cells, one cell after the other.
    corners
        1 to 4.
    arrays
        On the cells (m,), by name.
    """
    is_carried = np.isin(types, _VTK_TYPES[corners])
    cells = np.flatnonzero(is_carried)
    is_chain = np.isin(types[cells], _CHAINS)
    counts = np.where(is_chain, np.maximum(np.diff(offsets)[cells] - corners + 1, 0), 1)
    steps = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
    rows = np.repeat(cells, counts)
    table = nodes[(offsets[rows] + steps)[:, None] + np.arange(corners)]
    return CarriedCells(table, {name: np.asarray(values)[rows] for name, values in arrays.items()})


def _mask(members: Any, count: int) -> NDArray[np.bool_]:
    mask = np.zeros(count, dtype=bool)
    if members is not None and len(members):
        mask[np.asarray(members)] = True
    return mask
