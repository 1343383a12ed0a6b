"""Upper bound of the smallest scaled Jacobian: that of as many hexahedra as meet at a node inside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..elements import HEXAHEDRON, rows_by_type
from ..mesh import SERIAL, Space

__all__ = ["connectivity_bound", "connectivity_bounds", "scaled_jacobian_around_a_node"]


def scaled_jacobian_around_a_node(count: int) -> float:
    """What the smallest scaled Jacobian at a node inside, at which so many hexahedra meet, cannot exceed.

    Their corners there fill the solid angle 4 pi, so that one has at least, and one at most, its share, and none with
    an angle A has a larger determinant of unit edges than the regular one, whose faces meet at (A + pi) / 3. And by
    Euler's formula 6 k / (k + 4) cells on average are around the edges at the node: around one of these are so many at
    most, rounded down, around one so many at least, rounded up, and the scaled Jacobian of one of them is at most the
    sine of its share of 2 pi. Equation (12b) of docs/mathematics.md.

    Parameters
    ----------
    count
        Number k of hexahedra.

    Examples
    --------
    >>> [round(scaled_jacobian_around_a_node(count), 4) for count in (4, 6, 8, 10, 12, 16)]
    [0.7698, 0.866, 1.0, 0.9511, 0.9413, 0.8481]
    """
    cosine = np.cos((4.0 * np.pi / count + np.pi) / 3.0)
    between = cosine / (1.0 - cosine)  # cosine of the angle between two edges of the regular corner
    corner = np.sqrt(max(1.0 + 2.0 * between**3 - 3.0 * between**2, 0.0))
    fewest, most = 6 * count // (count + 4), -(-6 * count // (count + 4))
    around = [np.sin(2.0 * np.pi / number) for number in (min(fewest, 4), max(most, 4)) if number > 1]
    return float(min(corner, *around))


def connectivity_bound(
    cells: NDArray[np.int64], boundary: NDArray[np.bool_], space: Space = SERIAL
) -> tuple[float, int | None, int]:
    """Upper bound of the smallest scaled Jacobian, wherever the nodes are.

    Parameters
    ----------
    cells
        (m, 8) cells; nodes of others than hexahedra say nothing.
    boundary
        (n,) nodes on the boundary.
    space
        Where fields on nodes live.

    Returns
    -------
    The bound, a node here to which it belongs, None where there is none, and how many hexahedra meet there.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((2, 2, 2))
    >>> connectivity_bound(cells, (points != 0.5).any(axis=1))
    (1.0, 13, 8)
    """
    around, bounds = _around_nodes(cells, boundary, space)
    around, bounds = space.own(around), space.own(bounds)
    lowest = space.smallest(bounds)
    if not np.isfinite(lowest):
        return 1.0, None, 0
    at = np.flatnonzero(bounds == lowest)
    count = -int(space.smallest(-around[at].astype(np.float64)))
    return lowest, int(at[0]) if len(at) else None, count


def connectivity_bounds(
    cells: NDArray[np.int64], boundary: NDArray[np.bool_], space: Space = SERIAL
) -> NDArray[np.float64]:
    """The same bound for every cell (m,), of the nodes that it has; 1 where these say nothing.

    Of the cells around a node one stays at or below it.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((2, 2, 2))
    >>> np.unique(connectivity_bounds(cells, (points != 0.5).any(axis=1)))
    array([1.])
    """
    bounds = _around_nodes(cells, boundary, space)[1]
    return np.minimum(bounds[cells].min(axis=1, initial=np.inf), 1.0)


def _around_nodes(
    cells: NDArray[np.int64], boundary: NDArray[np.bool_], space: Space
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """(n,) hexahedra around each node, 0 where others are, or the boundary; and the bounds, infinite there."""
    counts, other = np.zeros((len(boundary), 1)), np.array(boundary)
    for one in rows_by_type(cells):
        own = one.own_nodes(cells)
        if one.cell_type is HEXAHEDRON:
            counts[:, 0] += np.bincount(own.ravel(), minlength=len(counts))
        else:
            other[own] = True
    around = space.update(space.add(counts))[:, 0].astype(np.int64)
    around[space.joined(other)] = 0
    kinds, which = np.unique(around, return_inverse=True)
    bounds = np.array([scaled_jacobian_around_a_node(count) if count > 0 else np.inf for count in kinds.tolist()])
    return around, bounds[which]
