"""Hexahedral meshes from and to plain VTK grids, which are never changed; pyvista is not needed.

Inside ParaView there is VTK, but a second copy of it, as pyvista would bring along, must not be loaded.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, first_ids
from ..mesh import CarriedCells, HexMesh, MixedMesh
from .carried_cells import of_grid
from .node_groups import NodeGroups, cell_array_groups
from .selection import HEXAHEDRA, Block, Selection, mesh_of, scatter_to_cells, select, with_straight_edges
from .source_file import SourceFile

__all__ = [
    "QUADS",
    "SOLIDS",
    "VtkOrigin",
    "cell_blocks",
    "cell_table",
    "cell_type_name",
    "cell_types",
    "check_cell_nodes",
    "from_vtk",
    "ghost_cells",
    "is_grid_of_numbers",
    "named_arrays",
    "points_of",
    "updated_dataset",
]

SOLIDS = {*range(10, 17), 24, 25, 26, 27, 29, 31, 32, 33, 37, 41, 42, 64, 65, 66, 67, 71, 72, 73, 74, 78, 79, 80, 81}
# Types whose nodes are taken as a table.
_NAMES = {
    10: "tetra",
    11: "voxel",
    12: "hexahedron",
    13: "wedge",
    14: "pyramid",
    24: "tetra10",
    25: "hexahedron20",
    26: "wedge15",
    27: "pyramid13",
    29: "hexahedron27",
    32: "wedge18",
}
# Numbers of nodes by VTK type, of types that have always the same.
_NODE_COUNTS = {1: 1, 3: 2, 5: 3, 8: 4, 9: 4, 10: 4, 11: 8, 12: 8, 13: 6, 14: 5, 15: 10, 16: 12}
_NODE_COUNTS |= {21: 3, 22: 6, 23: 8, 24: 10, 25: 20, 26: 15, 27: 13, 28: 9, 29: 27}
# Quadrilaterals: pixels, and those of second order and of Lagrange, whose corners come first, are among them.
QUADS = (8, 9, 23, 28, 70)


@dataclass(frozen=True)
class VtkOrigin:
    """A vtkUnstructuredGrid with its arrays, and which of its cells are the hexahedra."""

    source: Any
    selection: Selection
    file: SourceFile | None = None

    def updated_source(self, mesh: HexMesh | MixedMesh) -> Any:
        """A new grid that shares cells and arrays with the source, with the points and the arrays of `mesh`."""
        points = with_straight_edges(mesh.points, self.selection)
        return updated_dataset(self.source, points, mesh.point_data, mesh.cell_data, self.selection.rows)

    @property
    def node_groups(self) -> NodeGroups:
        """Nodes by the names of cell arrays."""
        arrays = named_arrays(self.source.GetCellData())
        return cell_array_groups(self.source.GetNumberOfPoints(), arrays, *cell_table(self.source.GetCells()))

    @property
    def node_sets(self) -> NodeGroups:
        """None: VTK has no sets of nodes besides arrays."""
        return NodeGroups(self.source.GetNumberOfPoints())

    def carried_cells(self, corners: int) -> CarriedCells:
        """The cells with 1 to 4 corners, with their arrays."""
        if self.source.GetNumberOfCells() == len(self.selection.rows):
            return CarriedCells(np.empty((0, corners), dtype=np.int64))
        table = cell_table(self.source.GetCells())
        return of_grid(cell_types(self.source), *table, corners, named_arrays(self.source.GetCellData()))


def from_vtk(
    grid: Any, other_cells: str = "refuse", linearize: bool = False, types: Collection[str] = HEXAHEDRA
) -> HexMesh | MixedMesh:
    """Take in a vtkUnstructuredGrid with its cells of some types; see :func:`hexconformal.as_volume_mesh`.

    Its arrays are not taken in, but are there again in what :meth:`hexconformal.HexMesh.to_source_type` returns.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.io.pyvista_mesh import grid_from_arrays
    >>> mesh = from_vtk(grid_from_arrays(HexMesh(*box((2, 2, 2)))))
    >>> grid = mesh.replaced(cell_data={"number": np.arange(8)}).to_source_type()
    >>> grid.GetClassName(), grid.GetCellData().GetArray("number").GetRange()
    ('vtkUnstructuredGrid', (0.0, 7.0))
    """
    offsets, nodes = cell_table(grid.GetCells())
    blocks = cell_blocks(cell_types(grid), offsets, nodes)
    selection = select(blocks, grid.GetNumberOfPoints(), other_cells, linearize, ghost_cells(grid), types)
    return mesh_of(points_of(grid), selection, {}, {}, VtkOrigin(grid, selection))


def updated_dataset(
    source: Any,
    points: NDArray[np.float64],
    point_data: Mapping[str, NDArray[Any]],
    cell_data: Mapping[str, NDArray[Any]],
    rows: NDArray[np.int64],
) -> Any:
    """A new dataset that shares all with a vtkUnstructuredGrid or vtkPolyData but its points and some arrays.

    Parameters
    ----------
    source
        The dataset; it is not changed.
    points
        (n, 3) new positions.
    point_data, cell_data
        Arrays to set, first axes n and k.
    rows
        (k,) the cells that `cell_data` is about; others keep what they have, or get NaN (0 for integers).
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkUnstructuredGrid

    result = vtkPolyData() if source.IsA("vtkPolyData") else vtkUnstructuredGrid()
    result.ShallowCopy(source)
    moved = vtkPoints()
    moved.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
    result.SetPoints(moved)
    on_cells = {}
    for name, values in cell_data.items():
        old = source.GetCellData().GetArray(name)
        filled = scatter_to_cells(None if old is None else vtk_to_numpy(old), values, rows, source.GetNumberOfCells())
        on_cells[name] = filled
    for attributes, arrays in ((result.GetPointData(), point_data), (result.GetCellData(), on_cells)):
        for name, values in arrays.items():
            array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
            array.SetName(name)
            attributes.AddArray(array)
    return result


