"""Some cells of a mesh that is shared out, with their nodes, brought together on one rank."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .rank_space import RankSpace
from .routes import gathered

__all__ = ["GatheredCells"]

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class GatheredCells:
    """Cells on rank 0; elsewhere there are none.

    Attributes
    ----------
    cells
        (m, 8) the cells, those of lower ranks first, by the places of their nodes among those that came.
    is_here
        True on rank 0.
    space
        The space of the mesh that they are of.
    chosen
        (m,) the own cells that went.
    numbers
        (n,) numbers of all ranks of the nodes that came, ascending.
    """

    cells: Ints
    is_here: bool
    space: RankSpace
    chosen: Mask
    numbers: Ints
    _nodes: Ints

    @classmethod
    def of(cls, space: RankSpace, cells: Ints, chosen: Mask) -> GatheredCells:
        """Bring together some (m,) of the own cells (m, 8) of all ranks; all must call it."""
        halo = space.halo
        used = np.zeros(halo.count, dtype=bool)
        used[cells[chosen]] = True
        nodes = np.flatnonzero(space.own(space.joined(used)))
        # Own nodes of ascending ranks have ascending numbers.
        numbers = gathered(halo.comm, halo.numbers[nodes])
        table = np.searchsorted(numbers, gathered(halo.comm, halo.numbers[cells[chosen]]))
        return cls(table, halo.comm.rank == 0, space, chosen, numbers, nodes)

    @property
    def count(self) -> int:
        """Number of nodes that came."""
        return len(self.numbers)

    def places(self, nodes: Ints) -> Ints:
        """Where nodes (k, ...) of this rank's own, or copies, are among those that came, on rank 0."""
        return np.searchsorted(self.numbers, gathered(self.space.halo.comm, self.space.halo.numbers[nodes]))

    def of_nodes(self, field: NDArray[Any]) -> NDArray[Any]:
        """The rows of a field (n, ...) at the nodes that came, on rank 0."""
        return gathered(self.space.halo.comm, field[self._nodes])

    def of_cells(self, values: NDArray[Any]) -> NDArray[Any]:
        """The rows of values (m, ...) on the cells that came, on rank 0."""
        return gathered(self.space.halo.comm, values[self.chosen])

    def spread(self, rows: NDArray[Any] | None, field: NDArray[Any]) -> NDArray[Any]:
        """A field (n, ...) with the rows that rank 0 has at the nodes that came."""
        comm = self.space.halo.comm
        counts = comm.gather(len(self._nodes))
        parts = None if rows is None else np.split(rows, np.cumsum(counts)[:-1])
        out = np.array(field)
        out[self._nodes] = comm.scatter(parts)
        return self.space.update(out)

    def spread_to_cells(self, values: NDArray[Any] | None, others: NDArray[Any]) -> NDArray[Any]:
        """Values (m, ...) on own cells: those that rank 0 has for the cells that came, and others."""
        comm, out = self.space.halo.comm, np.array(others)
        counts = comm.gather(int(self.chosen.sum()))
        parts = None if values is None else np.split(values, np.cumsum(counts)[:-1])
        out[self.chosen] = comm.scatter(parts)
        return out
