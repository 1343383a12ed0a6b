"""Nodes in the middle of edges, faces and cells: linear hexahedra become quadratic ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError
from ..elements import BETWEEN
from .embedded import same_rows

__all__ = ["middle_nodes", "middles_between", "with_middles"]

Ints = NDArray[np.int64]


def middle_nodes(cells: Ints, count: int, nodes: int) -> tuple[Ints, list[Ints]]:
    """Quadratic hexahedra from linear ones: what has the same corners has the same node.

    Parameters
    ----------
    cells
        (m, 8) hexahedra.
    count
        Number of points; further nodes come after them.
    nodes
        Of a quadratic cell: 20 or 27.

    Returns
    -------
    (m, 20 or 27) cells in VTK's order;
    the corners (k, j) around the further nodes, which come in this order: of edges, of faces, of cells.

    Raises
    ------
    OptionError
        If `nodes` is neither.

    Examples
    --------
    >>> cells, corners = middle_nodes(np.arange(8)[None], 8, 27)
    >>> cells.shape, [len(one) for one in corners], corners[0][cells[0, 8] - 8].tolist()
    ((1, 27), [12, 6, 1], [0, 1])
    """
    if not isinstance(nodes, int | np.integer) or nodes not in (20, 27):
        raise OptionError(f"nodes of a quadratic hexahedron must be 20 or 27, not {nodes!r}")
    quadratic, corners = cells, []
    for members in (BETWEEN[:12], BETWEEN[12:18], BETWEEN[18:]) if nodes == 27 else (BETWEEN[:12],):
        ends = cells[:, np.array(members)]
        distinct, inverse = np.unique(np.sort(ends, axis=2).reshape(-1, ends.shape[2]), axis=0, return_inverse=True)
        quadratic = np.concatenate([quadratic, count + inverse.reshape(len(cells), -1)], axis=1)
        corners.append(distinct)
        count += len(distinct)
    return quadratic, corners


def with_middles(values: NDArray[Any], corners: list[Ints]) -> NDArray[Any]:
    """Values on points, and after them on further nodes: the mean of the corners around each.

    Integers and other values are what all of the corners have, or else 0.

    Examples
    --------
    >>> with_middles(np.array([0.0, 1.0, 4.0]), [np.array([[0, 1], [0, 2]])])
    array([0. , 1. , 4. , 0.5, 2. ])
    """
    parts = [values]
    for members in corners:
        own = values[members]
        if values.dtype.kind in "fc":
            # In double precision: the largest number of single precision, which stands for none, has no sum there.
            parts.append(own.mean(axis=1, dtype=np.result_type(values.dtype, np.float64)).astype(values.dtype))
        else:
            parts.append(np.where((own == own[:, :1]).all(axis=1), own[:, 0], np.zeros((), dtype=values.dtype)))
    return np.concatenate(parts)


def middles_between(corners: list[Ints], count: int, between: Ints) -> Ints:
    """The further nodes (k,) that are in the middle of some corners (k, j), in whatever order; -1 where there is none.

    Parameters
    ----------
    corners, count
        What :func:`middle_nodes` returned, and the number of points that it was given.
    between
        Two corners, four, or eight.

    Examples
    --------
    >>> corners = middle_nodes(np.arange(8)[None], 8, 27)[1]
    >>> middles_between(corners, 8, np.array([[0, 3, 2, 1]])), middles_between(corners, 8, np.array([[1, 0], [0, 6]]))
    (array([20]), array([ 8, -1]))
    """
    for members in corners:
        if members.shape[1] == between.shape[1]:
            first = same_rows(np.concatenate([members, between]))[len(members) :]
            return np.where(first < len(members), count + first, -1)
        count += len(members)
    return np.full(len(between), -1)
