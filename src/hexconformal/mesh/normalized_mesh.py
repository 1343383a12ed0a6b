"""A mesh in a unit, origin and order of its own, so that a run does not depend on those of the input.

Edges have unit length on average. Solves that are not carried to the end depend on the order of nodes and cells.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, first_ids
from ..elements import cell_volumes, edge_lengths, is_valid, rows_by_type
from .hex_mesh import HexMesh
from .interfaces import Interfaces, find_interfaces, region_surfaces
from .regions import Regions, find_regions
from .space import SERIAL, Space
from .spatial_order import spatial_order
from .topology import boundary_quads

__all__ = ["NormalizedMesh"]

Field = NDArray[np.float64]


class NormalizedMesh:
    """A mesh translated and scaled to a mean edge length of one, and the way back.

    Parameters
    ----------
    mesh
        A mesh that has passed the checks.
    ordered
        Renumber nodes and cells by where they are (:mod:`hexconformal.mesh.spatial_order`).

    Attributes
    ----------
    node_ids, cell_ids
        (n,), (m,) ids that the nodes and cells have in the mesh given.
    points
        (n, 3) normalized points at the start of the run.
    cells
        (m, 8) cells, writable, type by type.
    referenced
        (n,) nodes that belong to a cell.
    unit
        Mean edge length of the mesh given, in its own unit of length.
    space
        Where fields on its nodes live.

    Raises
    ------
    MeshError
        If most cells have negative volume, or all edges have no length.
    """

    space: Space = SERIAL

    def __init__(self, mesh: HexMesh, ordered: bool = False) -> None:
        self.mesh = mesh
        self.node_ids, self.cell_ids = np.arange(len(mesh.points)), np.arange(len(mesh.cells))
        if ordered:
            self.node_ids, self.cell_ids = spatial_order(mesh.points, mesh.cells)
        typed = rows_by_type(mesh.cells[self.cell_ids])
        if len(typed) > 1:
            self.cell_ids = np.concatenate([self.cell_ids[one.rows] for one in typed])
        self.cells = np.argsort(self.node_ids)[mesh.cells[self.cell_ids]]
        points = mesh.points[self.node_ids]
        self.referenced = np.zeros(len(mesh.points), dtype=bool)
        self.referenced[self.cells] = True
        self._corner = points[self.referenced].min(axis=0)
        points = points - self._corner
        self.unit = float(edge_lengths(points, self.cells).mean())
        if self.unit == 0.0:
            raise MeshError("cells must have a size: all their edges have no length")
        self.points = points / self.unit
        volumes = cell_volumes(self.points, self.cells)
        if (volumes < 0).mean() > 0.5:
            raise MeshError(
                "cells with negative volume: "
                f"{first_ids(np.sort(self.cell_ids[volumes < 0]), mesh.cell_labels)} of {len(volumes)}; "
                "the mesh is mirrored or its nodes are in a foreign order: hexconformal.orient(mesh) puts them right"
            )

    def to_user(self, points: Field) -> Field:
        """Normalized points in the unit and order of the mesh given; what did not move is bit-identical to it."""
        moved = self.mesh.points.copy()
        moved[self.node_ids] += self.unit * (points - self.points)
        return moved

    def from_user(self, points: Field) -> Field:
        """Points in the unit of the mesh given, normalized."""
        return (points - self._corner) / self.unit

    def regions(self, interfaces: Any) -> Regions | None:
        """The regions of the mesh given, if it has any; see :func:`hexconformal.mesh.find_regions`."""
        return find_regions(self.mesh, interfaces)

    def surfaces_of(self, regions: Regions) -> list[NDArray[np.int64]]:
        """The closed surface of every region; see :func:`hexconformal.mesh.region_surfaces`."""
        return region_surfaces(self.cells, regions.labels[self.cell_ids])

    def interfaces_of(self, regions: Regions) -> Interfaces:
        """The faces between every two regions; see :func:`hexconformal.mesh.find_interfaces`."""
        return find_interfaces(self.cells, regions.labels[self.cell_ids])

    @property
    def node_labels(self) -> NDArray[Any]:
        """(n,) what the file of the mesh calls the nodes, or their ids in the mesh; further nodes have these."""
        names = self.mesh.node_labels
        if names is None:
            return self.node_ids
        return np.concatenate([names, np.arange(len(names), len(self.mesh.points))])[self.node_ids]

    @property
    def cell_labels(self) -> NDArray[Any]:
        """(m,) what the file of the mesh calls the cells, or their ids in the mesh."""
        return self.cell_ids if self.mesh.cell_labels is None else self.mesh.cell_labels[self.cell_ids]

    @cached_property
    def skin(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(k, 4) boundary quads, seen from outside, and the cell (k,) of each."""
        return boundary_quads(self.cells)

    @property
    def quads(self) -> NDArray[np.int64]:
        """(k, 4) boundary quads, seen from outside."""
        return self.skin[0]

    @cached_property
    def valid(self) -> NDArray[np.bool_]:
        """(m,) cells that are valid at the start."""
        return is_valid(self.points, self.cells)

    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box of the normalized points."""
        return float(np.linalg.norm(np.ptp(self.points[self.referenced], axis=0)))
