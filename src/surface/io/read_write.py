"""Surfaces from files and other libraries, and to files, with what a format cannot keep."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from hexconformal.common import OptionError, check_writable, reading, save_atomically
from hexconformal.io import FORMATS, SURFACES_ONLY, MeshioOrigin, library_of, read_contents, to_pyvista

from ..mesh import SurfaceMesh
from .convert import (
    from_arrays,
    from_meshio,
    from_pyvista,
    meshio_in_cell_order,
    with_library_origin,
)

__all__ = ["EXTENSIONS", "as_surface_mesh", "read", "write"]

_GMSH = ".msh"
EXTENSIONS = tuple(sorted((_GMSH, ".vtk", ".vtu", *SURFACES_ONLY)))


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
    library = library_of(source)
    if library == "meshio":
        return from_meshio(source)
    if library == "pyvista":
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
        contents = read_contents(path, extension)
        if library_of(contents.data) == "meshio":
            return from_meshio(contents.data, contents.file, contents.notes)
        return from_pyvista(contents.data, contents.file, contents.notes)


def write(path: str | os.PathLike[str], mesh: Any) -> list[str]:
    """Write a surface, with all it came with; the extension tells the format.

    The file appears under its name only once it is complete; a file that was there stays until then.

    Parameters
    ----------
    path
        A file with one of `EXTENSIONS`, in a folder that exists. All but .obj, .off, and .ply with arrays on faces, are
        binary; a file of the same format that the mesh came from is written as it came, with other coordinates.
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
    return save_atomically(path, lambda target: _save(target, surface))


def _save(target: Path, surface: SurfaceMesh) -> list[str]:
    lost: list[str] = []
    mesh = with_library_origin(surface)
    extension = target.suffix.lower()
    if extension == _GMSH and not isinstance(mesh.origin, MeshioOrigin):
        ordered, lost = meshio_in_cell_order(to_pyvista(mesh)[0])
        mesh = with_library_origin(from_meshio(ordered))
    return [*lost, *FORMATS[extension].save(target, mesh)]
