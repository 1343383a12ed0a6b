"""The frame a run works in: its own unit, origin and order, so that those of the mesh do not matter.

Edges have unit length on average. Solves that are not carried to the end depend on the order of nodes and cells.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, first_ids
from ..elements import cell_volumes, edge_lengths, is_valid
from .hex_mesh import HexMesh
from .spatial_order import spatial_order
from .topology import boundary_quads

__all__ = ["NormalizedMesh"]

Field = NDArray[np.float64]


class NormalizedMesh:
    """A mesh in a frame of its own, and the way back.

    Parameters
    ----------
    mesh
        A sound mesh.
    ordered
        Whether nodes and cells come in an order of the frame's own.

    Attributes
    ----------
    nodes, order
        (n,), (m,) ids that the nodes and cells of this frame have in the mesh.
    start
        (n, 3) the mesh's points in this frame.
    cells
        (m, 8) its cells, writable.
    used
        (n,) nodes that belong to a cell.
    unit
        Length of one unit here in the mesh's own unit of length.

    Raises
    ------
    MeshError
        If most cells have negative volume, or all edges have no length.
    """

    def __init__(self, mesh: HexMesh, ordered: bool = False) -> None:
        self.mesh = mesh
        self.nodes, self.order = np.arange(len(mesh.points)), np.arange(len(mesh.cells))
        if ordered:
            self.nodes, self.order = spatial_order(mesh.points, mesh.cells)
        self.cells = np.argsort(self.nodes)[mesh.cells[self.order]]
        points = mesh.points[self.nodes]
        self.used = np.zeros(len(mesh.points), dtype=bool)
        self.used[self.cells] = True
        self._corner = points[self.used].min(axis=0)
        start = points - self._corner
        self.unit = float(edge_lengths(start, self.cells).mean())
        if self.unit == 0.0:
            raise MeshError("all edges have no length")
        self.start = start / self.unit
        volumes = cell_volumes(self.start, self.cells)
        if (volumes < 0).mean() > 0.5:
            raise MeshError(
                f"cells with negative volume: {first_ids(np.sort(self.order[volumes < 0]))} of {len(volumes)}; "
                "the mesh is mirrored or its nodes are in a foreign order: hexconformal.orient(mesh) puts them right"
            )

    def to_user(self, points: Field) -> Field:
        """Points in the user's frame and order; what did not move is bit-identical to the input."""
        moved = self.mesh.points.copy()
        moved[self.nodes] += self.unit * (points - self.start)
        return moved

    def from_user(self, points: Field) -> Field:
        """Points of the user's frame in this one."""
        return (points - self._corner) / self.unit

    @cached_property
    def quads(self) -> NDArray[np.int64]:
        """(k, 4) boundary quads, seen from outside."""
        return boundary_quads(self.cells)[0]

    @cached_property
    def valid(self) -> NDArray[np.bool_]:
        """(m,) cells that are valid at the start."""
        return is_valid(self.start, self.cells)

    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box, in units of this frame."""
        return float(np.linalg.norm(np.ptp(self.start[self.used], axis=0)))
