"""Sparse symmetric matrices of 3 x 3 blocks on the graph of a mesh, and where cells add to them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..elements import FACES
from ..kernel import CellChunks, loop, parallel_ranges
from ..mesh import binary_search, corner_incidences, node_pattern

__all__ = ["Assembly", "BlockMatrix", "Places", "block_places"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Places = NDArray[np.int32]  # half of the memory; more blocks than these can count no memory holds


@loop
def _places(first, last, cells, free, indptr, indices, places):  # type: ignore[no-untyped-def]
    for c in range(first, last):
        for a in range(8):
            for b in range(a + 1):
                row, column = max(cells[c, a], cells[c, b]), min(cells[c, a], cells[c, b])
                place = -1
                if free[row]:
                    place = binary_search(indices, indptr[row], indptr[row + 1], column)
                    # Held columns have no block, nor may the ends of a diagonal of the whole cell, which share no face.
                    place = place if indices[place] == column else -1
                places[c, a * (a + 1) // 2 + b] = place


def block_places(cells: Ints, free: NDArray[np.bool_], matrix: BlockMatrix) -> Places:
    """Places (m, 36) in the matrix of the blocks of the pairs a >= b of every cell's nodes; -1 for none."""
    places = np.empty((len(cells), 36), np.int32)
    parallel_ranges(_places, len(cells), cells, free, matrix.indptr, matrix.indices, places)
    return places


@dataclass
class BlockMatrix:
    """A symmetric matrix of 3 x 3 blocks: the lower triangle in compressed rows, the diagonal last in each.

    Attributes
    ----------
    indptr, indices
        (n + 1,) and (nnz,) pattern, columns ascending and not above the row; rows of held nodes are empty.
    data
        (nnz, 3, 3) blocks; fill them, then solve.
    """

    indptr: Ints
    indices: NDArray[np.int32]
    data: Field = field(init=False)

    def __post_init__(self) -> None:
        self.data = np.zeros((len(self.indices), 3, 3))

    @classmethod
    def of_cells(cls, cells: Ints, free: NDArray[np.bool_], diagonals: bool = False) -> BlockMatrix:
        """An empty matrix that joins free nodes (n,) on a common face, or, with diagonals, of a common cell."""
        joined = cells if diagonals else np.ascontiguousarray(cells[:, FACES].reshape(-1, 4))
        indptr, indices = node_pattern(joined, *corner_incidences(joined, len(free)))
        rows = np.repeat(np.arange(len(free)), np.diff(indptr))
        kept = (indices <= rows) & free[indices] & free[rows]
        indptr = np.concatenate([[0], np.cumsum(np.bincount(rows[kept], minlength=len(free)))])
        return cls(indptr, indices[kept])


@dataclass(frozen=True, eq=False)
class Assembly:
    """Where terms add their convex blocks.

    Attributes
    ----------
    matrix
        Sum of the blocks.
    places
        (m, 36) places in it of the pairs of nodes of every cell, see :func:`block_places`.
    chunks
        The cells in chunks that threads may add at once.
    """

    matrix: BlockMatrix
    places: Places
    chunks: CellChunks

    @classmethod
    def of_cells(cls, cells: Ints, free: NDArray[np.bool_], diagonals: bool = False) -> Assembly:
        """An empty assembly for cells (m, 8); see :meth:`BlockMatrix.of_cells`."""
        matrix = BlockMatrix.of_cells(cells, free, diagonals)
        return cls(matrix, block_places(cells, free, matrix), CellChunks.of(cells, len(free)))

    def clear(self) -> None:
        """Set all blocks to zero."""
        data = self.matrix.data.reshape(-1)
        parallel_ranges(_clear, len(data), data, smallest=1 << 20)


@loop
def _clear(first, last, data):  # type: ignore[no-untyped-def]
    for k in range(first, last):
        data[k] = 0.0
