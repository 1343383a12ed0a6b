"""The container of a hexahedral mesh."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import MeshError
from .arrays import checked_cells, checked_data, checked_points
from .carried_cells import CarriedCells
from .node_pairs import NodePairs

__all__ = ["HexMesh"]


@dataclass(frozen=True, eq=False)
class HexMesh:
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

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", checked_points(self.points))
        object.__setattr__(self, "cells", checked_cells(self.cells, 8, "hexahedra"))
        if len(self.cells) == 0:
            raise MeshError("there are no hexahedra")
        object.__setattr__(self, "point_data", checked_data(self.point_data, len(self.points), "point_data"))
        object.__setattr__(self, "cell_data", checked_data(self.cell_data, len(self.cells), "cell_data"))

    def __repr__(self) -> str:
        return f"HexMesh({len(self.points)} points, {len(self.cells)} hexahedra)"

    @property
    def held(self) -> NDArray[np.bool_]:
        """(n,) nodes of the other three-dimensional cells that were carried along: keep them where they are."""
        return np.zeros(len(self.points), dtype=bool) if self.origin is None else self.origin.selection.held

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on what was changed or set aside when the mesh was read."""
        return () if self.origin is None else self.origin.selection.notes

    @property
    def node_labels(self) -> NDArray[Any] | None:
        """(n,) what the file that the mesh was read from calls its points; None if these are counted from 0."""
        file = getattr(self.origin, "file", None)
        return None if file is None else file.node_labels

    @property
    def cell_labels(self) -> NDArray[Any] | None:
        """(m,) what the file that the mesh was read from calls the hexahedra; None if cells are counted from 0."""
        file = getattr(self.origin, "file", None)
        return None if file is None or file.cell_labels is None else file.cell_labels[self.origin.selection.rows]

    def named_nodes(self) -> Mapping[str, NDArray[Any]]:
        """Point arrays by name, and after them masks (n,) of the nodes in the sets and groups of the file."""
        return ChainMap(self.point_data, {} if self.origin is None else self.origin.node_groups)

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

    def replaced(
        self,
        points: ArrayLike | None = None,
        point_data: Mapping[str, ArrayLike] | None = None,
        cell_data: Mapping[str, ArrayLike] | None = None,
    ) -> HexMesh:
        """The same mesh with other points, and with arrays added to (or put in the place of) its own.

        Parameters
        ----------
        points
            (n, 3) new positions.
        point_data, cell_data
            Arrays by name, first axis n or m.

        Raises
        ------
        MeshError
            If there are other than n points, or an array has another length.
        """
        points = self.points if points is None else checked_points(points)
        if len(points) != len(self.points):
            raise MeshError(f"points must be as many as the mesh has, {len(self.points)}, not {len(points)}")
        return replace(
            self,
            points=points,
            point_data=dict[str, Any](self.point_data) | dict(point_data or {}),
            cell_data=dict[str, Any](self.cell_data) | dict(cell_data or {}),
        )

    def to_source_type(self) -> Any:
        """The mesh as an object of the type it was made from.

        Everything that came in is there again: other cells in their order, arrays, field data, named sets,
        unreferenced points. Points are those of this mesh, always in float64 (rounding to float32 could turn a
        thin cell inside out); arrays added to `cell_data` are NaN (0 for integers) on other cells. Higher-order
        nodes of linearized cells lie on the straight edges and trilinear faces.

        Returns
        -------
        ``(points, cells)`` for arrays, a meshio.Mesh, a pyvista grid; a mesh that was read from a file is
        returned as it is.
        """
        if self.origin is None:
            return self.points.copy(), self.cells.copy()
        return self if self.origin.file is not None else self.origin.updated_source(self)
