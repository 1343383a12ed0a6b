"""The container of a surface mesh."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexconformal.common import MeshError
from hexconformal.geometry import Faces
from hexconformal.io import MeshioOrigin, PyvistaOrigin
from hexconformal.mesh import checked_cells, checked_data, checked_points, read_only

__all__ = ["ArraysOrigin", "Floats", "Ints", "SurfaceMesh", "positions"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class SurfaceMesh:
    """Points, triangles and quadrilaterals with their arrays, all read-only, and what they were made from.

    Attributes
    ----------
    points
        (n, 3) positions, float64; those in the plane get z = 0.
    cells
        Triangles (t, 3) and quadrilaterals (q, 4), counter-clockwise seen from outside; a table of one kind will do.
    point_data, cell_data
        Arrays by name with first axis n, or t + q: triangles first.
    origin
        What the mesh was made from, for :meth:`to_source_type`.
    rows
        (t + q,) place of each cell among all cells of the origin.

    Raises
    ------
    MeshError
        If shapes or types make no sense, or there is no cell.

    Examples
    --------
    >>> mesh = SurfaceMesh(np.eye(3), [[0, 1, 2]])
    >>> mesh
    SurfaceMesh(3 points, 1 triangles, 0 quadrilaterals)
    >>> moved = mesh.replaced(2 * mesh.points, point_data={"height": mesh.points[:, 2]})
    >>> moved.points.max(), list(moved.point_data), mesh.points.max()
    (np.float64(2.0), ['height'], np.float64(1.0))
    """

    points: Floats
    cells: Faces
    point_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    origin: Any = None
    rows: Ints | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", positions(self.points))
        object.__setattr__(self, "cells", _checked(self.cells))
        object.__setattr__(self, "point_data", checked_data(self.point_data, len(self.points), "point_data"))
        object.__setattr__(self, "cell_data", checked_data(self.cell_data, len(self.cells), "cell_data"))
        if self.rows is not None:
            object.__setattr__(self, "rows", checked_data({"": self.rows}, len(self.cells), "rows")[""])

    def __repr__(self) -> str:
        t, q = len(self.cells.triangles), len(self.cells.quads)
        return f"SurfaceMesh({len(self.points)} points, {t} triangles, {q} quadrilaterals)"

    @property
    def notes(self) -> tuple[str, ...]:
        """Changes and omissions when the mesh was converted, in words."""
        return self.origin.selection.notes if isinstance(self.origin, (MeshioOrigin, PyvistaOrigin)) else ()

    @property
    def node_labels(self) -> NDArray[Any] | None:
        """(n,) what the file that the mesh was read from calls its points; None if these are counted from 0."""
        file = getattr(self.origin, "file", None)
        return None if file is None else file.node_labels

    @property
    def cell_labels(self) -> NDArray[Any] | None:
        """(t + q,) what the file that the mesh was read from calls the cells; None if these are counted from 0."""
        file = getattr(self.origin, "file", None)
        return None if file is None or file.cell_labels is None else file.cell_labels[self.rows]

    def named_nodes(self) -> Mapping[str, NDArray[Any]]:
        """Point arrays by name, and after them masks (n,) of the nodes in the sets and groups of the file."""
        return ChainMap(dict(self.point_data), getattr(self.origin, "node_groups", {}))

    def section_groups(self) -> Mapping[str, NDArray[np.bool_]]:
        """Sets of cells to which the file gives a material: surfaces have none."""
        return {}

    def tag_names(self, array: str) -> Mapping[int, str]:
        """What the file calls the numbers in an array on cells that tags them: nothing, for surfaces."""
        return {}

    def cell_groups(self) -> Mapping[str, NDArray[np.bool_]]:
        """Masks (t + q,) of the cells in the groups, sets and solids of the file, by name."""
        groups = getattr(self.origin, "cell_groups", None)
        if not groups or self.rows is None:
            return {}
        place = np.searchsorted(self.origin.selection.rows, self.rows)
        return {name: mask[place] for name, mask in groups.items()}

    def replaced(
        self,
        points: ArrayLike | None = None,
        point_data: Mapping[str, ArrayLike] | None = None,
        cell_data: Mapping[str, ArrayLike] | None = None,
    ) -> SurfaceMesh:
        """The same mesh with other points, and with arrays added to (or put in the place of) its own.

        Parameters
        ----------
        points
            (n, 3) new positions.
        point_data, cell_data
            Arrays by name, first axis n, or t + q: triangles first.

        Raises
        ------
        MeshError
            If there are other than n points, or an array has another length.
        """
        moved = self.points if points is None else positions(points)
        if len(moved) != len(self.points):
            raise MeshError(f"points must be as many as the surface has, {len(self.points)}, not {len(moved)}")
        return replace(
            self,
            points=moved,
            point_data=dict[str, Any](self.point_data) | dict(point_data or {}),
            cell_data=dict[str, Any](self.cell_data) | dict(cell_data or {}),
        )

    def to_source_type(self) -> Any:
        """The mesh as an object of the type it was made from, with everything that came in.

        Cells are in their old order, lines and vertices among them; arrays that are new have NaN there (0 for
        integers). Points are float64, in two dimensions where they came so. A mesh that was read from a file is
        returned as it is.
        """
        if isinstance(self.origin, ArraysOrigin):
            return self.origin.updated_source(self.points)
        if self.origin is None or self.origin.file is not None:
            return self
        full = self.for_origin(self.origin)
        full.points = full.points[:, : np.shape(self.origin.source.points)[1]]
        return self.origin.updated_source(full)

    def for_origin(self, origin: Any) -> Any:
        """The mesh as the origins of hexahedral meshes take it: arrays in the order of the origin's cells."""
        order = np.arange(len(self.cells)) if self.rows is None else np.argsort(self.rows)
        return SimpleNamespace(
            points=self.points,
            cells=origin.selection.cells,  # never changed
            point_data=self.point_data,
            cell_data={name: values[order] for name, values in self.cell_data.items()},
            origin=origin,
        )


@dataclass(frozen=True)
class ArraysOrigin:
    """A tuple that a mesh was made from: its tables of cells, and the dimension of its points."""

    tables: tuple[Ints, ...]
    dimension: int

    def updated_source(self, points: Floats) -> tuple[Any, ...]:
        return (points[:, : self.dimension].copy(), *(table.copy() for table in self.tables))


def positions(points: Any) -> Floats:
    """(n, 3) positions, read-only; those in the plane get z = 0."""
    given = checked_points(points, planar=True)
    return given if given.shape[1] == 3 else read_only(np.pad(given, ((0, 0), (0, 1))), None)


def _checked(cells: Any) -> Faces:
    if not isinstance(cells, Faces):
        wide = np.asarray(cells, dtype=object).shape[1:] == (4,)
        cells = Faces(*((), cells) if wide else (cells, ()))
    triangles, quads = checked_cells(cells.triangles, 3, "triangles"), checked_cells(cells.quads, 4, "quadrilaterals")
    if len(triangles) + len(quads) == 0:
        raise MeshError("there are no triangles or quadrilaterals")
    return cells if triangles is cells.triangles and quads is cells.quads else Faces(triangles, quads)
