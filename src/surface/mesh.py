"""The container of a surface mesh, and how it is made from whatever the user has."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexconformal.errors import MeshError, OptionError
from hexconformal.meshio_mesh import MeshioOrigin
from hexconformal.pyvista_mesh import PyvistaOrigin, cell_offsets
from hexconformal.selection import Selection, SourceFile

from .geometry import Cells, Floats, Ints

__all__ = ["SurfaceMesh", "as_surface_mesh", "carried", "from_meshio", "from_pyvista"]

_CORNERS = {"triangle": 3, "quad": 4}
_TRIANGLE, _QUAD = 5, 9
_LOWER = (1, 2, 3, 4)  # VTK's vertices and lines, carried along
_ADVICE = (
    "only triangles and quadrilaterals with straight edges can be remeshed (of a volume, take the surface first; "
    "of larger polygons, or cells of higher order, make triangles)"
)


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
        moved = self.points if points is None else _points(points)
        if len(moved) != len(self.points):
            raise MeshError(f"{len(moved)} points cannot take the place of {len(self.points)}")
        return replace(self, points=moved, cell_data={**self.cell_data, **(cell_data or {})})

    def restored(self) -> Any:
        """The mesh as an object of the type it was made from, with everything that came in.

        Cells are in their old order, lines and vertices among them; arrays that are new have NaN there (0 for
        integers). Points are float64, in two dimensions where they came so. A mesh that was read from a file is
        returned as it is.
        """
        if isinstance(self.origin, _Arrays):
            return self.origin.built(self.points)
        if self.origin is None or self.origin.file is not None:
            return self
        full = carried(self)
        full.points = full.points[:, : np.shape(self.origin.source.points)[1]]
        return self.origin.built(full)


@dataclass(frozen=True)
class _Arrays:
    """What was handed in as a tuple: its tables of cells, and the dimension of its points."""

    tables: tuple[Ints, ...]
    dimension: int

    def built(self, points: Floats) -> tuple[Any, ...]:
        return (points[:, : self.dimension].copy(), *(table.copy() for table in self.tables))


def as_surface_mesh(source: Any) -> SurfaceMesh:
    """Take in a surface; nothing handed in is ever changed.

    Points in two dimensions are taken to lie in the plane z = 0.

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


def carried(mesh: SurfaceMesh) -> Any:
    """The mesh as the converters of :mod:`hexconformal.convert` take it: its arrays in the order of its origin."""
    count = len(mesh.cells)
    origin = mesh.origin
    if not isinstance(origin, (MeshioOrigin, PyvistaOrigin)):
        origin = PyvistaOrigin(_plain_grid(mesh), _selection(np.arange(count)))
    order = np.arange(count) if mesh.rows is None else np.argsort(mesh.rows)
    return SimpleNamespace(
        points=mesh.points,
        cells=origin.selection.cells,  # never changed
        point_data=mesh.point_data,
        cell_data={name: values[order] for name, values in mesh.cell_data.items()},
        origin=origin,
    )


def from_meshio(source: Any, file: SourceFile | None = None, notes: tuple[str, ...] = ()) -> SurfaceMesh:
    """Take in a meshio.Mesh; lines and vertices are carried along."""
    starts = np.cumsum([0, *(len(block.data) for block in source.cells)])
    found: dict[str, list[int]] = {name: [] for name in _CORNERS}
    for number, block in enumerate(source.cells):
        if block.type in found:
            found[block.type].append(number)
        elif block.dim > 1 and len(block.data):
            raise MeshError(f"cells of type {block.type}: {len(block.data)}; {_ADVICE}")
    tables = [_table([source.cells[n].data for n in found[name]], width) for name, width in _CORNERS.items()]
    numbers = [number for group in found.values() for number in group]
    rows = np.concatenate([np.arange(starts[n], starts[n + 1]) for n in numbers] or [np.empty(0, np.int64)])
    cell_data = {}
    for name, parts in source.cell_data.items():
        arrays = [np.asarray(part) for part in parts]
        # An array that differs in shape from block to block stays where it is.
        if len({array.shape[1:] for array in arrays}) == 1:
            cell_data[name] = np.concatenate(arrays)[rows]
    point_data = {name: np.asarray(values) for name, values in source.point_data.items()}
    origin = MeshioOrigin(source, _selection(rows, notes), file)
    return _checked(source.points, tables, point_data, cell_data, origin, rows)


