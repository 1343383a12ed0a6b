"""Meshes with their nodes moved at random."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from ..common import OptionError, first_names
from ..elements import CELL_TYPES, EDGES, collapsed_cells, is_valid
from ..mesh import boundary_quads
from .bricks import CellsByType, Floats, Ints

__all__ = ["jittered"]

Cells = TypeVar("Cells", Ints, CellsByType)


def jittered(
    points: Floats,
    cells: Cells,
    amount: float = 0.3,
    seed: int = 0,
    keep_boundary: bool = True,
    valid: bool = True,
) -> tuple[Floats, Cells]:
    """Move every node at random, in each coordinate by at most ``amount`` times the shortest edge around it.

    Parameters
    ----------
    points, cells
        A mesh, of hexahedra (m, 8) or of linear cells by the name of their type; not changed.
    amount
        Largest displacement, relative to the shortest edge of the node's cells.
    seed
        Seed of the random numbers.
    keep_boundary
        Leave the nodes of the boundary where they are.
    valid
        Shorten displacements where a cell would become invalid; False may tangle the mesh.

    Raises
    ------
    OptionError
        If there are quadratic cells.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = jittered(*box((4, 4, 4)), amount=0.9)
    >>> bool(is_valid(points, cells).all())
    True
    """
    table = _in_one_table(cells) if isinstance(cells, dict) else cells
    squared = np.full(len(table), np.inf)
    for a, b in EDGES:
        edge = points[table[:, b]] - points[table[:, a]]
        own = np.where(table[:, a] == table[:, b], np.inf, np.einsum("ci,ci->c", edge, edge))
        squared = np.minimum(squared, own)
    shortest = np.full(len(points), np.inf)
    np.minimum.at(shortest, table, np.sqrt(squared)[:, None])
    shortest[np.isinf(shortest)] = 0.0  # nodes of no cell
    move = np.random.default_rng(seed).uniform(-amount, amount, points.shape) * shortest[:, None]
    if keep_boundary:
        move[np.unique(boundary_quads(table)[0])] = 0.0
    if valid:
        # Only cells that were valid can be kept so; after the first look, only those whose nodes changed matter.
        valid_cells = watched = table[is_valid(points, table)]
        for attempt in range(40):
            broken = np.zeros(len(points), dtype=np.bool_)
            broken[watched[~is_valid(points + move, watched)]] = True
            move[broken] *= 0.7 if attempt < 20 else 0.0
            watched = valid_cells[broken[valid_cells].any(axis=1)]
            if not len(watched):
                break
    return points + move, cells


def _in_one_table(cells: CellsByType) -> Ints:
    """(m, 8) cells of all types, those that are no hexahedra collapsed."""
    others = [name for name in cells if name not in CELL_TYPES]
    if others:
        raise OptionError(f"cells must be linear, {', '.join(CELL_TYPES)}, not {first_names(others)}")
    tables = [collapsed_cells(np.asarray(nodes), CELL_TYPES[name]) for name, nodes in cells.items()]
    return np.concatenate([np.empty((0, 8), dtype=np.int64), *tables])
