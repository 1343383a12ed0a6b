"""Hexahedral meshes from and to pyvista grids, which are never changed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, unusable_points
from ..mesh import HexMesh
from .formats.vtk_file_checks import require_cells
from .selection import Selection, SourceFile, fill_cells, select, straightened
from .vtk_mesh import SOLIDS, blocks

__all__ = ["PyvistaOrigin", "cell_offsets", "from_pyvista", "plain_pyvista", "triangles"]

_QUAD, _HEXAHEDRON, _POLYHEDRON = 9, 12, 42


@dataclass(frozen=True)
class PyvistaOrigin:
    """A structured or unstructured grid, and which of its cells are the hexahedra."""

    source: Any
    selection: Selection
    file: SourceFile | None = None

    def built(self, mesh: HexMesh) -> Any:
        """A new grid that holds all of the source, with the points, cells and arrays of `mesh`."""
        rows = self.selection.rows
        grid = self.source.copy(deep=True)
        if not np.array_equal(mesh.cells, self._stored()):
            grid = self._rebuilt(mesh)
        grid.points = straightened(mesh.points, self.selection)
        for name, array in mesh.point_data.items():
            grid.point_data.set_array(_flat(array), name)
        for name, array in mesh.cell_data.items():
            old = self.source.cell_data.get(name)
            grid.cell_data.set_array(fill_cells(old, _flat(array), rows, grid.n_cells), name)
        return grid

    def quads(self, name: str) -> tuple[NDArray[np.int64], NDArray[Any]] | None:
        """Quadrilaterals (k, 4) that came along and their values of a cell array; None if there is no such array."""
        if name not in self.source.cell_data:
            return None
        grid = self.source.cast_to_unstructured_grid()
        rows = np.flatnonzero(grid.celltypes == _QUAD)
        nodes = np.asarray(grid.cell_connectivity)[cell_offsets(grid)[rows][:, None] + np.arange(4)]
        return nodes, np.asarray(self.source.cell_data[name])[rows]

    def _stored(self) -> NDArray[np.int64]:
        # The hexahedra as the source itself has them: voxels differ from those of the selection.
        cells, rows = self.selection.cells, self.selection.rows
        if not hasattr(self.source, "celltypes") or not (self.source.celltypes[rows] == 11).any():
            return cells
        return np.empty((0, 8), dtype=np.int64)

    def _rebuilt(self, mesh: HexMesh) -> Any:
        import pyvista as pv

        if self.selection.higher:
            raise MeshError("the node order of linearised cells cannot be changed")
        grid = self.source.cast_to_unstructured_grid()
        types, offsets = grid.celltypes.copy(), cell_offsets(grid)
        if (types == _POLYHEDRON).any():
            raise MeshError("the node order of hexahedra cannot be changed beside polyhedra")
        nodes = np.array(grid.cell_connectivity, dtype=np.int64)
        nodes[offsets[self.selection.rows][:, None] + np.arange(8)] = mesh.cells
        types[self.selection.rows] = _HEXAHEDRON
        result = pv.UnstructuredGrid(np.insert(nodes, offsets[:-1], np.diff(offsets)), types, mesh.points.copy())
        result.GetPointData().DeepCopy(grid.GetPointData())
        result.GetCellData().DeepCopy(grid.GetCellData())
        result.GetFieldData().DeepCopy(grid.GetFieldData())
        return result


def from_pyvista(source: Any, other_cells: str, linearise: bool, file: SourceFile | None = None) -> HexMesh:
    """Take in a pyvista or VTK grid; see :func:`hexconformal.io.read_write.as_hex_mesh`."""
    import pyvista as pv

    source = pv.wrap(source)
    if isinstance(source, pv.MultiBlock):
        raise MeshError(f"this is a collection of {len(source)} blocks: pass one of them, or join them with combine()")
    if isinstance(source, (pv.ImageData, pv.RectilinearGrid)):
        # Their points cannot move; a structured grid keeps points, cells and arrays in the same order.
        source = source.cast_to_structured_grid()
    if not isinstance(source, (pv.StructuredGrid, pv.UnstructuredGrid)):
        raise MeshError(f"{type(source).__name__} holds no hexahedra: pass a volume mesh")
    grid = source.cast_to_unstructured_grid()
    cells = blocks(grid.celltypes, cell_offsets(grid), np.asarray(grid.cell_connectivity))
    selection = select(cells, grid.n_points, other_cells, linearise)
    cell_data = {name: np.asarray(grid.cell_data[name])[selection.rows] for name in grid.cell_data}
    point_data = {name: np.asarray(grid.point_data[name]) for name in grid.point_data}
    origin = PyvistaOrigin(source, selection, file)
    return HexMesh(np.asarray(grid.points), selection.cells, point_data, cell_data, origin)


def plain_pyvista(mesh: HexMesh) -> Any:
    """An unstructured grid of a mesh that was made from arrays."""
    import pyvista as pv

    cells = np.column_stack([np.full(len(mesh.cells), 8), mesh.cells])
    grid = pv.UnstructuredGrid(cells.ravel(), np.full(len(cells), _HEXAHEDRON, dtype=np.uint8), mesh.points.copy())
    for name, array in mesh.point_data.items():
        grid.point_data.set_array(_flat(array), name)
    for name, array in mesh.cell_data.items():
        grid.cell_data.set_array(_flat(array), name)
    return grid


def triangles(dataset: Any) -> Any:
    """The faces of a pyvista dataset, or the skin of its solid cells if it has any, as PolyData of triangles.

    Raises
    ------
    MeshError
        If there are none, their points are not finite, or their nodes are no points.
    """
    import pyvista

    pv: Any = pyvista
    require_cells(dataset)
    if not isinstance(dataset, pv.PolyData):
        grid = dataset.cast_to_unstructured_grid()
        solid = np.isin(grid.celltypes, list(SOLIDS))
        if solid.any() and not solid.all():
            grid = grid.extract_cells(solid)
        dataset = grid.extract_surface(algorithm="dataset_surface")
    bare = dataset.copy(deep=False)
    bare.clear_data()
    # Files of separate triangles repeat their points: only joined ones tell which triangles touch.
    joined = bare.triangulate().clean(tolerance=0.0, lines_to_points=False, polys_to_lines=False)
    faces = np.array(joined.faces, dtype=np.int64).reshape(-1, 4)[:, 1:]
    faces = faces[(np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)]
    if len(faces) == 0:
        raise MeshError("there are no faces")
    points = np.array(joined.points, dtype=np.float64)
    bad, text = unusable_points(points)
    if len(bad):
        raise MeshError(text)
    return pv.PolyData.from_regular_faces(points, faces)


def _flat(array: NDArray[Any]) -> NDArray[Any]:
    # VTK knows no arrays of tensors, only of tuples.
    return array.reshape(len(array), -1).copy() if array.ndim > 2 else array.copy()


def cell_offsets(grid: Any) -> NDArray[np.int64]:
    """(m + 1,) where the nodes of each cell start, whatever the version of pyvista calls it."""
    return np.asarray(grid.cell_offsets if hasattr(type(grid), "cell_offsets") else grid.offset)
