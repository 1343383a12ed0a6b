"""Surface files: read safely, written completely or not at all, and what a format cannot keep is said."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from hexconformal.convert import to_pyvista
from hexconformal.errors import MeshError, ReadError
from hexconformal.files import check_writable, reading, saving
from hexconformal.meshio_mesh import MeshioOrigin
from hexconformal.parsers import read_meshio, read_vtk, write_meshio, write_vtk
from hexconformal.pyvista_mesh import cell_offsets
from hexconformal.selection import SourceFile

from .mesh import SurfaceMesh, as_surface_mesh, carried, from_meshio, from_pyvista
from .ply import read_ply, write_ply
from .polygons import Polygons, read_obj, read_off, read_stl, write_obj, write_off, write_stl

__all__ = ["EXTENSIONS", "as_pyvista", "read", "write"]

_VTK = (".vtp", ".vtu", ".vtk")
_POLYGONS = {
    ".obj": (read_obj, write_obj),
    ".off": (read_off, write_off),
    ".ply": (read_ply, write_ply),
    ".stl": (read_stl, write_stl),
}
_GMSH = ".msh"
EXTENSIONS = tuple(sorted({*_VTK, *_POLYGONS, _GMSH}))

_TYPES = {1: "vertex", 3: "line", 5: "triangle", 9: "quad"}


def read(path: str | os.PathLike[str]) -> SurfaceMesh:
    """Read a surface; the extension tells the format.

    An .stl file knows no shared nodes: its equal points are joined. The order of cells is kept.

    Parameters
    ----------
    path
        A file with one of `EXTENSIONS`.

    Raises
    ------
    ReadError
        If the file is missing, empty, truncated, malformed, or of an unknown format.
    MeshError
        If it is sound, but holds no surface, or other cells besides.

    Examples
    --------
    >>> write("triangle.ply", (np.eye(3), [[0, 1, 2]]))
    []
    >>> read("triangle.ply")
    SurfaceMesh(3 points, 1 triangles, 0 quadrilaterals)
    """
    path = Path(path)
    with reading(path, EXTENSIONS) as extension:
        if extension in _VTK:
            return from_pyvista(*read_vtk(path))
        if extension == _GMSH:
            mesh, file, notes = read_meshio(path, "gmsh")
            return from_meshio(mesh, file, tuple(notes))
        try:
            polygons = _POLYGONS[extension][0](path)
        except (MeshError, OSError, MemoryError):
            raise
        except Exception as problem:
            raise ReadError(f"not a sound {extension} file ({type(problem).__name__}: {problem})") from problem
        return from_pyvista(polygons.grid(), SourceFile(path), polygons.notes)


def write(path: str | os.PathLike[str], mesh: Any) -> list[str]:
    """Write a surface, with all it came with; the extension tells the format.

    The file appears under its name only once it is complete; a file that was there stays until then.

    Parameters
    ----------
    path
        A file with one of `EXTENSIONS`, in a folder that exists. All but .obj and .off are binary.
    mesh
        Anything :func:`surface.as_surface_mesh` takes.

    Returns
    -------
    What the format could not keep, in words; empty if it keeps everything.

    Raises
    ------
    WriteError
        If the extension is unknown, the folder is missing or cannot be written to, the disk is full, or the format
        cannot hold the mesh (quadrilaterals in .stl).
    """
    path = Path(path)
    check_writable(path, EXTENSIONS)
    surface = as_surface_mesh(mesh)
    return saving(path, lambda target: _put(target, surface))


def as_pyvista(mesh: SurfaceMesh) -> Any:
    """A new unstructured grid of pyvista that holds all of a surface."""
    return to_pyvista(carried(mesh))[0].cast_to_unstructured_grid()


def _put(target: Path, surface: SurfaceMesh) -> list[str]:
    extension = target.suffix.lower()
    full = carried(surface)
    if extension == _GMSH:
        if not isinstance(full.origin, MeshioOrigin):
            mesh, lost = _in_runs(to_pyvista(full)[0])
            return [*lost, *write_meshio(target, carried(from_meshio(mesh)), "gmsh")]
        return write_meshio(target, full, "gmsh")
    data, lost = to_pyvista(full)
    grid = data.cast_to_unstructured_grid()
    if extension in _POLYGONS:
        polygons, others = _polygons(grid)
        return [*lost, *others, *_POLYGONS[extension][1](target, polygons)]
    if extension != ".vtk":
        data = grid if extension == ".vtu" else _polydata(grid)
    write_vtk(target, data)
    return lost


def _ragged(grid: Any, rows: Any) -> tuple[Any, Any]:
    """Sizes of some cells, and their nodes in a row."""
    offsets = cell_offsets(grid)
    sizes = np.diff(offsets)[rows]
    places = np.repeat(offsets[rows] - np.cumsum(sizes) + sizes, sizes) + np.arange(int(sizes.sum()))
    return sizes, np.asarray(grid.cell_connectivity, dtype=np.int64)[places]


def _polygons(grid: Any) -> tuple[Polygons, list[str]]:
    """The faces of a grid in their order, and what is left out."""
    face = np.isin(grid.celltypes, (5, 9))
    rows = np.flatnonzero(face)
    point_data = {name: np.asarray(grid.point_data[name]) for name in grid.point_data}
    cell_data = {name: np.asarray(grid.cell_data[name])[rows] for name in grid.cell_data}
    lost = [f"field data {name!r}" for name in grid.field_data]
    if not face.all():
        lost.append(f"{int((~face).sum())} vertices and lines")
    return Polygons(np.asarray(grid.points, np.float64), *_ragged(grid, rows), point_data, cell_data), lost


def _polydata(grid: Any) -> Any:
    """PolyData, which has vertices first, then lines, then faces in their order."""
    import pyvista as pv

    places = [np.flatnonzero(np.isin(grid.celltypes, codes)) for codes in ((1, 2), (3, 4), (5, 9))]
    parts = []
    for rows in places:
        sizes, nodes = _ragged(grid, rows)
        parts.append(np.insert(nodes, np.cumsum(sizes) - sizes, sizes) if len(rows) else None)
    verts, lines, faces = parts
    result = pv.PolyData(np.array(grid.points), faces=faces, lines=lines, verts=verts)
    order = np.concatenate(places)
    for name in grid.point_data:
        result.point_data.set_array(np.asarray(grid.point_data[name]), name)
    for name in grid.cell_data:
        result.cell_data.set_array(np.asarray(grid.cell_data[name])[order], name)
    for name in grid.field_data:
        result.field_data.set_array(grid.field_data[name], name)
    return result


def _in_runs(grid: Any) -> tuple[Any, list[str]]:
    """A meshio.Mesh with a block for every run of cells of one type, which keeps their order, and what is left out."""
    import meshio

    grid = grid.cast_to_unstructured_grid()
    types = grid.celltypes
    rows = np.flatnonzero(np.isin(types, list(_TYPES)))
    lost = [f"field data {name!r}" for name in grid.field_data]
    if len(rows) < len(types):
        lost.append(f"{len(types) - len(rows)} lines and vertices of several points in one cell")
    runs = np.split(rows, np.flatnonzero(np.diff(types[rows])) + 1)
    blocks = [(_TYPES[int(types[run[0]])], _ragged(grid, run)[1].reshape(len(run), -1)) for run in runs]
    mesh = meshio.Mesh(
        np.array(grid.points, dtype=np.float64),
        blocks,
        point_data={name: np.array(grid.point_data[name]) for name in grid.point_data},
        cell_data={name: [np.asarray(grid.cell_data[name])[run] for run in runs] for name in grid.cell_data},
    )
    return mesh, lost
