"""The boundary of a mesh that is shared out, with the cells at it, brought together on one rank."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mesh import HexMesh, NormalizedMesh
from .gathered_cells import GatheredCells
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
    gathered
        The cells.
    """

    layer: SkinLayer | None
    gathered: GatheredCells

    @classmethod
    def of(cls, normalized: NormalizedPiece) -> GatheredSkin:
        """Bring together the boundary of a mesh; all ranks must call it."""
        space, (quads, owners) = normalized.space, normalized.skin
        on = np.zeros(space.halo.count, dtype=bool)
        on[quads] = True
        at_skin = np.asarray(space.joined(on)[normalized.cells].any(axis=1))
        found = GatheredCells.of(space, normalized.cells, at_skin)
        # Owners by their places among the cells that are brought together.
        first = space.halo.comm.exscan(int(at_skin.sum())) or 0
        skin = found.places(quads), gathered(space.halo.comm, first + (np.cumsum(at_skin) - 1)[owners])
        points, places = found.of_nodes(normalized.mesh.points), found.of_nodes(normalized.points)
        layer = SkinLayer(normalized, points, places, found.cells, skin) if found.is_here else None
        return cls(layer, found)
