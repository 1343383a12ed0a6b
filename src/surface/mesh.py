"""The container of a surface mesh, and how it is made from whatever the user has."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexconformal.errors import MeshError, OptionError

from .geometry import Cells

__all__ = ["SurfaceMesh", "as_surface_mesh"]

_CORNERS = {"triangle": 3, "quad": 4}


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

    Raises
    ------
    MeshError
        If shapes make no sense or there are no cells.

    Examples
    --------
    >>> as_surface_mesh((np.eye(3), [[0, 1, 2]]))
    SurfaceMesh(3 points, 1 triangles, 0 quadrilaterals)
    """

    points: NDArray[np.float64]
    cells: Cells
    point_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    origin: Any = None

    def __repr__(self) -> str:
        t, q = len(self.cells.triangles), len(self.cells.quads)
        return f"SurfaceMesh({len(self.points)} points, {t} triangles, {q} quadrilaterals)"

    def replaced(self, points: ArrayLike, cell_data: Mapping[str, NDArray[Any]] | None = None) -> SurfaceMesh:
        """The same mesh with other points and further arrays on its cells."""
        moved = _points(points)
        if len(moved) != len(self.points):
            raise MeshError(f"{len(moved)} points cannot take the place of {len(self.points)}")
        return replace(self, points=moved, cell_data={**self.cell_data, **(cell_data or {})})

    def restored(self) -> Any:
        """The mesh as an object of the type it was made from, with everything that came in."""
        return self if self.origin is None else self.origin(self)


def as_surface_mesh(source: Any) -> SurfaceMesh:
    """Take in a surface; nothing handed in is ever changed.

    Parameters
    ----------
    source
        A SurfaceMesh, a path, a meshio.Mesh, a pyvista surface, or ``(points, cells)`` with cells (m, 3) or (m, 4),
        or ``(points, triangles, quads)``.

    Raises
    ------
    MeshError
        If it holds no triangles or quadrilaterals, or other cells beside lines and vertices.
    ReadError
        If a file cannot be read.
    OptionError
        If `source` is none of the above.
    """
    if isinstance(source, SurfaceMesh):
        return source
    if isinstance(source, (str, os.PathLike)):
        from .io import read

        return read(source)
    if isinstance(source, tuple) and len(source) in (2, 3):
        return _from_arrays(*source)
    libraries = {base.__module__.partition(".")[0] for base in type(source).__mro__}
    if "meshio" in libraries:
        return from_meshio(source)
    if libraries & {"pyvista", "vtkmodules"}:
        return from_pyvista(source)
    raise OptionError(
        f"cannot make a surface of {type(source).__name__}: give a path, a meshio.Mesh, a pyvista surface, or a tuple "
        "(points, cells)"
    )


def from_meshio(source: Any) -> SurfaceMesh:
    """Take in a meshio.Mesh; lines and vertices are carried along."""
    rows: dict[str, list[tuple[int, Any]]] = {"triangle": [], "quad": []}
    for number, block in enumerate(source.cells):
        if block.type in rows:
            rows[block.type].append((number, block.data))
        elif block.dim > 1:
            raise MeshError(
                f"{len(block.data)} cells of type {block.type}: only triangles and quad cells can be remeshed"
            )
    order = [number for kind in rows.values() for number, _ in kind]
    tables = [_table([data for _, data in rows[name]], width) for name, width in _CORNERS.items()]
    cell_data = {
        name: np.concatenate([np.asarray(parts[n]) for n in order]) for name, parts in source.cell_data.items()
    }

    def restore(mesh: SurfaceMesh) -> Any:
        import meshio

        blocks = [meshio.CellBlock(block.type, np.array(block.data), tags=list(block.tags)) for block in source.cells]
        sizes = np.cumsum([0] + [len(source.cells[number].data) for number in order])
        data: dict[str, list[Any]] = {}
        for name in {**source.cell_data, **mesh.cell_data}:
            values = mesh.cell_data[name]
            parts = [np.array(part) for part in source.cell_data.get(name, ())]
            parts = parts or [np.full((len(block.data), *values.shape[1:]), np.nan) for block in source.cells]
            for place, number in enumerate(order):
                parts[number] = values[sizes[place] : sizes[place + 1]]
            data[name] = parts
        return meshio.Mesh(
            mesh.points.copy(), blocks, copy.deepcopy(source.point_data), data, copy.deepcopy(source.field_data),
            copy.deepcopy(source.point_sets), copy.deepcopy(source.cell_sets),
        )  # fmt: skip

    return _checked(source.points, tables, dict(source.point_data), cell_data, restore)


