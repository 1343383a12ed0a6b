"""Algebraic multigrid for a scalar matrix whose rows are shared out: PETSc's GAMG (smoothed aggregation)."""

from __future__ import annotations

from collections.abc import Sequence
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
            rows = _own_rows(comm, ends, halo.update(numbers), scipy.sparse.coo_matrix(matrix))
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


def _own_rows(
    comm: Any, ends: NDArray[np.int64], numbers: NDArray[np.int64], matrix: scipy.sparse.coo_matrix
) -> scipy.sparse.csr_matrix:
    """The free rows that this rank owns, with what others add to them; columns have their numbers of all ranks."""
    rows, columns = numbers[matrix.row], numbers[matrix.col]
    kept = (rows >= 0) & (columns >= 0)
    routes = Routes(comm, np.searchsorted(ends, rows[kept], side="right") - 1)
    here = [routes.forward(values[kept]) for values in (rows, columns, matrix.data)]
    count = int(ends[comm.rank + 1] - ends[comm.rank])
    entries = here[2], (here[0] - ends[comm.rank], here[1])
    summed = scipy.sparse.coo_matrix(entries, shape=(count, int(ends[-1]))).tocsr()
    summed.sum_duplicates()
    first = int(ends[comm.rank])
    diagonal = np.arange(count), np.arange(first, first + count)
    found = summed.diagonal(first) if count else np.empty(0)
    shift = scipy.sparse.coo_matrix((_SHIFT * found, diagonal), shape=summed.shape)
    return scipy.sparse.csr_matrix(summed + shift.tocsr())