def cell_blocks(types: NDArray[Any], offsets: NDArray[np.int64], nodes: NDArray[np.int64]) -> list[Block]:
    """The cells of a VTK grid by their type.

    Parameters
    ----------
    types
        (m,) VTK's numbers of the cells' types.
    offsets
        (m + 1,) where the nodes of each cell start.
    nodes
        Nodes of all cells, one cell after the other.

    Examples
    --------
    >>> [block.name for block in cell_blocks(np.array([10, 5]), np.array([0, 4, 7]), np.arange(7))]
    ['triangle', 'tetra']
    """
    found = []
    for code in np.flatnonzero(np.bincount(types)).tolist():
        rows = np.flatnonzero(types == code)
        size = offsets[rows + 1] - offsets[rows]
        if code in _NAMES:
            corners = nodes[offsets[rows][:, None] + np.arange(size[0])]
        else:
            corners = nodes[np.repeat(types == code, np.diff(offsets))]
        found.append(Block(_NAMES.get(code) or cell_type_name(code), 3 if code in SOLIDS else 2, corners, rows))
    return found


def ghost_cells(grid: Any) -> NDArray[np.bool_] | None:
    """(m,) True for cells that belong to a neighbouring part, or are blanked; None if nothing tells."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    array = grid.GetCellData().GetArray("vtkGhostType")
    return None if array is None else vtk_to_numpy(array) != 0


def points_of(dataset: Any) -> NDArray[np.float64]:
    """(n, 3) points of a VTK dataset."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    points = dataset.GetPoints()
    return np.empty((0, 3)) if points is None else vtk_to_numpy(points.GetData()).astype(np.float64)


