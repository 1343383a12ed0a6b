"""The container of a hexahedral mesh."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError
from .arrays import checked_cells, checked_data, checked_points
from .carried_cells import CarriedCells
from .volume_mesh import VolumeMesh

__all__ = ["HexMesh", "NodePairs"]


@dataclass(frozen=True, eq=False)
class NodePairs:
    """Pairs of nodes that move together, as one statement of a file has them.

    Attributes
    ----------
    nodes
        (k, 2) indices of nodes.
    source
        What the file calls them, such as "$Periodic".
    affine
        (4, 4) map that takes the second node of each pair to the first; None where the file tells none.
    several
        True where pairs may be of several maps, such as those of all pairs of faces.
    left_out
        What else the file couples, and is not understood, in words; "" for nothing.
    """

    nodes: NDArray[np.int64]
    source: str
    affine: NDArray[np.float64] | None = None
    several: bool = False
    left_out: str = ""


@dataclass(frozen=True, eq=False)
class HexMesh(VolumeMesh):
    """Points and hexahedra with their arrays, all read-only, and what they were made from.

    Attributes
    ----------
    points
        (n, 3) positions, float64, in the mesh's own unit of length.
    cells
        (m, 8) hexahedra in VTK node order, int64.
    point_data
        Arrays by name, first axis n.
    cell_data
        Arrays by name, first axis m: the values on the hexahedra.
    origin
        What the mesh was made from, for :meth:`to_source_type` and for writing; None if it was made from arrays.

    Raises
    ------
    MeshError
        If shapes or types make no sense, or there is no hexahedron.

    Examples
    --------
    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> mesh = HexMesh(CORNERS, [[0, 1, 2, 3, 4, 5, 6, 7]])
    >>> mesh
    HexMesh(8 points, 1 hexahedra)
    >>> moved = mesh.replaced(points=2 * mesh.points, point_data={"height": mesh.points[:, 2]})
    >>> moved.points.max(), list(moved.point_data), mesh.points.max()
    (np.float64(2.0), ['height'], np.float64(1.0))
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    point_data: dict[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: dict[str, NDArray[Any]] = field(default_factory=dict)
    origin: Any = None
    _may_be_empty: ClassVar[bool] = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", checked_points(self.points))
        object.__setattr__(self, "cells", checked_cells(self.cells, 8, "hexahedra"))
        if len(self.cells) == 0 and not self._may_be_empty:
            raise MeshError("there are no hexahedra")
        object.__setattr__(self, "point_data", checked_data(self.point_data, len(self.points), "point_data"))
        object.__setattr__(self, "cell_data", checked_data(self.cell_data, len(self.cells), "cell_data"))

    def __repr__(self) -> str:
        return f"HexMesh({len(self.points)} points, {len(self.cells)} hexahedra)"

    @property
    def cell_labels(self) -> NDArray[Any] | None:
        """(m,) what the file that the mesh was read from calls the hexahedra; None if cells are counted from 0."""
        file = getattr(self.origin, "file", None)
        return None if file is None or file.cell_labels is None else file.cell_labels[self.origin.selection.rows]

    def cell_groups(self) -> Mapping[str, NDArray[np.bool_]]:
        """Masks (m,) of the hexahedra in the sets of cells of the file, by name."""
        groups = getattr(self.origin, "cell_groups", None)
        return {} if groups is None else groups

    def carried_cells(self, corners: int) -> CarriedCells:
        """The cells with 1 to 4 corners that came along: vertices, lines, triangles or quadrilaterals."""
        if self.origin is None:
            return CarriedCells(np.empty((0, corners), dtype=np.int64))
        carried: CarriedCells = self.origin.carried_cells(corners)
        return carried

    def node_sets(self) -> Mapping[str, NDArray[np.bool_]]:
        """Masks (n,) of nodes by name: point arrays of booleans, and the sets of nodes of the file."""
        marked = {name: array for name, array in self.point_data.items() if array.dtype == bool and array.ndim == 1}
        return ChainMap(marked, {} if self.origin is None else self.origin.node_sets)

    def face_sets(self) -> Mapping[str, NDArray[np.int64]]:
        """Faces (k, 4) of hexahedra that the file lists by cell and side, by name."""
        file = getattr(self.origin, "file", None)
        return {} if file is None else file.face_sets

    def section_groups(self) -> Mapping[str, NDArray[np.bool_]]:
        """Those of the sets of cells to which the file gives a material, by name."""
        names, groups = getattr(getattr(self.origin, "file", None), "sections", ()), self.cell_groups()
        return {name: groups[name] for name in names}

    def tag_names(self, array: str) -> Mapping[int, str]:
        """What the file calls the numbers in an array on cells that tags them."""
        names = getattr(self.origin, "tag_names", None)
        return {} if names is None else names(array)

    @property
    def coupled_pairs(self) -> tuple[NodePairs, ...]:
        """Pairs of nodes that the file couples: they move together."""
        return tuple(getattr(self.origin, "coupled_pairs", ()))

    def _arrays_of_cells(self) -> NDArray[np.int64]:
        return self.cells.copy()
