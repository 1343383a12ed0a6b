"""Meshes with their nodes moved at random."""

from __future__ import annotations

import numpy as np

from ..elements import EDGES, is_valid
from ..mesh import boundary_quads
from .bricks import Floats, Hexes, Ints

__all__ = ["jittered"]


def jittered(
    points: Floats,
    cells: Ints,
    amount: float = 0.3,
    seed: int = 0,
    keep_boundary: bool = True,
    valid: bool = True,
) -> Hexes:
    """Move every node at random, in each coordinate by at most ``amount`` times the shortest edge around it.

    Parameters
    ----------
    points, cells
        A mesh; not changed.
    amount
        Largest displacement, relative to the shortest edge of the node's cells.
    seed
        Seed of the random numbers.
    keep_boundary
        Leave the nodes of the boundary where they are.
    valid
        Shorten displacements where a cell would become invalid; False may tangle the mesh.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = jittered(*box((4, 4, 4)), amount=0.9)
    >>> bool(is_valid(points, cells).all())
    True
    """
    edges = [points[cells[:, b]] - points[cells[:, a]] for a, b in EDGES]
    squared = np.min([np.einsum("ci,ci->c", edge, edge) for edge in edges], axis=0)
    shortest = np.full(len(points), np.inf)
    np.minimum.at(shortest, cells, np.sqrt(squared)[:, None])
    shortest[np.isinf(shortest)] = 0.0  # nodes of no cell
    move = np.random.default_rng(seed).uniform(-amount, amount, points.shape) * shortest[:, None]
    if keep_boundary:
        move[np.unique(boundary_quads(cells)[0])] = 0.0
    if valid:
        # Only cells that were valid can be kept so; after the first look, only those whose nodes changed matter.
        valid_cells = watched = cells[is_valid(points, cells)]
        for attempt in range(40):
            broken = np.zeros(len(points), dtype=np.bool_)
            broken[watched[~is_valid(points + move, watched)]] = True
            move[broken] *= 0.7 if attempt < 20 else 0.0
            watched = valid_cells[broken[valid_cells].any(axis=1)]
            if not len(watched):
                break
    return points + move, cells
