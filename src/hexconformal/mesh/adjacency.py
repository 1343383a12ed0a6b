"""Incidences of nodes and cells, and scalar sparse matrices on their graph."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from ..kernel import algebra, loop, parallel_ranges

__all__ = ["binary_search", "corner_incidences", "node_pattern", "scalar_matrix"]


def corner_incidences(cells: NDArray[np.int64], count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Corners at every node.

    Parameters
    ----------
    cells
        (m, k) nodes of the cells.
    count
        Number of nodes n.

    Returns
    -------
    (n + 1,) offsets and (k m,) flat corner numbers ``k * cell + corner``, grouped by node, ascending.

    Examples
    --------
    >>> corner_incidences(np.array([[0, 1], [1, 2]]), 3)
    (array([0, 1, 3, 4]), array([0, 1, 2, 3]))
    """
    m, k = cells.shape
    table = scipy.sparse.csr_matrix(
        (np.arange(m * k), cells.ravel(), np.arange(0, m * k + 1, k, dtype=np.int64)), shape=(m, count)
    ).tocsc()
    return table.indptr.astype(np.int64), np.ascontiguousarray(table.data, dtype=np.int64)


@algebra
def binary_search(indices, first, last, value):  # type: ignore[no-untyped-def]
    """Place of a value in the sorted range ``indices[first:last]`` that holds it."""
    while last - first > 1:
        middle = (first + last) // 2
        if indices[middle] <= value:
            first = middle
        else:
            last = middle
    return first


@loop
def _rows(first, last, cells, offsets, incidences, most, indptr, indices):  # type: ignore[no-untyped-def]
    """Sorted neighbours of each node; only their number (into indptr) while indices is empty."""
    width = cells.shape[1]
    row = np.empty(most, np.int64)
    for node in range(first, last):
        length = 0
        for k in range(offsets[node], offsets[node + 1]):
            for corner in range(width):
                other = cells[incidences[k] // width, corner]
                place = length
                while place > 0 and row[place - 1] > other:
                    place -= 1
                if place > 0 and row[place - 1] == other:
                    continue
                for i in range(length, place, -1):
                    row[i] = row[i - 1]
                row[place] = other
                length += 1
        if len(indices) == 0:
            indptr[node + 1] = length
        else:
            for i in range(length):
                indices[indptr[node] + i] = row[i]


def node_pattern(
    cells: NDArray[np.int64], offsets: NDArray[np.int64], incidences: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Compressed rows (indptr, indices) of the graph that joins the nodes of every cell."""
    count = len(offsets) - 1
    most = cells.shape[1] * (int(np.diff(offsets).max(initial=0)) + 1)
    indptr = np.zeros(count + 1, np.int64)
    parallel_ranges(_rows, count, cells, offsets, incidences, most, indptr, np.empty(0, np.int32))
    indptr = np.cumsum(indptr)
    indices = np.empty(indptr[-1], np.int32)
    parallel_ranges(_rows, count, cells, offsets, incidences, most, indptr, indices)
    return indptr, indices


@loop
def _scalar_rows(first, last, cells, matrices, kinds, scales, offsets, incidences, indptr, indices, data):  # type: ignore[no-untyped-def]
    width = cells.shape[1]
    for node in range(first, last):
        for k in range(indptr[node], indptr[node + 1]):
            data[k] = 0.0
        for k in range(offsets[node], offsets[node + 1]):
            c, corner = incidences[k] // width, incidences[k] % width
            scale, shape = scales[c % len(scales)], kinds[c]
            for a in range(width):
                place = binary_search(indices, indptr[node], indptr[node + 1], cells[c, a])
                data[place] += scale * matrices[shape, corner, a]


def scalar_matrix(
    cells: NDArray[np.int64],
    matrices: NDArray[np.float64],
    kinds: NDArray[np.int64],
    scales: NDArray[np.float64],
    offsets: NDArray[np.int64],
    incidences: NDArray[np.int64],
    pattern: tuple[NDArray[np.int64], NDArray[np.int32]],
) -> scipy.sparse.csr_matrix:
    """Assemble cell matrices into a compressed-row matrix.

    Parameters
    ----------
    cells
        (m, k) nodes of the cells.
    matrices
        (t, k, k) cell matrices.
    kinds
        (m,) which of them each cell has.
    scales
        (m,) or (1,) factor of each cell.
    offsets, incidences
        From :func:`corner_incidences`.
    pattern
        From :func:`node_pattern`.
    """
    indptr, indices = pattern
    count = len(indptr) - 1
    data = np.empty(len(indices))
    parallel_ranges(_scalar_rows, count, cells, matrices, kinds, scales, offsets, incidences, indptr, indices, data)
    index_type = np.int32 if indptr[-1] < 2**31 else np.int64
    return scipy.sparse.csr_matrix(
        (data, indices.astype(index_type, copy=False), indptr.astype(index_type)), shape=(count, count)
    )