def from_pyvista(source: Any) -> SurfaceMesh:
    """Take in a pyvista PolyData, or an unstructured grid of triangles and quadrilaterals."""
    import pyvista as pv

    source = pv.wrap(source)
    if not isinstance(source, (pv.PolyData, pv.UnstructuredGrid, pv.StructuredGrid)):
        raise MeshError(f"{type(source).__name__} is no surface that can be remeshed")
    grid = source.cast_to_unstructured_grid()
    types = grid.celltypes
    other = ~np.isin(types, (1, 2, 3, 4, 5, 9))
    if other.any():
        names = ", ".join(pv.CellType(code).name for code in np.unique(types[other]).tolist())
        raise MeshError(f"{int(other.sum())} cells of type {names}: only triangles and quad cells can be remeshed")
    starts = np.asarray(grid.cell_offsets if hasattr(type(grid), "cell_offsets") else grid.offset)[:-1]
    nodes = np.asarray(grid.cell_connectivity)
    places = [np.flatnonzero(types == code) for code in (5, 9)]
    tables = [nodes[starts[rows][:, None] + np.arange(k)] for rows, k in zip(places, (3, 4), strict=True)]
    rows = np.concatenate(places)
    cell_data = {name: np.asarray(grid.cell_data[name])[rows] for name in grid.cell_data}

    def restore(mesh: SurfaceMesh) -> Any:
        result = source.copy(deep=True)
        result.points = mesh.points.copy()
        for name, values in mesh.cell_data.items():
            if name not in source.cell_data:
                filled = np.full((grid.n_cells, *values.shape[1:]), np.nan)
                filled[rows] = values
                result.cell_data[name] = filled
        return result

    point_data = {name: np.asarray(grid.point_data[name]) for name in grid.point_data}
    return _checked(np.asarray(grid.points), tables, point_data, cell_data, restore)


def _from_arrays(points: Any, cells: Any, quads: Any = None) -> SurfaceMesh:
    given = np.asarray(cells)
    if quads is not None:
        tables = [_table([given], 3), _table([np.asarray(quads)], 4)]
        return _checked(points, tables, {}, {}, lambda mesh: (mesh.points.copy(), *map(np.copy, tables)))
    if given.ndim != 2 or given.shape[1] not in (3, 4):
        raise MeshError(f"cells must be an (m, 3) or (m, 4) array of node ids, not {given.shape}")
    tables = [_table([given] if given.shape[1] == k else [], k) for k in (3, 4)]
    return _checked(points, tables, {}, {}, lambda mesh: (mesh.points.copy(), given.astype(np.int64)))


def _table(parts: list[Any], width: int) -> NDArray[np.int64]:
    arrays = [np.asarray(part) for part in parts if len(part)]
    for array in arrays:
        if array.ndim != 2 or array.shape[1] != width or array.dtype.kind not in "iu":
            raise MeshError(f"cells must be integer arrays (m, {width}), not {array.dtype} {array.shape}")
    return np.concatenate(arrays).astype(np.int64) if arrays else np.empty((0, width), dtype=np.int64)


def _points(points: Any) -> NDArray[np.float64]:
    try:
        result = np.array(points, dtype=np.float64)
    except (TypeError, ValueError) as problem:
        raise MeshError(f"points must be an (n, 3) array of numbers: {problem}") from problem
    if result.ndim == 2 and result.shape[1] == 2:
        result = np.column_stack([result, np.zeros(len(result))])
    if result.ndim != 2 or result.shape[1] != 3:
        raise MeshError(f"points must be an (n, 3) array, not {result.shape}")
    return result


def _checked(points: Any, tables: list[Any], point_data: Any, cell_data: Any, origin: Any) -> SurfaceMesh:
    cells = Cells(*tables)
    if len(cells) == 0:
        raise MeshError("there are no triangles or quadrilaterals")
    return SurfaceMesh(_points(points), cells, point_data, cell_data, origin)
