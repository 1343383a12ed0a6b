"""Surface meshes from and to plain vtkPolyData, which is never changed; pyvista is not needed."""

from __future__ import annotations

from typing import Any

import numpy as np

from hexconformal.common import MeshError, first_ids
from hexconformal.geometry import Faces
from hexconformal.io import cell_table, points_of, updated_dataset

from ..mesh import SurfaceMesh

__all__ = ["from_vtk", "to_vtk"]

_ADVICE = "make triangles of them first (Triangulate in ParaView)"


def from_vtk(polydata: Any) -> SurfaceMesh:
    """Take in a vtkPolyData of triangles and quadrilaterals; vertices and lines stay behind, for :func:`to_vtk`.

    Of its arrays only those of integers on cells are taken in, which may tell regions apart.

    Raises
    ------
    MeshError
        If it holds no triangles or quadrilaterals, or larger polygons, or strips.

    Examples
    --------
    >>> import pyvista as pv
    >>> from_vtk(pv.Plane(i_resolution=2, j_resolution=2))
    SurfaceMesh(9 points, 0 triangles, 4 quadrilaterals)
    """
    before = polydata.GetNumberOfVerts() + polydata.GetNumberOfLines()
    if polydata.GetNumberOfStrips():
        raise MeshError(f"strips of triangles: {polydata.GetNumberOfStrips()}; {_ADVICE}")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    offsets, nodes = cell_table(polydata.GetPolys())
    sizes = np.diff(offsets)
    other = np.flatnonzero((sizes != 3) & (sizes != 4))
    if len(other):
        raise MeshError(f"polygons that are no triangles or quadrilaterals: {first_ids(other + before)}; {_ADVICE}")
    places = [np.flatnonzero(sizes == k) for k in (3, 4)]
    tables = [nodes[offsets[rows][:, None] + np.arange(k)] for rows, k in zip(places, (3, 4), strict=True)]
    rows = np.concatenate(places) + before
    data = polydata.GetCellData()
    arrays = (data.GetArray(number) for number in range(data.GetNumberOfArrays()))
    tags = {array.GetName(): vtk_to_numpy(array)[rows] for array in arrays if array is not None and array.GetName()}
    whole = {name: values for name, values in tags.items() if values.ndim == 1 and values.dtype.kind in "iu"}
    return SurfaceMesh(points_of(polydata), Faces(*tables), cell_data=whole, rows=rows)


def to_vtk(polydata: Any, mesh: SurfaceMesh) -> Any:
    """A new vtkPolyData that shares cells and arrays with the one that `mesh` was made from, and has its points and
    arrays besides."""
    rows = np.arange(len(mesh.cells)) if mesh.rows is None else mesh.rows
    return updated_dataset(polydata, mesh.points, mesh.point_data, mesh.cell_data, rows)
