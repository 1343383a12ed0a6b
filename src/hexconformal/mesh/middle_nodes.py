"""Nodes in the middle of edges, faces and cells: linear cells become quadratic ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError
from ..elements import HEXAHEDRON, CellType, between, quadratic_type
from .embedded import same_rows

__all__ = ["middle_nodes", "middle_nodes_of_types", "middles_between", "with_middles"]

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
    (quadratic,), corners = middle_nodes_of_types([(HEXAHEDRON, cells)], count, nodes)
    return quadratic, corners


def middle_nodes_of_types(
    blocks: Sequence[tuple[CellType, Ints]], count: int, nodes: int
) -> tuple[list[Ints], list[Ints]]:
    """The same of cells (m, j) of several linear types, those beside hexahedra of 20 or 27 nodes.

    Examples
    --------
    >>> from hexconformal.elements import TETRAHEDRON
    >>> (cells,), corners = middle_nodes_of_types([(TETRAHEDRON, np.arange(4)[None])], 4, 20)
    >>> cells.shape, [len(one) for one in corners]
    ((1, 10), [6])
    """
    if not isinstance(nodes, int | np.integer) or nodes not in (20, 27):
        raise OptionError(f"nodes of a quadratic hexahedron must be 20 or 27, not {nodes!r}")
    tables, corners = [cells for _, cells in blocks], []
    for size in (2, 4, 8):
        members = [[one for one in between(quadratic_type(kind, nodes)) if len(one) == size] for kind, _ in blocks]
        if not any(members):
            continue
        ends = [
            cells[:, np.reshape(np.array(own, dtype=np.int64), (-1, size))]
            for (_, cells), own in zip(blocks, members, strict=True)
        ]
        every = np.concatenate([one.reshape(-1, size) for one in ends])
        distinct, inverse = np.unique(np.sort(every, axis=1), axis=0, return_inverse=True)
        parts = np.split(count + inverse.ravel(), np.cumsum([one.shape[0] * one.shape[1] for one in ends])[:-1])
        tables = [np.hstack([table, own.reshape(len(table), -1)]) for table, own in zip(tables, parts, strict=True)]
        corners.append(distinct)
        count += len(distinct)
    return tables, corners


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
