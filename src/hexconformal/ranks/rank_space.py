"""The space of fields on nodes that are shared out between ranks."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..mesh import Space
from .algebraic_multigrid import AlgebraicMultigrid
from .halo import Halo
from .mpi import mpi
from .routes import Routes

__all__ = ["RankSpace"]

Field = NDArray[np.float64]
Array = TypeVar("Array", bound=NDArray[Any])


class RankSpace(Space):
    """Fields (n, 3) laid out [own | ghosts]; values of cells are those of own ones.

    All ranks must ask for the same things in the same order. What they get is the same for all, to the last bit, as MPI
    promises of reductions.

    Parameters
    ----------
    halo
        The nodes here.
    """

    def __init__(self, halo: Halo) -> None:
        self.halo = halo
        self.hierarchy = partial(AlgebraicMultigrid, halo)

    @classmethod
    def of_cells(cls, comm: Any) -> RankSpace:
        """The space of values on cells, each of which one rank has; there are no nodes."""
        return cls(Halo(comm, np.zeros(comm.size + 1, dtype=np.int64), np.empty(0, dtype=np.int64)))

    @property
    def is_shared(self) -> bool:
        """They are, even if one rank has all of them."""
        return True

    def own(self, field: Array) -> Array:
        """The rows of own nodes."""
        return field[: self.halo.owned]  # type: ignore[return-value]

    # ------------------------------------------------------------------------------ values of all ranks
    def total(self, value: float) -> float:
        """The sum of what every rank has."""
        return float(self.totals(np.array([value], dtype=np.float64))[0])

    def totals(self, values: Array) -> Array:
        """The sums of what every rank has, number by number."""
        return self._reduced(values, mpi().SUM)

    def everywhere(self, holds: bool) -> bool:
        """True where something holds on every rank."""
        return bool(self._reduced(np.array([holds], dtype=np.int32), mpi().MIN)[0])

    def least(self, values: Array) -> Array:
        """The least of what every rank has, number by number."""
        return self._reduced(values, mpi().MIN)

    def means(self, rows: NDArray[Any]) -> Field:
        """Mean of each of some rows (k, m) of values of all ranks; NaN where there are none."""
        *sums, count = self.totals(np.append(rows.sum(axis=1), rows.shape[1]).astype(np.float64))
        return np.array(sums) / count if count else np.full(len(sums), np.nan)

    def median(self, values: Field) -> float:
        """Median of the values of all ranks; NaN where there are none."""
        count = int(self.total(len(values)))
        return float(self._ordered(values[None], [(count - 1) // 2, count // 2]).mean()) if count else float("nan")

    def percentiles(self, rows: Field, shares: Sequence[float]) -> Field:
        """Those of the values of all ranks, in each of some rows, that shares of them, in per cent, do not exceed."""
        count = int(self.total(rows.shape[1]))
        return self._ordered(rows, [max(int(np.ceil(count * (share / 100.0) - 1.0)), 0) for share in shares])

    def distinct(self, values: NDArray[Any], most: float = np.inf) -> NDArray[Any] | None:
        """The different values of all ranks, ascending; None where there are more than so many, which no rank gets."""
        comm, own = self.halo.comm, np.unique(values)
        # Equal values meet on one rank, which counts them once.
        with np.errstate(invalid="ignore"):
            homes = own.astype(np.int64) % comm.size
        met = np.unique(Routes(comm, homes).forward(own))
        if self.total(len(met)) > most:
            return None
        return np.unique(np.concatenate(comm.allgather(met)))

    def at_smallest(self, values: Field, marks: NDArray[np.bool_]) -> bool:
        """The mark (k,) at the smallest of the values (k,) of all ranks, the first where there are several."""
        place = int(values.argmin()) if len(values) else None
        own = None if place is None or values[place] > self.smallest(values) else bool(marks[place])
        return bool(self.named(own))

    def named(self, label: Any) -> Any:
        """A label that a rank has, where others have None; the first of several."""
        return next((one for one in self.halo.comm.allgather(label) if one is not None), None)

    def _reduced(self, values: Array, operation: Any) -> Array:
        out, began, traffic = np.empty_like(values), time.thread_time(), self.halo.traffic
        self.halo.comm.Allreduce(np.ascontiguousarray(values), out, operation)
        traffic.reductions, traffic.seconds = traffic.reductions + 1, traffic.seconds + time.thread_time() - began
        return out

    def _ordered(self, rows: Field, places: Sequence[int]) -> Field:
        """The values of each row (k, m) at places (p,) in the order of those of all ranks, (k, p).

        Four bits of all of them at once are found in one exchange, the highest first.
        """
        keys = np.sort(_as_integers(rows), axis=1)
        wanted = np.asarray(places, dtype=np.int64) + 1
        found = np.zeros((len(rows), len(wanted)), dtype=np.uint64)
        for shift in range(60, -1, -4):
            ends = found[..., None] + (np.arange(1, 17, dtype=np.uint64) << np.uint64(shift)) - np.uint64(1)
            pairs = zip(keys, ends, strict=True)
            counts = np.array([np.searchsorted(row, end.ravel(), side="right") for row, end in pairs])
            enough = self.totals(counts.reshape(ends.shape)) >= wanted[:, None]
            found += enough.argmax(axis=2).astype(np.uint64) << np.uint64(shift)
        return _as_numbers(found)

    # -------------------------------------------------------------------------------- fields on nodes
    def update(self, field: Array) -> Array:
        """The field with the owners' values at ghosts."""
        return self.halo.update(field)

    def add(self, field: Array) -> Array:
        """The field with what stands at ghosts added to their owners; ghosts are not to be used afterwards."""
        return self.halo.add(field)

    def least_at_nodes(self, field: Array) -> Array:
        """The least of what ranks have at every node."""
        return self.update(self.halo.add(field, np.minimum))

    def joined(self, nodes: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """True at nodes where a rank says so."""
        counts: NDArray[np.int32] = self.add(nodes.astype(np.int32))
        return np.asarray(self.update(counts) > 0)


_SIGN = np.uint64(1 << 63)


def _as_integers(values: Field) -> NDArray[np.uint64]:
    """Integers in the order of numbers: their bits, all of them turned where the number is negative."""
    bits = np.ascontiguousarray(values, dtype=np.float64).view(np.uint64)
    return np.where(bits & _SIGN, ~bits, bits | _SIGN)


def _as_numbers(keys: NDArray[np.uint64]) -> Field:
    return np.where(keys & _SIGN, keys & ~_SIGN, ~keys).view(np.float64)
