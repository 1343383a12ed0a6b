"""The space of fields on nodes that are shared out between ranks."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..mesh import Space
from .algebraic_multigrid import AlgebraicMultigrid
from .halo import Halo
from .mpi import mpi

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

    def own(self, field: Array) -> Array:
        """The rows of own nodes."""
        return field[: self.halo.owned]  # type: ignore[return-value]

    # ------------------------------------------------------------------------------ values of all ranks
    def total(self, value: float) -> float:
        """The sum of what every rank has."""
        return float(self._reduced(np.array([value], dtype=np.float64), mpi().SUM)[0])

    def everywhere(self, holds: bool) -> bool:
        """True where something holds on every rank."""
        return bool(self._reduced(np.array([holds], dtype=np.int32), mpi().MIN)[0])

    def least(self, values: Array) -> Array:
        """The least of what every rank has, number by number."""
        return self._reduced(values, mpi().MIN)

    def mean(self, values: NDArray[Any]) -> float:
        """Mean of the values of all ranks; NaN where there are none."""
        total, count = self._reduced(np.array([values.sum(), values.size], dtype=np.float64), mpi().SUM)
        return float(total / count) if count else float("nan")

    def median(self, values: Field) -> float:
        """Median of the values of all ranks; NaN where there are none."""
        count = int(self.total(len(values)))
        return float(self._ordered(values, [(count - 1) // 2, count // 2]).mean()) if count else float("nan")

    def percentiles(self, values: Field, shares: Sequence[float]) -> Field:
        """Those of the values of all ranks that shares of them, in per cent, do not exceed."""
        count = int(self.total(len(values)))
        return self._ordered(values, [max(int(np.ceil(count * (share / 100.0) - 1.0)), 0) for share in shares])

    def named(self, label: Any) -> Any:
        """A label that a rank has, where others have None; the first of several."""
        return next((one for one in self.halo.comm.allgather(label) if one is not None), None)

    def _reduced(self, values: Array, operation: Any) -> Array:
        out = np.empty_like(values)
        self.halo.comm.Allreduce(np.ascontiguousarray(values), out, operation)
        self.halo.traffic.reductions += 1
        return out

    def _ordered(self, values: Field, places: Sequence[int]) -> Field:
        """The values at places in the order of those of all ranks, found by halving the range of their bits."""
        keys = np.sort(_as_integers(values))
        wanted = np.asarray(places, dtype=np.int64) + 1
        low, high = (np.full(len(wanted), getattr(np.iinfo(np.int64), end)) for end in ("min", "max"))
        while (low < high).any():
            middle = (low >> 1) + (high >> 1) + (low & high & 1)
            enough = self._reduced(np.searchsorted(keys, middle, side="right"), mpi().SUM) >= wanted
            low, high = np.where(enough, low, middle + 1), np.where(enough, middle, high)
        return _as_numbers(low)

    # -------------------------------------------------------------------------------- fields on nodes
    def update(self, field: Array) -> Array:
        """The field with the owners' values at ghosts."""
        return self.halo.update(field)

    def add(self, field: Array) -> Array:
        """The field with what stands at ghosts added to their owners; ghosts are not to be used afterwards."""
        return self.halo.add(field)

    def joined(self, nodes: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """True at nodes where a rank says so."""
        counts: NDArray[np.int32] = self.add(nodes.astype(np.int32))
        return np.asarray(self.update(counts) > 0)


def _as_integers(values: Field) -> NDArray[np.int64]:
    """Integers in the order of numbers: their bits, those of negative ones the other way round."""
    bits = np.ascontiguousarray(values, dtype=np.float64).view(np.int64)
    return np.where(bits < 0, bits ^ np.iinfo(np.int64).max, bits)


def _as_numbers(keys: NDArray[np.int64]) -> Field:
    return np.where(keys < 0, keys ^ np.iinfo(np.int64).max, keys).view(np.float64)
