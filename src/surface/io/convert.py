"""Surfaces from and to what other libraries, and file formats, hold; nothing handed in is ever changed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexconformal.common import MeshError, first_ids
from hexconformal.geometry import Faces
from hexconformal.io import MeshioOrigin, PyvistaOrigin, Selection, SourceFile, cell_nodes, cell_offsets, to_pyvista
from hexconformal.mesh import checked_points

from ..mesh import ArraysOrigin, Ints, SurfaceMesh

__all__ = [
    "as_pyvista",
    "from_arrays",
    "from_meshio",
    "from_pyvista",
    "meshio_in_cell_order",
    "with_library_origin",
]

_CORNERS = {"triangle": 3, "quad": 4}
_TRIANGLE, _QUAD = 5, 9
_LOWER = (1, 2, 3, 4)  # VTK's vertices and lines, carried along
_ADVICE = (
    "only triangles and quadrilaterals with straight edges can be remeshed (of a volume, take the surface first; "
    "of larger polygons, or cells of higher order, make triangles)"
)
_TYPES = {1: "vertex", 3: "line", 5: "triangle", 9: "quad"}


def from_arrays(points: Any, *cells: Any) -> SurfaceMesh:
    """Take in points and one table of cells, (m, 3) or (m, 4), or one of each."""
    dimension = checked_points(points, planar=True).shape[1]
    if len(cells) == 2:
        tables = [_table([given], width) for given, width in zip(cells, (3, 4), strict=True)]
        return SurfaceMesh(points, Faces(*tables), origin=ArraysOrigin(tuple(tables), dimension))
    given = _integers(cells[0])
    if given.ndim != 2 or given.shape[1] not in (3, 4):
        raise MeshError(f"cells must be an (m, 3) or (m, 4) array of node ids, not {given.shape}")
    tables = [_table([given] if given.shape[1] == k else [], k) for k in (3, 4)]
    return SurfaceMesh(points, Faces(*tables), origin=ArraysOrigin((given.astype(np.int64),), dimension))


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
    return SurfaceMesh(source.points, Faces(*tables), point_data, cell_data, origin, rows)


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
        raise MeshError(f"cells of other types: {first_ids(np.flatnonzero(other))}, namely {names}; {_ADVICE}")
    places = [np.flatnonzero(types == code) for code in (_TRIANGLE, _QUAD)]
    tables = [nodes[offsets[rows][:, None] + np.arange(k)] for rows, k in zip(places, (3, 4), strict=True)]
    rows = np.concatenate(places)
    cell_data = {name: np.asarray(grid.cell_data[name])[rows] for name in grid.cell_data}
    point_data = {name: np.asarray(grid.point_data[name]) for name in grid.point_data}
    origin = PyvistaOrigin(source, _selection(rows, notes), file)
    return SurfaceMesh(np.asarray(grid.points), Faces(*tables), point_data, cell_data, origin, rows)


def with_library_origin(mesh: SurfaceMesh) -> Any:
    """The mesh as :mod:`hexconformal.io.convert` takes it, with an origin whatever it was made from."""
    if isinstance(mesh.origin, (MeshioOrigin, PyvistaOrigin)):
        return mesh.for_origin(mesh.origin)
    return mesh.for_origin(PyvistaOrigin(_plain_grid(mesh), _selection(np.arange(len(mesh.cells)))))


def as_pyvista(mesh: SurfaceMesh) -> Any:
    """A new unstructured grid of pyvista that holds all of a surface."""
    return to_pyvista(with_library_origin(mesh))[0].cast_to_unstructured_grid()


def meshio_in_cell_order(grid: Any) -> tuple[Any, list[str]]:
    """A meshio.Mesh with a block for every run of cells of one type, which keeps their order, and what is left out."""
    import meshio

    grid = grid.cast_to_unstructured_grid()
    types = grid.celltypes
    rows = np.flatnonzero(np.isin(types, list(_TYPES)))
    lost = [f"field data {name!r}" for name in grid.field_data]
    if len(rows) < len(types):
        lost.append(f"{len(types) - len(rows)} lines and vertices of several points in one cell")
    runs = np.split(rows, np.flatnonzero(np.diff(types[rows])) + 1)
    blocks = [(_TYPES[int(types[run[0]])], cell_nodes(grid, run)[1].reshape(len(run), -1)) for run in runs]
    mesh = meshio.Mesh(
        np.array(grid.points, dtype=np.float64),
        blocks,
        point_data={name: np.array(grid.point_data[name]) for name in grid.point_data},
        cell_data={name: [np.asarray(grid.cell_data[name])[run] for run in runs] for name in grid.cell_data},
    )
    return mesh, lost


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
