"""Where surfaces come in, from files and other libraries, and go out, with what a format cannot keep."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from hexconformal.common import OptionError, check_writable, reading, saving
from hexconformal.io import (
    MeshioOrigin,
    SourceFile,
    read_meshio,
    read_vtk,
    to_pyvista,
    write_meshio,
    write_vtk,
)

from ..mesh import SurfaceMesh
from .convert import carried, from_arrays, from_meshio, from_pyvista, in_runs, polydata, polygons
from .ply import read_ply, write_ply
from .polygons import read_obj, read_off, read_stl, write_obj, write_off, write_stl

__all__ = ["EXTENSIONS", "as_surface_mesh", "read", "write"]

_VTK = (".vtp", ".vtu", ".vtk")
_POLYGONS = {
    ".obj": (read_obj, write_obj),
    ".off": (read_off, write_off),
    ".ply": (read_ply, write_ply),
    ".stl": (read_stl, write_stl),
}
_GMSH = ".msh"
EXTENSIONS = tuple(sorted({*_VTK, *_POLYGONS, _GMSH}))


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
        return read(source)
    if isinstance(source, tuple) and len(source) in (2, 3):
        return from_arrays(*source)
    libraries = {base.__module__.partition(".")[0] for base in type(source).__mro__}
    if "meshio" in libraries:
        return from_meshio(source)
    if libraries & {"pyvista", "vtkmodules"}:
        return from_pyvista(source)
    raise OptionError(
        f"cannot make a surface of {type(source).__name__}: give a path, a meshio.Mesh, a pyvista surface, or a tuple "
        "(points, cells)"
    )


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
    >>> write("triangle.ply", ([[1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2]]))
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
        faces = _POLYGONS[extension][0](path)
        return from_pyvista(faces.grid(), SourceFile(path), faces.notes)


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


def _put(target: Path, surface: SurfaceMesh) -> list[str]:
    extension = target.suffix.lower()
    full = carried(surface)
    if extension == _GMSH:
        if not isinstance(full.origin, MeshioOrigin):
            mesh, lost = in_runs(to_pyvista(full)[0])
            return [*lost, *write_meshio(target, carried(from_meshio(mesh)), "gmsh")]
        return write_meshio(target, full, "gmsh")
    data, lost = to_pyvista(full)
    grid = data.cast_to_unstructured_grid()
    if extension in _POLYGONS:
        faces, others = polygons(grid)
        return [*lost, *others, *_POLYGONS[extension][1](target, faces)]
    if extension != ".vtk":
        data = grid if extension == ".vtu" else polydata(grid)
    write_vtk(target, data)
    return lost