def from_pyvista(source: Any, file: SourceFile | None = None, notes: tuple[str, ...] = ()) -> SurfaceMesh:
    """Take in a pyvista or VTK surface: PolyData, or a grid of triangles and quadrilaterals."""
    import pyvista as pv

    source = pv.wrap(source)
    if not isinstance(source, (pv.PolyData, pv.UnstructuredGrid, pv.StructuredGrid)):
        raise MeshError(f"{type(source).__name__} is no surface that can be remeshed: make it PolyData first")
    grid = source.cast_to_unstructured_grid()
    types, offsets, nodes = grid.celltypes, cell_offsets(grid), np.asarray(grid.cell_connectivity)
    other = ~np.isin(types, (*_LOWER, _TRIANGLE, _QUAD))
    if other.any():
        kinds = zip(*np.unique(types[other], return_counts=True), strict=True)
        names = ", ".join(f"{count} {pv.CellType(code).name.lower()}" for code, count in kinds)
        raise MeshError(f"cells of other types: {names}; {_ADVICE}")
    places = [np.flatnonzero(types == code) for code in (_TRIANGLE, _QUAD)]
    tables = [nodes[offsets[rows][:, None] + np.arange(k)] for rows, k in zip(places, (3, 4), strict=True)]
    rows = np.concatenate(places)
    cell_data = {name: np.asarray(grid.cell_data[name])[rows] for name in grid.cell_data}
    point_data = {name: np.asarray(grid.point_data[name]) for name in grid.point_data}
    origin = PyvistaOrigin(source, _selection(rows, notes), file)
    return _checked(np.asarray(grid.points), tables, point_data, cell_data, origin, rows)


def _from_arrays(points: Any, *cells: Any) -> SurfaceMesh:
    if len(cells) == 2:
        tables = [_table([given], width) for given, width in zip(cells, (3, 4), strict=True)]
        return _checked(points, tables, {}, {}, _Arrays(tuple(tables), _points(points, 2).shape[1]))
    given = _integers(cells[0])
    if given.ndim != 2 or given.shape[1] not in (3, 4):
        raise MeshError(f"cells must be an (m, 3) or (m, 4) array of node ids, not {given.shape}")
    tables = [_table([given] if given.shape[1] == k else [], k) for k in (3, 4)]
    return _checked(points, tables, {}, {}, _Arrays((given.astype(np.int64),), _points(points, 2).shape[1]))


def _plain_grid(mesh: SurfaceMesh) -> Any:
    import pyvista as pv

    tables = {_TRIANGLE: mesh.cells.triangles, _QUAD: mesh.cells.quads}
    flat = np.concatenate([np.insert(table, 0, table.shape[1], axis=1).ravel() for table in tables.values()])
    types = np.concatenate([np.full(len(table), code, dtype=np.uint8) for code, table in tables.items()])
    return pv.UnstructuredGrid(flat, types, mesh.points.copy())


def _selection(rows: Ints, notes: tuple[str, ...] = ()) -> Selection:
    return Selection(np.empty((0, 8), np.int64), np.sort(rows), np.empty(0, np.bool_), (), notes)


def _integers(cells: Any) -> NDArray[Any]:
    try:
        result = np.asarray(cells)
    except ValueError as problem:
        raise MeshError(f"cells must be an array of node ids: {problem}") from problem
    if result.size and result.dtype.kind not in "iu":
        raise MeshError(f"cells must hold integer node ids, not {result.dtype}")
    return result


def _table(parts: list[Any], width: int) -> Ints:
    arrays = [_integers(part) for part in parts if len(part)]
    for array in arrays:
        if array.ndim != 2 or array.shape[1] != width:
            raise MeshError(f"cells must be integer arrays (m, {width}), not {array.shape}")
    return np.concatenate(arrays).astype(np.int64) if arrays else np.empty((0, width), dtype=np.int64)


def _points(points: Any, dimension: int = 3) -> Floats:
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


def _checked(points: Any, tables: list[Any], point_data: Any, cell_data: Any, origin: Any, rows: Any = None) -> Any:
    cells = Cells(*(np.ascontiguousarray(table, dtype=np.int64) for table in tables))
    if len(cells) == 0:
        raise MeshError("there are no triangles or quadrilaterals")
    return SurfaceMesh(_points(points), cells, point_data, cell_data, origin, rows)
