"""Rows of arrays on their way between ranks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError, agreed, first_ids
from .mpi import mpi

__all__ = ["Routes", "dealt", "each_once", "gathered", "homes_of", "rows_by_id", "rows_of_copies"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


class Routes:
    """The ways of rows from each rank to others, and back.

    Parameters
    ----------
    comm
        The ranks.
    ranks
        (k,) the rank that each row goes to.

    Attributes
    ----------
    count
        Number of rows that come here.
    """

    def __init__(self, comm: Any, ranks: Ints) -> None:
        self._comm, self._order = comm, np.argsort(ranks, kind="stable")
        self._sent = np.bincount(ranks, minlength=comm.size).astype(np.int64)
        self._received = np.empty_like(self._sent)
        comm.Alltoall(self._sent, self._received)
        self.count = int(self._received.sum())

    def forward(self, rows: NDArray[Any]) -> NDArray[Any]:
        """What comes here of rows (k, ...), those of lower ranks first, each rank's in its order."""
        return self._exchange(rows[self._order], self._sent, self._received)

    def backward(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Rows (count, ...), one for each that came, at the places (k,) of those that went."""
        back = self._exchange(rows, self._received, self._sent)
        out = np.empty_like(back)
        out[self._order] = back
        return out

    def _exchange(self, rows: NDArray[Any], sent: Ints, received: Ints) -> NDArray[Any]:
        rows = np.ascontiguousarray(rows)
        out = np.empty((int(received.sum()), *rows.shape[1:]), rows.dtype)
        # A row is one datum, so that counts stay within 32 bits.
        kind = mpi().BYTE.Create_contiguous(rows.dtype.itemsize * int(np.prod(rows.shape[1:], dtype=np.int64)))
        kind.Commit()
        ends = [np.concatenate([[0], np.cumsum(counts)[:-1]]) for counts in (sent, received)]
        self._comm.Alltoallv([rows, sent, ends[0], kind], [out, received, ends[1], kind])
        kind.Free()
        return out


def dealt(comm: Any, ranks: Ints | None, rows: Mapping[str, NDArray[Any]] | None) -> dict[str, NDArray[Any]]:
    """Rows (k, ...) of several arrays that rank 0 has, each on the rank (k,) that it is for; others have None."""
    kinds = comm.bcast(None if rows is None else {key: (one.dtype.str, one.shape[1:]) for key, one in rows.items()})
    if rows is None or ranks is None:
        ranks, rows = np.empty(0, np.int64), {key: np.empty((0, *shape), kind) for key, (kind, shape) in kinds.items()}
    routes = Routes(comm, ranks)
    return {key: routes.forward(one) for key, one in rows.items()}


def homes_of(comm: Any, ids: Ints) -> Ints:
    """The rank (k,) at which what is known of each id comes together."""
    count = comm.allreduce(int(ids.max(initial=-1)), mpi().MAX) + 1
    return np.asarray(ids // max(-(-count // comm.size), 1))


def each_once(comm: Any, ids: Ints, rows: NDArray[Any]) -> tuple[Ints, NDArray[Any]]:
    """Ids, and rows (k, ...) of them, of all ranks, each once, on the rank that is its home; copies are the same."""
    routes = Routes(comm, homes_of(comm, ids))
    known, first = np.unique(routes.forward(ids), return_index=True)
    return known, routes.forward(rows)[first]


def rows_by_id(comm: Any, wanted: Ints, ids: Ints, rows: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Rows (w, ...) of wanted ids (w,), wherever they are among those (k, ...) of all ranks, and which there are.

    Where `comm` is None they are in one process.
    """
    if comm is None:
        return _found(wanted, ids, rows)
    homes = homes_of(comm, np.concatenate([wanted, ids]))
    there, here = Routes(comm, homes[len(wanted) :]), Routes(comm, homes[: len(wanted)])
    answers, found = _found(here.forward(wanted), there.forward(ids), there.forward(rows))
    return here.backward(answers), here.backward(found)


def _found(asked: Ints, ids: Ints, rows: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    known, first = np.unique(ids, return_index=True)
    place = np.searchsorted(known, asked)
    found = place < len(known)
    found[found] = known[place[found]] == asked[found]
    answers = np.zeros((len(asked), *rows.shape[1:]), rows.dtype)
    answers[found] = rows[first[place[found]]]
    return answers, found


def rows_of_copies(comm: Any, wanted: Ints, ids: Ints, rows: Field, problem: str) -> tuple[Field, NDArray[np.bool_]]:
    """The same of rows that must be alike wherever an id is several times; NaN is like NaN.

    Raises
    ------
    OptionError
        If they are not: the problem in words, and ids.
    """
    one_of_each = rows_by_id(comm, ids, ids, rows)[0]
    with agreed(comm):
        apart = ((one_of_each != rows) & ~(np.isnan(one_of_each) & np.isnan(rows))).any(axis=1)
        if apart.any():
            where = "" if comm is None else " on all ranks"
            raise OptionError(f"{problem}{where}: {first_ids(np.unique(ids[apart]))}")
    return rows_by_id(comm, wanted, ids, rows)


def gathered(comm: Any, rows: NDArray[Any]) -> NDArray[Any]:
    """The rows of all ranks on rank 0, those of lower ranks first; none on others."""
    routes = Routes(comm, np.zeros(len(rows), dtype=np.int64))
    return routes.forward(rows)
