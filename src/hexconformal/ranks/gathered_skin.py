"""The boundary of a mesh that is shared out, with the cells at it, brought together on one rank."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh import HexMesh, NormalizedMesh
from .halo import Halo
from .normalized_piece import NormalizedPiece
from .routes import gathered

__all__ = ["GatheredSkin"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


class SkinLayer(NormalizedMesh):
    """The cells at the boundary of a mesh, as a normalized mesh: the other faces of these cells are no boundary."""

    def __init__(
        self, whole: NormalizedPiece, points: Field, normalized: Field, cells: Ints, skin: tuple[Ints, Ints]
    ) -> None:
        self.mesh = HexMesh(points, cells)
        self.node_ids, self.cell_ids = np.arange(len(points)), np.arange(len(cells))
        self.cells, self.points, self.unit = cells, normalized, whole.unit
        self.referenced = np.ones(len(points), dtype=bool)
        self._corner, self._diagonal = whole.corner, whole.diagonal
        self.__dict__["skin"] = skin

    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box of the whole mesh."""
        return self._diagonal


@dataclass(frozen=True, eq=False)
class GatheredSkin:
    """The boundary of a mesh with the cells at it, on rank 0: of the size of the surface, not of the mesh.

    Attributes
    ----------
    layer
        The cells as a mesh; None on other ranks.
    """

    layer: SkinLayer | None
    _halo: Halo
    _here: Ints
    _order: Ints

    @classmethod
    def of(cls, normalized: NormalizedPiece) -> GatheredSkin:
        """Bring together the boundary of a mesh; all ranks must call it."""
        space, halo = normalized.space, normalized.space.halo
        on = np.zeros(halo.count, dtype=bool)
        on[normalized.quads] = True
        at_skin = space.joined(on)[normalized.cells].any(axis=1)
        near = normalized.cells[at_skin]
        used = np.zeros(halo.count, dtype=bool)
        used[near] = True
        here = np.flatnonzero(space.own(space.joined(used)))
        comm, numbers = halo.comm, halo.numbers
        nodes, cells, quads = (gathered(comm, numbers[some]) for some in (here, near, normalized.quads))
        # Owners by their places among the cells that are brought together.
        first = comm.exscan(len(near)) or 0
        owners = gathered(comm, first + (np.cumsum(at_skin) - 1)[normalized.skin[1]])
        points, places = (gathered(comm, some[here]) for some in (normalized.points, normalized.mesh.points))
        layer = None
        if comm.rank == 0:
            # Own nodes of ascending ranks have ascending numbers.
            skin = np.searchsorted(nodes, quads), owners
            layer = SkinLayer(normalized, places, points, np.searchsorted(nodes, cells), skin)
        return cls(layer, halo, here, nodes)

    def gathered(self, field: NDArray[Any]) -> NDArray[Any]:
        """The rows of a field (n, ...) at the nodes of the layer, on rank 0."""
        return gathered(self._halo.comm, field[self._here])

    def spread(self, rows: NDArray[Any] | None, default: NDArray[Any]) -> NDArray[Any]:
        """What rank 0 has at the nodes of the layer (l, ...), as a field (n, ...) that is the default elsewhere."""
        comm = self._halo.comm
        counts = comm.gather(len(self._here))
        parts = None if rows is None else np.split(rows, np.cumsum(counts)[:-1])
        out = np.tile(default, (self._halo.count, *[1] * default.ndim))
        out[self._here] = comm.scatter(parts)
        return self._halo.update(out)
