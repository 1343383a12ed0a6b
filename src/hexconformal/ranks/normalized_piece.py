"""A mesh that is shared out in a unit and origin of its own, so that a run does not depend on those of the input."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError
from ..elements import cell_volumes, edge_lengths
from ..mesh import Interfaces, NormalizedMesh, Regions, surfaces_around
from .distribution import Distribution
from .kept_faces import FacesBeside, KeptFaces
from .mesh_piece import MeshPiece
from .rank_space import RankSpace

__all__ = ["NormalizedPiece", "PartOfMesh"]


class PartOfMesh(NormalizedMesh):
    """Cells of a normalized mesh whose regions and bounding box are those of the whole.

    Attributes
    ----------
    known_regions
        The regions as they were found when the mesh was shared out, with the labels of these cells.
    """

    known_regions: Regions | None
    _diagonal: float

    def regions(self, interfaces: Any) -> Regions | None:
        """Those of the whole mesh; None where they are to be ignored."""
        return None if isinstance(interfaces, str) and interfaces == "ignore" else self.known_regions

    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box of the whole mesh, normalized."""
        return self._diagonal


class NormalizedPiece(PartOfMesh):
    """What one rank has of a mesh translated and scaled to a mean edge length of one.

    Nodes and cells have the order of the distribution, which is that of where they are.

    Parameters
    ----------
    distribution
        The mesh.

    Attributes
    ----------
    mesh
        The piece that the distribution made of it.
    space
        Where fields on its nodes live.
    faces, beside
        Kept faces of own cells, and those of other ranks around them.

    Raises
    ------
    MeshError
        If most cells have negative volume, or all edges have no length.
    """

    mesh: MeshPiece
    space: RankSpace
    faces: KeptFaces
    beside: FacesBeside

    def __init__(self, distribution: Distribution) -> None:
        piece, self.space, self.beside = distribution.piece, distribution.space, distribution.beside
        self.mesh, self.referenced = piece, distribution.referenced
        self.faces, self.known_regions = distribution.faces, distribution.regions
        self.__dict__["skin"] = self.faces.skin, self.faces.owners  # of own cells those on that of the whole mesh
        self.node_ids, self.cell_ids = np.arange(len(piece.points)), np.arange(len(piece.cells))
        self.cells = piece.cells.copy()
        used = piece.points[self.referenced]
        self._corner = self.space.least(used.min(axis=0, initial=np.inf))
        extent = -self.space.least(-used.max(axis=0, initial=-np.inf)) - self._corner
        self.unit = self.space.mean(edge_lengths(piece.points - self._corner, self.cells))
        if self.unit == 0.0:
            raise MeshError("cells must have a size: all their edges have no length")
        self.points = (piece.points - self._corner) / self.unit
        self._diagonal = float(np.linalg.norm(extent)) / self.unit
        negative = self.space.mean(cell_volumes(self.points, self.cells) < 0.0)
        if negative > 0.5:
            raise MeshError(
                f"cells with negative volume: {negative:.0%}; the mesh is mirrored or its nodes are in a foreign "
                "order: hexconformal.orient(mesh) puts them right"
            )

    def surfaces_of(self, regions: Regions) -> list[NDArray[np.int64]]:
        """What this rank has of the closed surface of every region."""
        skin, owners = self.skin
        return surfaces_around(skin, regions.labels[owners], self.faces.between, len(regions.names))

    def interfaces_of(self, regions: Regions) -> Interfaces:
        """What this rank has of the faces between every two regions."""
        return self.faces.between

    def cells_at_faces(self) -> NDArray[np.bool_]:
        """(m,) own cells with a node of a kept face of any rank; all must call it."""
        on = np.zeros(self.space.halo.count, dtype=bool)
        on[self.faces.quads] = True
        return np.asarray(self.space.joined(on)[self.cells].any(axis=1))

    @property
    def corner(self) -> NDArray[np.float64]:
        """(3,) least coordinates of the mesh, in the user's unit."""
        return self._corner
