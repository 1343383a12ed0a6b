"""Meshes from and to pyvista grids, which are never changed."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, unusable_points
from ..elements import collapsed_cells
from ..mesh import CarriedCells, CellBlock, HexMesh, MixedMesh, blocks_of
from .carried_cells import of_grid
from .grid_cells import cell_nodes, cell_offsets, node_places
from .node_groups import NodeGroups, cell_array_groups
from .selection import HEXAHEDRA, Selection, mesh_of, scatter_to_cells, select, with_straight_edges
from .source_file import SourceFile
from .vtk_mesh import (
    SOLIDS,
    cell_blocks,
    cell_table,
    cell_types,
    check_cell_nodes,
    ghost_cells,
    is_grid_of_numbers,
    named_arrays,
    points_of,
)

__all__ = [
    "PyvistaOrigin",
    "from_pyvista",
    "grid_from_arrays",
    "require_in_vtk",
    "to_polydata",
    "triangles",
    "triangles_of",
]

_VOXEL, _HEXAHEDRON, _POLYHEDRON = 11, 12, 42


@dataclass(frozen=True)
class PyvistaOrigin:
    """A structured or unstructured grid of VTK or pyvista, and which of its cells are the hexahedra."""

    dataset: Any
    selection: Selection
    file: SourceFile | None = None

    @cached_property
    def source(self) -> Any:
        """The grid as one of pyvista, which is loaded when it is first asked for."""
        import pyvista as pv

        return pv.wrap(self.dataset)

    def updated_source(self, mesh: HexMesh | MixedMesh) -> Any:
        """A new grid that holds all of the source, with the points, cells and arrays of `mesh`."""
        rows = self.selection.rows
        grid = self.source.copy(deep=True)
        if not np.array_equal(mesh.cells, self._source_cells()):
            grid = self._rebuilt(mesh)
        grid.points = with_straight_edges(mesh.points, self.selection)
        for name, array in mesh.point_data.items():
            grid.point_data.set_array(_flat(array), name)
        for name, array in mesh.cell_data.items():
            old = self.source.cell_data.get(name)
            grid.cell_data.set_array(scatter_to_cells(old, _flat(array), rows, grid.n_cells), name)
        return grid

    @property
    def cell_groups(self) -> dict[str, NDArray[np.bool_]]:
        """Masks (m,) of the selected cells in the groups of the file, by name."""
        groups = {}
        for name, runs in ({} if self.file is None else self.file.cell_groups).items():
            inside = np.zeros(self.source.n_cells, dtype=bool)
            for run in runs:
                inside[run.start : run.stop] = True
            groups[name] = inside[self.selection.rows]
        return groups

    @property
    def node_groups(self) -> NodeGroups:
        """Nodes by the names of cell arrays, and of groups of cells in the file."""
        grid = self.source.cast_to_unstructured_grid()
        nodes = np.asarray(grid.cell_connectivity, dtype=np.int64)
        groups = cell_array_groups(grid.n_points, dict(grid.cell_data), cell_offsets(grid), nodes)
        for name, runs in ({} if self.file is None else self.file.cell_groups).items():
            for run in runs:
                groups.add(name, partial(_nodes_of_run, grid, run))
        return groups

    @property
    def node_sets(self) -> NodeGroups:
        """None: VTK has no sets of nodes besides arrays."""
        return NodeGroups(self.dataset.GetNumberOfPoints())

    def carried_cells(self, corners: int) -> CarriedCells:
        """The cells with 1 to 4 corners, with their arrays."""
        if self.dataset.GetNumberOfCells() == len(self.selection.rows):
            return CarriedCells(np.empty((0, corners), dtype=np.int64))
        grid = self.source.cast_to_unstructured_grid()
        nodes = np.asarray(grid.cell_connectivity, dtype=np.int64)
        return of_grid(grid.celltypes, cell_offsets(grid), nodes, corners, dict(grid.cell_data))

    def _source_cells(self) -> NDArray[np.int64]:
        # The hexahedra as the source itself has them: voxels differ from those of the selection.
        cells, rows = self.selection.cells, self.selection.rows
        if not hasattr(self.source, "celltypes") or not (self.source.celltypes[rows] == _VOXEL).any():
            return cells
        return np.empty((0, 8), dtype=np.int64)

    def _rebuilt(self, mesh: HexMesh | MixedMesh) -> Any:
        import pyvista as pv

        if self.selection.higher_order:
            raise MeshError(
                "the node order of linearized cells cannot be changed: convert the file to hexahedra of 8 nodes first"
            )
        grid = self.source.cast_to_unstructured_grid()
        types, offsets = grid.celltypes.copy(), cell_offsets(grid)
        if (types == _POLYHEDRON).any():
            raise MeshError(
                "the node order of hexahedra cannot be changed beside polyhedra: extract the hexahedra first"
            )
        nodes = np.array(grid.cell_connectivity, dtype=np.int64)
        rows = self.selection.rows
        for block in blocks_of(mesh):
            # A hexahedron, some of whose nodes coincide, stays one.
            sizes = np.diff(offsets)[rows[block.places]]
            for size in np.unique(sizes):
                own = block.cells[sizes == size]
                own = own if own.shape[1] == size else collapsed_cells(own, block.cell_type)
                nodes[node_places(offsets, rows[block.places[sizes == size]])] = own.ravel()
        types[rows[types[rows] == _VOXEL]] = _HEXAHEDRON
        result = pv.UnstructuredGrid(np.insert(nodes, offsets[:-1], np.diff(offsets)), types, mesh.points.copy())
        result.GetPointData().DeepCopy(grid.GetPointData())
        result.GetCellData().DeepCopy(grid.GetCellData())
        result.GetFieldData().DeepCopy(grid.GetFieldData())
        return result


def from_pyvista(
    source: Any,
    other_cells: str,
    linearize: bool,
    file: SourceFile | None = None,
    types: Collection[str] = HEXAHEDRA,
) -> HexMesh | MixedMesh:
    """Take in a pyvista or VTK grid; see :func:`hexconformal.io.read_write.as_hex_mesh`."""
    if not is_grid_of_numbers(source):
        source = _with_points(source)
    grid = source if source.IsA("vtkUnstructuredGrid") else source.cast_to_unstructured_grid()
    blocks = cell_blocks(cell_types(grid), *cell_table(grid.GetCells()))
    selection = select(blocks, grid.GetNumberOfPoints(), other_cells, linearize, ghost_cells(grid), types)
    point_data, cell_data = _arrays(grid)
    cell_data = {name: values[selection.rows] for name, values in cell_data.items()}
    return mesh_of(points_of(grid), selection, point_data, cell_data, PyvistaOrigin(source, selection, file))


def _with_points(source: Any) -> Any:
    """A grid of pyvista whose points can move."""
    import pyvista as pv

    source = pv.wrap(source)
    if isinstance(source, pv.MultiBlock):
        raise MeshError(f"this is a collection of {len(source)} blocks: pass one of them, or join them with combine()")
    if isinstance(source, (pv.ImageData, pv.RectilinearGrid)):
        # A structured grid keeps points, cells and arrays in the same order.
        source = source.cast_to_structured_grid()
    if not isinstance(source, (pv.StructuredGrid, pv.UnstructuredGrid)):
        raise MeshError(f"{type(source).__name__} holds no hexahedra: pass a volume mesh")
    return source


def _arrays(grid: Any) -> tuple[dict[str, NDArray[Any]], dict[str, NDArray[Any]]]:
    """Arrays on the points and cells of an unstructured grid, by name."""
    if is_grid_of_numbers(grid):
        return named_arrays(grid.GetPointData()), named_arrays(grid.GetCellData())
    on_points, on_cells = ({name: np.asarray(a[name]) for name in a} for a in (grid.point_data, grid.cell_data))
    return on_points, on_cells


def require_in_vtk(blocks: Iterable[CellBlock]) -> None:
    """Refuse cells of types that VTK does not have.

    Raises
    ------
    MeshError
        If there are any.
    """
    for block in blocks:
        if not block.cell_type.vtk:
            raise MeshError(f"VTK has no {block.cell_type.plural}: Gmsh's files (.msh) hold them")


def grid_from_arrays(mesh: HexMesh | MixedMesh) -> Any:
    """An unstructured grid of a mesh that was made from arrays."""
    import pyvista as pv

    require_in_vtk(blocks_of(mesh))
    count = sum(len(block.cells) for block in blocks_of(mesh))
    types, sizes = np.empty(count, dtype=np.uint8), np.empty(count, dtype=np.int64)
    for block in blocks_of(mesh):
        types[block.places], sizes[block.places] = block.cell_type.vtk, block.cells.shape[1]
    grid = pv.UnstructuredGrid(
        np.insert(mesh.cells.ravel(), np.cumsum(sizes) - sizes, sizes), types, mesh.points.copy()
    )
    for name, array in mesh.point_data.items():
        grid.point_data.set_array(_flat(array), name)
    for name, array in mesh.cell_data.items():
        grid.cell_data.set_array(_flat(array), name)
    return grid


def triangles(dataset: Any) -> Any:
    """The faces of a pyvista dataset, or the skin of its solid cells if it has any, as PolyData of triangles.

    These have the integers that faces had, one each; nodes (k, 2) of lines are the field data `lines`.

    Raises
    ------
    MeshError
        If there are none, their points are not finite, or their nodes are no points.
    """
    import pyvista

    pv: Any = pyvista
    check_cell_nodes(dataset)
    if not isinstance(dataset, pv.PolyData):
        grid = dataset.cast_to_unstructured_grid()
        solid = np.isin(grid.celltypes, list(SOLIDS))
        if solid.any() and not solid.all():
            grid = grid.extract_cells(solid)
        dataset = grid.extract_surface(algorithm="dataset_surface")
    bare = dataset.copy(deep=False)
    bare.clear_data()
    # Cells come in this order: points, lines, faces.
    others = dataset.n_verts + dataset.n_lines
    bare.verts, bare.lines = np.empty(0, np.int64), np.empty(0, np.int64)
    bare.cell_data["face"] = np.arange(others, others + bare.n_cells)
    # Files of separate triangles repeat their points: only joined ones tell which triangles touch.
    joined = bare.triangulate().clean(tolerance=0.0, lines_to_points=False, polys_to_lines=False)
    faces = np.array(joined.faces, dtype=np.int64).reshape(-1, 4)[:, 1:]
    of = np.asarray(joined.cell_data["face"]) if len(faces) else np.empty(0, np.int64)
    proper = (np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)
    faces, of = faces[proper], of[proper]
    if len(faces) == 0:
        raise MeshError("a surface must have faces that are no lines or points; this one has none")
    points = np.array(joined.points, dtype=np.float64)
    bad, text = unusable_points(points)
    if len(bad):
        raise MeshError(text)
    surface = pv.PolyData.from_regular_faces(points, faces)
    for name, array in dataset.cell_data.items():
        if array.ndim == 1 and array.dtype.kind in "iu" and not name.startswith("vtkOriginal"):
            surface.cell_data[name] = np.asarray(array)[of]
    lines = _lines(dataset, points)
    if len(lines):
        surface.field_data["lines"] = lines
    return surface


def _lines(dataset: Any, points: NDArray[np.float64]) -> NDArray[np.int64]:
    """The lines (k, 2) of PolyData, or those that its field data have, between points (n, 3) that are at their ends."""
    table, pairs = np.asarray(dataset.lines), [np.empty((0, 2), dtype=np.int64)]
    while len(table):
        chain, table = table[1 : table[0] + 1], table[table[0] + 1 :]
        pairs.append(np.column_stack([chain[:-1], chain[1:]]))
    if "lines" in dataset.field_data:
        pairs.append(np.asarray(dataset.field_data["lines"]))
    ends = np.concatenate(pairs)
    places = np.asarray(dataset.points, dtype=np.float64)[ends.ravel()]
    same = np.unique(np.concatenate([points, places]), axis=0, return_inverse=True)[1].ravel()
    known = np.full(len(points) + len(places), -1, dtype=np.int64)
    known[same[: len(points)]] = np.arange(len(points))
    found = known[same[len(points) :]].reshape(-1, 2)
    return found[(found >= 0).all(axis=1)]


def triangles_of(source: Any) -> Any:
    """The surface of anything pyvista can show, as :func:`triangles`.

    Raises
    ------
    MeshError
        If this is nothing pyvista can wrap, has no faces, or points that are not finite.
    """
    import pyvista as pv

    try:
        dataset = pv.wrap(source)
    except (NotImplementedError, TypeError, ValueError):
        dataset = source
    if not isinstance(dataset, pv.DataSet):
        raise MeshError(f"a surface must be one pyvista dataset, or a path, not {type(source).__name__}")
    return triangles(dataset)


def _flat(array: NDArray[Any]) -> NDArray[Any]:
    # VTK knows no arrays of tensors, only of tuples.
    return array.reshape(len(array), -1).copy() if array.ndim > 2 else array.copy()


def to_polydata(grid: Any) -> Any:
    """PolyData of an unstructured grid of vertices, lines and faces: it has vertices first, then lines, then faces."""
    import pyvista as pv

    groups = [np.flatnonzero(np.isin(grid.celltypes, codes)) for codes in ((1, 2), (3, 4), (5, 9))]
    parts = []
    for rows in groups:
        sizes, nodes = cell_nodes(grid, rows)
        parts.append(np.insert(nodes, np.cumsum(sizes) - sizes, sizes) if len(rows) else None)
    verts, lines, faces = parts
    result = pv.PolyData(np.array(grid.points), faces=faces, lines=lines, verts=verts)
    order = np.concatenate(groups)
    for name in grid.point_data:
        result.point_data.set_array(np.asarray(grid.point_data[name]), name)
    for name in grid.cell_data:
        result.cell_data.set_array(np.asarray(grid.cell_data[name])[order], name)
    for name in grid.field_data:
        result.field_data.set_array(grid.field_data[name], name)
    return result


def _nodes_of_run(grid: Any, run: range) -> NDArray[np.int64]:
    return cell_nodes(grid, np.arange(run.start, run.stop))[1]
