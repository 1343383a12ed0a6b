"""The container of a surface mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexconformal.errors import MeshError
from hexconformal.meshio_mesh import MeshioOrigin
from hexconformal.pyvista_mesh import PyvistaOrigin

from .geometry import Cells, Floats, Ints

__all__ = ["ArraysOrigin", "SurfaceMesh", "positions"]


@dataclass(frozen=True, eq=False)
class SurfaceMesh:
    """Points, triangles and quadrilaterals with their arrays, and what they were made from.

    Attributes
    ----------
    points
        (n, 3) positions, float64.
    cells
        Triangles (t, 3) and quadrilaterals (q, 4), counter-clockwise seen from outside.
    point_data, cell_data
        Arrays by name with first axis n, or t + q: triangles first.
    origin
        What the mesh was made from, for :meth:`restored`.
    rows
        (t + q,) place of each cell among all cells of the origin.

    Examples
    --------
    >>> from surface import as_surface_mesh
    >>> as_surface_mesh((np.eye(3), [[0, 1, 2]]))
    SurfaceMesh(3 points, 1 triangles, 0 quadrilaterals)
    """

    points: Floats
    cells: Cells
    point_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    origin: Any = None
    rows: Ints | None = None

    def __repr__(self) -> str:
        t, q = len(self.cells.triangles), len(self.cells.quads)
        return f"SurfaceMesh({len(self.points)} points, {t} triangles, {q} quadrilaterals)"

    @property
    def notes(self) -> tuple[str, ...]:
        """What was changed or left out when the mesh was taken in, in words."""
        return self.origin.selection.notes if isinstance(self.origin, (MeshioOrigin, PyvistaOrigin)) else ()

    def replaced(
        self, points: ArrayLike | None = None, cell_data: Mapping[str, NDArray[Any]] | None = None
    ) -> SurfaceMesh:
        """The same mesh with other points, or further arrays on its cells.

        Parameters
        ----------
        points
            (n, 3) new positions.
        cell_data
            Arrays by name, first axis t + q: triangles first.

        Raises
        ------
        MeshError
            If there are other than n points.
        """
        moved = self.points if points is None else positions(points)
        if len(moved) != len(self.points):
            raise MeshError(f"{len(moved)} points cannot take the place of {len(self.points)}")
        return replace(self, points=moved, cell_data={**self.cell_data, **(cell_data or {})})

    def restored(self) -> Any:
        """The mesh as an object of the type it was made from, with everything that came in.

        Cells are in their old order, lines and vertices among them; arrays that are new have NaN there (0 for
        integers). Points are float64, in two dimensions where they came so. A mesh that was read from a file is
        returned as it is.
        """
        if isinstance(self.origin, ArraysOrigin):
            return self.origin.built(self.points)
        if self.origin is None or self.origin.file is not None:
            return self
        full = self.carried(self.origin)
        full.points = full.points[:, : np.shape(self.origin.source.points)[1]]
        return self.origin.built(full)

    def carried(self, origin: Any) -> Any:
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
    """What was handed in as a tuple: its tables of cells, and the dimension of its points."""

    tables: tuple[Ints, ...]
    dimension: int

    def built(self, points: Floats) -> tuple[Any, ...]:
        return (points[:, : self.dimension].copy(), *(table.copy() for table in self.tables))


def positions(points: Any, dimension: int = 3) -> Floats:
    """(n, 3) positions, those in the plane with z = 0; or as they are where `dimension` is 2."""
    try:
        array = np.asarray(points)
        if np.iscomplexobj(array):
            raise TypeError("complex numbers")
        result = np.array(array, dtype=np.float64, order="C")
    except (TypeError, ValueError) as problem:
        raise MeshError(f"points must be an (n, 3) array of real numbers: {problem}") from problem
    if result.ndim != 2 or result.shape[1] not in (2, 3):
        raise MeshError(f"points must be an (n, 3) array, or (n, 2) in the plane, not {result.shape}")
    return result if dimension == 2 else np.pad(result, ((0, 0), (0, 3 - result.shape[1])))
