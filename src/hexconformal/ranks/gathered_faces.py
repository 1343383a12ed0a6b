"""The kept faces of a mesh that is shared out, with the cells at them, brought together on one rank."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..mesh import Regions
from .gathered_cells import GatheredCells
from .mesh_piece import MeshPiece
from .normalized_piece import NormalizedPiece, PartOfMesh
from .routes import gathered

__all__ = ["GatheredFaces"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


class CellsAtFaces(PartOfMesh):
    """The cells at kept faces of a mesh, as a normalized mesh: the other faces of these cells are no boundary."""

    def __init__(
        self,
        whole: NormalizedPiece,
        piece: MeshPiece,
        normalized: Field,
        skin: tuple[Ints, Ints],
        regions: Regions | None,
    ) -> None:
        self.mesh, self.known_regions = piece, regions
        self.node_ids, self.cell_ids = np.arange(len(piece.points)), np.arange(len(piece.cells))
        self.cells, self.points, self.unit = piece.cells.copy(), normalized, whole.unit
        self.referenced = np.ones(len(piece.points), dtype=bool)
        self._corner, self._diagonal = whole.corner, whole.diagonal
        self.__dict__["skin"] = skin


@dataclass(frozen=True, eq=False)
class GatheredFaces:
    """The kept faces of a mesh with the cells at them, on rank 0: of the size of surfaces, not of the mesh.

    Attributes
    ----------
    layer
        The cells as a mesh; None on other ranks.
    cells
        The cells, and where they come from.
    """

    layer: CellsAtFaces | None
    cells: GatheredCells

    @classmethod
    def of(cls, normalized: NormalizedPiece, others: NDArray[np.bool_] | None = None) -> GatheredFaces:
        """Bring together the cells at kept faces, and others (m,), if any; all ranks must call it."""
        space, (quads, owners) = normalized.space, normalized.skin
        at_faces = normalized.cells_at_faces()
        at_faces |= False if others is None else others
        found = GatheredCells.of(space, normalized.cells, at_faces)
        # Owners by their places among the cells that are brought together.
        first = space.halo.comm.exscan(int(at_faces.sum())) or 0
        skin = found.places(quads), gathered(space.halo.comm, first + (np.cumsum(at_faces) - 1)[owners])
        regions = normalized.known_regions
        if regions is not None:
            regions = replace(regions, labels=found.of_cells(regions.labels))
        points, node_ids = (found.of_nodes(one) for one in (normalized.mesh.points, normalized.mesh.node_ids))
        places, cell_ids = found.of_nodes(normalized.points), found.of_cells(normalized.mesh.cell_ids)
        if not found.is_here:
            return cls(None, found)
        piece = MeshPiece(points, found.cells, node_ids=node_ids, cell_ids=cell_ids)
        return cls(CellsAtFaces(normalized, piece, places, skin, regions), found)
