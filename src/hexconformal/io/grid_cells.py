"""The cells of a grid of pyvista: where their nodes are, and these by type."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .cell_types import MESHIO_TYPES
from .selection import Block
from .vtk_mesh import SOLIDS, cell_type_name

__all__ = ["cell_nodes", "cell_offsets", "grid_blocks", "node_places"]

_PIXEL, _PIXEL_NODES = 8, [0, 1, 3, 2]


def cell_offsets(grid: Any) -> NDArray[np.int64]:
    """(m + 1,) where the nodes of each cell start, whatever the version of pyvista calls it."""
    return np.asarray(grid.cell_offsets if hasattr(type(grid), "cell_offsets") else grid.offset)


def grid_blocks(grid: Any) -> list[tuple[int, Block]]:
    """VTK's numbers of the types of the cells of an unstructured grid, and these cells, by meshio's names.

    They are grouped by type, and by size where a type has cells of several, in the order of first appearance.
    """
    types, offsets = grid.celltypes, cell_offsets(grid)
    sizes, connectivity = np.diff(offsets), np.asarray(grid.cell_connectivity, dtype=np.int64)
    kinds, first, which = np.unique(np.column_stack([types, sizes]), axis=0, return_index=True, return_inverse=True)
    found = []
    for kind in np.argsort(first).tolist():
        code, size = kinds[kind].tolist()
        rows = np.flatnonzero(which.ravel() == kind)
        nodes = connectivity[offsets[rows][:, None] + np.arange(size)]
        name = "quad" if code == _PIXEL else MESHIO_TYPES.get(code) or cell_type_name(code)
        nodes = nodes[:, _PIXEL_NODES] if code == _PIXEL else nodes
        found.append((code, Block(name, 3 if code in SOLIDS else 2, nodes, rows)))
    return found


def cell_nodes(grid: Any, rows: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sizes of some cells of an unstructured grid, and their nodes, one cell after the other."""
    offsets = cell_offsets(grid)
    nodes = np.asarray(grid.cell_connectivity, dtype=np.int64)
    return np.diff(offsets)[rows], nodes[node_places(offsets, rows)]


def node_places(offsets: NDArray[np.int64], rows: Any) -> NDArray[np.int64]:
    """Where the nodes of some cells are, one cell after the other."""
    sizes = np.diff(offsets)[rows]
    return np.repeat(offsets[rows] - np.cumsum(sizes) + sizes, sizes) + np.arange(int(sizes.sum()))