def cell_table(cells: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Offsets (m + 1,) and nodes of all cells of a vtkCellArray, one cell after the other."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    offsets, nodes = (vtk_to_numpy(array) for array in (cells.GetOffsetsArray(), cells.GetConnectivityArray()))
    return offsets.astype(np.int64), nodes.astype(np.int64)


def named_arrays(attributes: Any) -> dict[str, NDArray[Any]]:
    """The arrays of numbers in the attributes of a VTK dataset, by name."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    names = [attributes.GetArrayName(number) for number in range(attributes.GetNumberOfArrays())]
    return {name: vtk_to_numpy(attributes.GetArray(name)) for name in names if attributes.GetArray(name) is not None}


def is_grid_of_numbers(dataset: Any) -> bool:
    """Whether VTK alone tells all of a dataset: an unstructured grid whose arrays are numbers, and have names.

    Others need pyvista: strings, bits, and booleans and complex numbers, of which it leaves a note in strings.
    """
    if not type(dataset).__module__.startswith("vtkmodules.") or not dataset.IsA("vtkUnstructuredGrid"):
        return False
    found = [dataset.GetPointData(), dataset.GetCellData(), dataset.GetFieldData()]
    arrays = [data.GetAbstractArray(number) for data in found for number in range(data.GetNumberOfArrays())]
    return all(array.IsA("vtkDataArray") and not array.IsA("vtkBitArray") and array.GetName() for array in arrays)


def cell_types(grid: Any) -> NDArray[np.uint8]:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkVersion

    # What returned the array was renamed; under the new name the old VTK has something else.
    renamed = (vtkVersion.GetVTKMajorVersion(), vtkVersion.GetVTKMinorVersion()) >= (9, 6)
    types: NDArray[np.uint8] = vtk_to_numpy(grid.GetCellTypes() if renamed else grid.GetCellTypesArray())
    return types


def check_cell_nodes(dataset: Any) -> None:
    """Raise a MeshError if cells of a VTK dataset have a wrong number of nodes, or nodes that are no points.

    VTK itself follows them wherever they lead.
    """
    count = dataset.GetNumberOfPoints()
    if dataset.IsA("vtkPolyData"):
        tables = [dataset.GetVerts(), dataset.GetLines(), dataset.GetPolys(), dataset.GetStrips()]
    elif dataset.IsA("vtkUnstructuredGrid"):
        tables = [dataset.GetCells()]
    else:
        tables = []
        if dataset.IsA("vtkStructuredGrid") and np.prod(dataset.GetDimensions()) != count:
            raise MeshError(f"points must be those of a grid of {tuple(dataset.GetDimensions())}, not {count}")
    for cells in tables:
        offsets, nodes = cell_table(cells)
        sizes = np.diff(offsets)
        if len(offsets) and (offsets[0] != 0 or (sizes < 0).any() or offsets[-1] > len(nodes)):
            raise MeshError(
                "the numbers of nodes of its cells must lie within the list of nodes: the dataset is damaged"
            )
        bad = (nodes < 0) | (nodes >= count)
        if bad.any():
            ids = np.searchsorted(offsets, np.flatnonzero(bad), side="right") - 1
            raise MeshError(f"cells with node ids outside 0..{count - 1}: {first_ids(np.unique(ids))}")
    if dataset.IsA("vtkUnstructuredGrid"):
        expected = np.array([_NODE_COUNTS.get(code, 0) for code in range(256)])[cell_types(dataset)]
        if len(expected) != len(sizes):
            raise MeshError(f"types must be one for each of the {len(sizes)} cells, not {len(expected)}")
        odd = np.flatnonzero((expected > 0) & (expected != sizes))
        if len(odd):
            raise MeshError(f"cells must have as many nodes as their type; others: {first_ids(odd)}")


def cell_type_name(code: int) -> str:
    """The name of a type of cells in VTK, in words."""
    from vtkmodules.vtkCommonDataModel import vtkGenericCell

    cell = vtkGenericCell.InstantiateCell(code)
    if cell is None:
        return f"VTK type {code}"
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", cell.GetClassName().removeprefix("vtk")).lower()
