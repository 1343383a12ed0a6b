"""Algebraic multigrid for a scalar matrix whose rows are shared out: PETSc's GAMG (smoothed aggregation)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from .halo import Halo
from .mpi import petsc
from .routes import Routes

__all__ = ["AlgebraicMultigrid"]

Field = NDArray[np.float64]

_SHIFT = 1e-8  # relative; makes a matrix with a constant null space definite
_PREFIX = "hexconformal_"  # of options in PETSC_OPTIONS
_CLEAR = "mat_product_clear"


class AlgebraicMultigrid:
    """One symmetric V-cycle, a fixed positive definite approximate inverse; ghosts of its results are not to be used.

    Rows that are constrained take no part: their entries of the result are zero. Options of PETSc with the prefix
    ``hexconformal_`` apply to it.

    Parameters
    ----------
    halo
        The nodes here.
    matrix
        (n, n) what the cells here add to the matrix, in local places; its sum is symmetric positive semidefinite.
    free
        (n,) rows that take part.
    """

    def __init__(self, halo: Halo, matrix: scipy.sparse.csr_matrix, free: NDArray[np.bool_]) -> None:
        free = halo.update(np.array(free))
        own, comm = free[: halo.owned], halo.comm
        ends = np.concatenate([[0], np.cumsum(comm.allgather(int(own.sum())))])
        numbers = np.full(halo.count, -1, dtype=np.int64)
        numbers[: halo.owned][own] = np.arange(ends[comm.rank], ends[comm.rank + 1])
        self._rows, self._count = np.flatnonzero(own), halo.count
        self._cycle: Any = None
        if ends[-1] > 0:
            rows = _own_rows(halo, ends, halo.update(numbers), scipy.sparse.csr_matrix(matrix))
            self._set_up(comm, rows)

    def _set_up(self, comm: Any, rows: scipy.sparse.csr_matrix) -> None:
        PETSc, kind = petsc(), petsc().IntType
        sizes = ((rows.shape[0], None), (rows.shape[0], None))
        table = rows.indptr.astype(kind), rows.indices.astype(kind), rows.data
        self._matrix = PETSc.Mat().createAIJ(sizes, csr=table, comm=comm)
        self._matrix.setOption(PETSc.Mat.Option.SPD, True)
        self._cycle = PETSc.PC().create(comm)
        self._cycle.setOptionsPrefix(_PREFIX)
        self._cycle.setOperators(self._matrix)
        self._cycle.setType("gamg")
        self._cycle.setFromOptions()
        with _no_products_kept():
            self._cycle.setUp()
        self._residual, self._result = self._matrix.createVecs()

    def __call__(self, residual: Field, axes: Sequence[int] = (0, 1, 2)) -> Field:
        """Apply the cycle to some components of an (n, 3) field; the others of the result are zero."""
        out = np.zeros((self._count, 3))
        for axis in axes if self._cycle is not None else ():
            self._residual.array[:] = residual[self._rows, axis]
            self._cycle.apply(self._residual, self._result)
            out[self._rows, axis] = self._result.array_r
        return out


@contextmanager
def _no_products_kept() -> Iterator[None]:
    """Products of matrices in PETSc do not keep what makes the same again faster: a tenth of a run's memory."""
    options = petsc().Options()
    said = options.hasName(_CLEAR)
    if not said:
        options.setValue(_CLEAR, True)
    try:
        yield
    finally:
        if not said:
            options.delValue(_CLEAR)


def _own_rows(
    halo: Halo, ends: NDArray[np.int64], numbers: NDArray[np.int64], matrix: scipy.sparse.csr_matrix
) -> scipy.sparse.csr_matrix:
    """The free rows that this rank owns, with what others add to them; columns have their numbers of all ranks."""
    first, count, shape = int(ends[halo.comm.rank]), int(np.diff(ends)[halo.comm.rank]), int(ends[-1])
    # Nearly all entries stay here: only those in rows of others travel, as three numbers each.
    of_others = scipy.sparse.coo_matrix(matrix[halo.owned :])
    rows, columns = numbers[halo.owned :][of_others.row], numbers[of_others.col]
    kept = (rows >= 0) & (columns >= 0)
    routes = Routes(halo.comm, np.searchsorted(ends, rows[kept], side="right") - 1)
    rows, columns, values = (routes.forward(one[kept]) for one in (rows, columns, of_others.data))
    came = scipy.sparse.csr_matrix((values, (rows - first, columns)), shape=(count, shape))
    mine = matrix[np.flatnonzero(numbers[: halo.owned] >= 0)]
    there = numbers.astype(came.indices.dtype)[mine.indices]
    mine.data[there < 0] = 0.0
    mine = scipy.sparse.csr_matrix((mine.data, np.maximum(there, 0), mine.indptr), shape=(count, shape))
    mine.eliminate_zeros()
    mine.sort_indices()
    mine = scipy.sparse.csr_matrix(mine + came) if came.nnz else mine
    diagonal = mine.indices == np.repeat(
        np.arange(first, first + count, dtype=mine.indices.dtype), np.diff(mine.indptr)
    )
    mine.data[diagonal] *= 1.0 + _SHIFT
    return mine
