"""Hexahedral meshes from files and other libraries, and to files, with what a format cannot keep."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..common import OptionError, check_writable, reading, save_atomically
from ..mesh import HexMesh
from .convert import grid_from_meshio
from .formats import FORMATS, READ_EXTENSIONS, SURFACE_EXTENSIONS, WRITE_EXTENSIONS, read_contents
from .meshio_mesh import from_meshio
from .pyvista_mesh import from_pyvista, triangles

__all__ = [
    "as_hex_mesh",
    "library_of",
    "read",
    "read_surface",
    "write",
]


def as_hex_mesh(source: Any, *, other_cells: str = "refuse", linearise: bool = False) -> HexMesh:
    """Take in a mesh from whatever holds it; nothing handed in is ever changed.

    Cells of lower dimension (quadrilaterals, triangles, lines, vertices) are carried along; VTK voxels are
    taken as hexahedra, and stay so.

    Parameters
    ----------
    source
        A HexMesh, a path, a meshio.Mesh, a pyvista or VTK grid, or a tuple ``(points, cells)``.
    other_cells
        Tetrahedra, wedges, pyramids, ...: "refuse" raises, "keep" carries them along; then
        :attr:`HexMesh.held` tells their nodes, which must stay where they are.
    linearise
        Take the corners of hexahedra with 20 or 27 nodes.

    Raises
    ------
    MeshError
        If there is no hexahedron, or there are cells that cannot be worked on.
    ReadError
        If a file cannot be read.
    OptionError
        If `source` or `other_cells` is none of the above.

    Examples
    --------
    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> as_hex_mesh((CORNERS, [range(8)]))
    HexMesh(8 points, 1 hexahedra)
    """
    if other_cells not in ("refuse", "keep"):
        raise OptionError(f"other_cells must be 'refuse' or 'keep', not {other_cells!r}")
    if isinstance(source, HexMesh):
        return source
    if isinstance(source, (str, os.PathLike)):
        return read(Path(source), other_cells=other_cells, linearise=linearise)
    if isinstance(source, tuple) and len(source) == 2:
        return HexMesh(*source)
    library = library_of(source)
    if library == "meshio":
        return from_meshio(source, other_cells, linearise)
    if library == "pyvista":
        return from_pyvista(source, other_cells, linearise)
    raise OptionError(
        f"cannot make a mesh of {type(source).__name__}: give a path, a meshio.Mesh, a pyvista grid, a HexMesh, "
        "or a tuple (points, cells)"
    )


def library_of(mesh: Any) -> str:
    """The library that an object is of: "meshio", "pyvista" (or VTK), or "" for any other."""
    # By the names of modules, so that neither library is imported to find that an object is not of it.
    libraries = {base.__module__.partition(".")[0] for base in type(mesh).__mro__}
    if "meshio" in libraries:
        return "meshio"
    return "pyvista" if libraries & {"pyvista", "vtkmodules"} else ""


def read(path: str | os.PathLike[str], *, other_cells: str = "refuse", linearise: bool = False) -> HexMesh:
    """Read a mesh; the extension tells the format.

    Parameters
    ----------
    path
        A file with one of `READ_EXTENSIONS`.
    other_cells, linearise
        As in :func:`hexconformal.as_hex_mesh`.

    Raises
    ------
    ReadError
        If the file is missing, empty, truncated, malformed, of an unknown format, or needs a package that is
        not installed. Text formats that do not state their counts (.inp, .bdf) cannot show that lines are missing.
    MeshError
        If the file is sound, but holds no hexahedra, or cells that were to be refused.

    Examples
    --------
    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> write("cube.vtu", HexMesh(CORNERS, [range(8)]))
    []
    >>> read("cube.vtu")
    HexMesh(8 points, 1 hexahedra)
    """
    path = Path(path)
    with reading(path, READ_EXTENSIONS) as extension:
        contents = read_contents(path, extension)
        take_in = from_meshio if library_of(contents.data) == "meshio" else from_pyvista
        mesh = take_in(contents.data, other_cells, linearise, contents.file)
        held = mesh.held.copy()
        if contents.held is not None:
            held[contents.held] = True
        selection = replace(mesh.origin.selection, held=held, notes=(*mesh.notes, *contents.notes))
        return replace(mesh, origin=replace(mesh.origin, selection=selection))


def read_surface(path: str | os.PathLike[str]) -> Any:
    """Read a surface: the faces in a file, or the skin of the solid cells if it holds any.

    Parameters
    ----------
    path
        A file with one of `SURFACE_EXTENSIONS`.

    Returns
    -------
    A pyvista.PolyData of triangles, without coincident points.

    Raises
    ------
    ReadError
        If the file is missing, empty, truncated, malformed, or of an unknown format.
    MeshError
        If the file is sound, but holds no faces.

    Examples
    --------
    >>> import pyvista
    >>> pyvista.Cube().save("cube.stl")
    >>> surface = read_surface("cube.stl")
    >>> surface.n_cells, surface.n_points
    (12, 8)
    """
    path = Path(path)
    with reading(path, SURFACE_EXTENSIONS) as extension:
        data = read_contents(path, extension).data
        return triangles(grid_from_meshio(data)[0] if library_of(data) == "meshio" else data)


def write(path: str | os.PathLike[str], mesh: Any) -> list[str]:
    """Write a mesh with all it came with; the extension tells the format.

    The file appears under its name only once it is complete; a file that was there stays until then.

    Parameters
    ----------
    path
        A file with one of `WRITE_EXTENSIONS`, in a folder that exists. Gmsh files are written in the version
        (2.2 or 4.1, text or binary) the mesh was read from, otherwise as binary 2.2; VTK files in binary.
    mesh
        Anything :func:`hexconformal.as_hex_mesh` takes.

    Returns
    -------
    What the format could not keep, in words; empty if it keeps everything.

    Raises
    ------
    WriteError
        If the extension is unknown, the folder is missing or cannot be written to, the disk is full, the format
        cannot hold the mesh, or a package it needs is not installed.
    """
    path = Path(path)
    check_writable(path, WRITE_EXTENSIONS)
    whole = as_hex_mesh(mesh, other_cells="keep", linearise=True)
    return save_atomically(path, lambda target: FORMATS[path.suffix.lower()].save(target, whole))
