"""Nodes of each rank and copies of others' beside them: what is exchanged, and between which ranks."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .mpi import mpi
from .routes import Routes

__all__ = ["Halo", "Traffic"]

Ints = NDArray[np.int64]
Array = TypeVar("Array", bound=NDArray[Any])

_VALUES, _SUMS = 7, 8  # tags of messages


@dataclass
class Traffic:
    """What a rank has exchanged: bytes and messages that it sent, reductions over all ranks, CPU seconds of both."""

    bytes: int = 0
    messages: int = 0
    reductions: int = 0
    seconds: float = 0.0


class Halo:
    """Fields laid out [own | ghosts]: own nodes by their global numbers, then copies of others', ascending.

    Parameters
    ----------
    comm
        The ranks.
    ranges
        (p + 1,) first number of each rank; a rank's nodes have consecutive numbers.
    ghosts
        (g,) numbers of nodes of other ranks that this one has copies of, ascending.

    Attributes
    ----------
    owned, count
        Number of own nodes, and of all here.
    traffic
        What was exchanged so far.
    """

    def __init__(self, comm: Any, ranges: Ints, ghosts: Ints) -> None:
        self.comm, self.ranges, self.ghosts, self.traffic = comm, ranges, ghosts, Traffic()
        self.first, end = int(ranges[comm.rank]), int(ranges[comm.rank + 1])
        self.owned, self.count = end - self.first, end - self.first + len(ghosts)
        owners = self.owners(ghosts)
        cuts = np.searchsorted(owners, np.arange(comm.size + 1)) + self.owned
        self._ghosts_of = [(rank, slice(cuts[rank], cuts[rank + 1])) for rank in np.unique(owners).tolist()]
        routes = Routes(comm, owners)
        asked = routes.forward(ghosts) - self.first
        by = routes.forward(np.full(len(ghosts), comm.rank))
        self._copied_by = [(rank, asked[by == rank]) for rank in np.unique(by).tolist()]

    @property
    def numbers(self) -> Ints:
        """(count,) global numbers of all nodes here."""
        return np.concatenate([np.arange(self.first, self.first + self.owned), self.ghosts])

    def owners(self, numbers: Ints) -> Ints:
        """Ranks that own nodes."""
        return np.searchsorted(self.ranges, numbers, side="right") - 1

    def local(self, numbers: Ints) -> Ints:
        """Places here of nodes (...) that are here."""
        own = (numbers >= self.first) & (numbers < self.first + self.owned)
        return np.where(own, numbers - self.first, self.owned + np.searchsorted(self.ghosts, numbers))

    def update(self, field: Array) -> Array:
        """The field (count, ...) with the owners' values at ghosts, in place where that can be."""
        field = np.require(field, requirements=["C", "W"])  # type: ignore[assignment]
        requests = [self.comm.Irecv(self._message(field[part]), rank, _VALUES) for rank, part in self._ghosts_of]
        parts = [(rank, field[nodes]) for rank, nodes in self._copied_by]
        requests += [self._send(part, rank, _VALUES) for rank, part in parts]
        self._wait(requests)
        return field

    def add(self, field: Array, joined: Callable[[Any, Any], Any] = np.add) -> Array:
        """The field (count, ...) with what stands at ghosts added to their owners, in place where that can be.

        It may be joined with what these have in another way.
        """
        field = np.require(field, requirements=["C", "W"])  # type: ignore[assignment]
        parts = [(nodes, np.empty((len(nodes), *field.shape[1:]), field.dtype)) for _, nodes in self._copied_by]
        requests = [
            self.comm.Irecv(self._message(part), rank, _SUMS)
            for (rank, _), (_, part) in zip(self._copied_by, parts, strict=True)
        ]
        requests += [self._send(field[part], rank, _SUMS) for rank, part in self._ghosts_of]
        self._wait(requests)
        for nodes, part in parts:  # lower ranks first: the same bits every time
            field[nodes] = joined(field[nodes], part)
        return field

    def _send(self, part: NDArray[Any], rank: int, tag: int) -> Any:
        self.traffic.bytes, self.traffic.messages = self.traffic.bytes + part.nbytes, self.traffic.messages + 1
        return self.comm.Isend(self._message(part), rank, tag)

    def _wait(self, requests: list[Any]) -> None:
        began = time.thread_time()
        mpi().Request.Waitall(requests)
        self.traffic.seconds += time.thread_time() - began

    @staticmethod
    def _message(part: NDArray[Any]) -> list[Any]:
        return [part, mpi().BYTE]
