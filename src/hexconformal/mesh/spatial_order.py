"""An order of nodes and cells that depends on where they are, not on how they are numbered.

Along a space-filling curve (Morton 1966) what is near in space is near in memory, so that a mesh in any order is
processed as fast as a well ordered one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .topology import components

__all__ = ["curve_positions", "morton_codes", "spatial_order"]

Ints = NDArray[np.int64]

_DIRECTION = np.array([0.7390851332, 0.5671432904, 0.3637586203])  # no two nodes of a grid are at one height along it
_BITS = 10  # of the curve, along each axis; within its cubes the height decides
_BEYOND = 1.0000123  # the curve's box over the mesh's, so that no plane of a grid is a face of its cubes


def spatial_order(points: NDArray[np.float64], cells: Ints) -> tuple[Ints, Ints]:
    """Ids of nodes and of cells, ordered along a space-filling curve.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, 8) nodes.

    Returns
    -------
    node_ids, cell_ids
        (n,), (m,) ids; the same nodes and cells in the same order, whatever their numbers and the unit of length.
        Points at one place are told apart by the cells around them; those of no cell come last.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((1, 1, 2))
    >>> spatial_order(points, cells)[0]
    array([ 0,  4,  1,  5,  2,  6,  3,  7,  8,  9, 10, 11])
    """
    unused = np.ones(len(points), dtype=bool)
    unused[cells] = False
    places = points - points[~unused].min(axis=0)
    codes, heights = curve_positions(places, float(places[~unused].max()))
    node_ids = np.lexsort((*points.T, heights, codes, unused))
    alike = (points[node_ids[1:]] == points[node_ids[:-1]]).all(axis=1) & ~unused[node_ids[1:]] & ~unused[node_ids[:-1]]
    if alike.any():
        ranks = np.empty(len(points), dtype=np.int64)
        ranks[node_ids] = _firsts(np.concatenate([[True], ~alike]))
        node_ids = np.argsort(_told_apart(ranks, cells))
    ranked = np.argsort(node_ids)[cells]
    return node_ids, np.lexsort((*ranked.T, heights[cells].sum(axis=1), ranked.min(axis=1)))


def _told_apart(ranks: Ints, cells: Ints) -> Ints:
    """Ranks (n,) of nodes without ties, from ranks with ties (those of a tie leave room for it).

    The ranks in the cells around a node tell it from others of its rank, until nothing changes any more (color
    refinement). Then only copies are left: whole pieces of the mesh, or nodes with the same surroundings. Their order
    is that of their numbers, which renames copies and nothing else.
    """
    while True:
        tied = np.flatnonzero(np.bincount(ranks, minlength=len(ranks))[ranks] > 1)
        if len(tied) == 0:
            return ranks
        for keys in (_surroundings, _pieces, _first_of_all):
            finer = _refined(ranks, tied, keys(ranks, tied, cells))
            if not np.array_equal(finer, ranks):
                break
        ranks = finer


def _refined(ranks: Ints, tied: Ints, keys: Ints) -> Ints:
    """The ranks (n,) with ties between the tied nodes (t,) broken by their keys (t, k), as far as these differ."""
    order = np.lexsort((*keys.T[::-1], ranks[tied]))
    nodes, rows = tied[order], np.column_stack([ranks[tied], keys])[order]
    change = np.concatenate([np.ones((1, rows.shape[1]), dtype=bool), rows[1:] != rows[:-1]])
    finer = ranks.copy()
    finer[nodes] += _firsts(np.asarray(change.any(axis=1))) - _firsts(change[:, 0])
    return finer


def _firsts(begins: NDArray[np.bool_]) -> Ints:
    """Place of the first of the group that each of a row is in, told where groups begin."""
    return np.maximum.accumulate(np.where(begins, np.arange(len(begins)), 0))


def _surroundings(ranks: Ints, tied: Ints, cells: Ints) -> Ints:
    """(t, k) what cells are around the tied nodes, and which of their corners those are."""
    place = np.full(len(ranks), -1)
    place[tied] = np.arange(len(tied))
    around = cells[(place[cells] >= 0).any(axis=1)]
    kinds = np.unique(ranks[around], axis=0, return_inverse=True)[1].reshape(-1)
    corners = (8 * kinds[:, None] + np.arange(8)).ravel()
    owners = place[around].ravel()
    corners, owners = corners[owners >= 0], owners[owners >= 0]
    order = np.lexsort((corners, owners))
    corners, owners = corners[order], owners[order]
    column = np.arange(len(owners)) - _firsts(np.concatenate([[True], owners[1:] != owners[:-1]]))
    keys = np.full((len(tied), int(column.max()) + 1), -1)
    keys[owners, column] = corners
    return keys


def _pieces(ranks: Ints, tied: Ints, cells: Ints) -> Ints:
    """(t, 1) the piece of the mesh that each of the tied nodes is in."""
    pieces = np.empty_like(ranks)
    pieces[cells] = components(cells)[1][:, None]
    return pieces[tied, None]


def _first_of_all(ranks: Ints, tied: Ints, cells: Ints) -> Ints:
    """(t, 1) zero for the first of the tied nodes of lowest rank, one for all others."""
    return np.asarray(np.arange(len(tied)) != np.argmin(ranks[tied]), dtype=np.int64)[:, None]


def curve_positions(places: NDArray[np.float64], extent: float) -> tuple[Ints, NDArray[np.float64]]:
    """Positions (n,) along Morton's curve of places (n, 3) in a box of some extent, and heights that tell more apart.

    Examples
    --------
    >>> positions, heights = curve_positions(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1e-4]]), 1.0)
    >>> positions.tolist(), bool(heights[0] < heights[1])
    ([0, 0], True)
    """
    # Summed row by row: in a product of matrices the last digit depends on the number of the row.
    heights = places[:, 0] * _DIRECTION[0] + places[:, 1] * _DIRECTION[1] + places[:, 2] * _DIRECTION[2]
    return morton_codes(places / max(_BEYOND * extent, 1e-300)), heights


def morton_codes(places: NDArray[np.float64]) -> Ints:
    """Positions (n,) along Morton's curve of points (n, 3) in the unit cube; others are clipped to it.

    Examples
    --------
    >>> (morton_codes(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 1.0, 1.0]])) / 8.0**10).round(3)
    array([0.   , 0.125, 1.   ])
    """
    steps = np.clip(places * 2**_BITS, 0, 2**_BITS - 1).astype(np.int64)
    keys = np.zeros(len(places), dtype=np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            keys |= ((steps[:, axis] >> bit) & 1) << (3 * bit + axis)
    return keys
