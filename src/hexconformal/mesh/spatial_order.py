"""An order of nodes and cells that depends on where they are, not on how they are numbered.

Along a space-filling curve (Morton 1966) what is near in space is near in memory, so that a mesh in any order is
processed as fast as a well ordered one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["morton_codes", "spatial_order"]

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
        Points at one place come in the order in which they are given.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((1, 1, 2))
    >>> spatial_order(points, cells)[0]
    array([ 0,  4,  1,  5,  2,  6,  3,  7,  8,  9, 10, 11])
    """
    places = points - points.min(axis=0)
    heights = places @ _DIRECTION
    node_ids = np.lexsort((heights, morton_codes(places / max(_BEYOND * float(places.max()), 1e-300))))
    first = np.argsort(node_ids)[cells].min(axis=1)
    return node_ids, np.lexsort((heights[cells].sum(axis=1), first))


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
