"""What every mesh of volume cells has, whatever its cells are."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import MeshError
from ..elements import SECOND_ORDER
from .arrays import checked_points

__all__ = ["VolumeMesh"]

Mesh = TypeVar("Mesh", bound="VolumeMesh")


class VolumeMesh:
    """Points with their arrays, those of cells, and what the mesh was made from: the classes of meshes have them."""

    points: NDArray[np.float64]
    point_data: dict[str, NDArray[Any]]
    cell_data: dict[str, NDArray[Any]]
    origin: Any

    @property
    def held(self) -> NDArray[np.bool_]:
        """(n,) nodes of the other three-dimensional cells that were carried along: keep them where they are."""
        return np.zeros(len(self.points), dtype=bool) if self.origin is None else self.origin.selection.held

    @property
    def straightened(self) -> NDArray[np.bool_]:
        """(n,) nodes between corners of cells that are taken as linear: they will be put on straight edges."""
        found = np.zeros(len(self.points), dtype=bool)
        for block in () if self.origin is None else self.origin.selection.higher_order:
            found[block.nodes[:, -len(SECOND_ORDER[block.name][1]) :]] = True
        return found

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on what was changed or set aside when the mesh was read."""
        return () if self.origin is None else self.origin.selection.notes

    @property
    def node_labels(self) -> NDArray[Any] | None:
        """(n,) what the file that the mesh was read from calls its points; None if these are counted from 0."""
        file = getattr(self.origin, "file", None)
        return None if file is None else file.node_labels

    def named_nodes(self) -> Mapping[str, NDArray[Any]]:
        """Point arrays by name, and after them masks (n,) of the nodes in the sets and groups of the file."""
        return ChainMap(self.point_data, {} if self.origin is None else self.origin.node_groups)

    def replaced(
        self: Mesh,
        points: ArrayLike | None = None,
        point_data: Mapping[str, ArrayLike] | None = None,
        cell_data: Mapping[str, ArrayLike] | None = None,
    ) -> Mesh:
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
        replacement = replace(
            cast(Any, self),
            points=points,
            point_data=dict[str, Any](self.point_data) | dict(point_data or {}),
            cell_data=dict[str, Any](self.cell_data) | dict(cell_data or {}),
        )
        return cast(Mesh, replacement)

    def to_source_type(self) -> Any:
        """The mesh as an object of the type it was made from.

        Everything that came in is there again: other cells in their order, arrays, field data, named sets,
        unreferenced points. Points are those of this mesh, always in float64 (rounding to float32 could turn a
        thin cell inside out); arrays added to `cell_data` are NaN (0 for integers) on other cells. Higher-order
        nodes of linearized cells lie on the straight edges and trilinear faces.

        Returns
        -------
        ``(points, cells)`` for arrays, with the cells by the name of their type where there may be several, a
        meshio.Mesh, a pyvista grid; a mesh that was read from a file is returned as it is.
        """
        if self.origin is None:
            return self.points.copy(), self._arrays_of_cells()
        return self if self.origin.file is not None else self.origin.updated_source(self)

    def _arrays_of_cells(self) -> Any:
        raise NotImplementedError
