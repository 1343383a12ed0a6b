"""Where hexahedral meshes come in, from files and other libraries, and go out, with what a format cannot keep."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..common import OptionError, check_writable, reading, saving
from ..mesh import HexMesh
from .convert import grid_from_meshio, to_pyvista
from .formats.meshio_formats import read_meshio, write_meshio
from .formats.vtk_files import read_vtk, write_vtk
from .meshio_mesh import from_meshio
from .pyvista_mesh import from_pyvista, triangles

__all__ = [
    "READ_EXTENSIONS",
    "SURFACE_EXTENSIONS",
    "WRITE_EXTENSIONS",
    "as_hex_mesh",
    "read",
    "read_surface",
    "write",
]

_VTK = (".vtu", ".vtk")
_VTK_READ_ONLY = (".vts", ".vtr", ".vti", ".pvtu")
_MESHIO = {
    ".msh": "gmsh",
    ".inp": "abaqus",
    ".mesh": "medit",
    ".meshb": "medit",
    ".e": "exodus",
    ".exo": "exodus",
    ".ex2": "exodus",
    ".med": "med",
    ".xdmf": "xdmf",
    ".xmf": "xdmf",
    ".bdf": "nastran",
    ".nas": "nastran",
    ".fem": "nastran",
}
_MESHIO_READ_ONLY = {
    ".avs": "avsucd",
    ".cgns": "cgns",
    ".dat": "tecplot",
    ".f3grid": "flac3d",
    ".h5m": "h5m",
    ".mdpa": "mdpa",
    ".su2": "su2",
    ".tec": "tecplot",
    ".ugrid": "ugrid",
    ".vol": "netgen",
}
_VTK_SURFACES = (".obj", ".stl", ".vtp")
_MESHIO_SURFACES = {".off": "off", ".ply": "ply"}  # VTK crashes on truncated .ply files

READ_EXTENSIONS = tuple(sorted({*_VTK, *_VTK_READ_ONLY, *_MESHIO, *_MESHIO_READ_ONLY}))
WRITE_EXTENSIONS = tuple(sorted({*_VTK, *_MESHIO}))
SURFACE_EXTENSIONS = tuple(sorted({*READ_EXTENSIONS, *_VTK_SURFACES, *_MESHIO_SURFACES}))


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
    # Asked by name, so that neither library is imported to tell that an object is not one of its own.
    libraries = {base.__module__.partition(".")[0] for base in type(source).__mro__}
    if "meshio" in libraries:
        return from_meshio(source, other_cells, linearise)
    if libraries & {"pyvista", "vtkmodules"}:
        return from_pyvista(source, other_cells, linearise)
    raise OptionError(
        f"cannot make a mesh of {type(source).__name__}: give a path, a meshio.Mesh, a pyvista grid, a HexMesh, "
        "or a tuple (points, cells)"
    )


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
        return _read(path, extension, other_cells, linearise)


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
        return _read_surface(path, extension)


def _read(path: Path, extension: str, other_cells: str, linearise: bool) -> HexMesh:
    if extension in _VTK + _VTK_READ_ONLY:
        grid, file = read_vtk(path)
        return from_pyvista(grid, other_cells, linearise, file)
    mesh, file, notes = read_meshio(path, {**_MESHIO, **_MESHIO_READ_ONLY}[extension])
    result = from_meshio(mesh, other_cells, linearise, file)
    selection = replace(result.origin.selection, notes=(*result.notes, *notes))
    return replace(result, origin=replace(result.origin, selection=selection))


def _read_surface(path: Path, extension: str) -> Any:
    if extension in _VTK + _VTK_READ_ONLY + _VTK_SURFACES:
        return triangles(read_vtk(path)[0])
    names = {**_MESHIO, **_MESHIO_READ_ONLY, **_MESHIO_SURFACES}
    return triangles(grid_from_meshio(read_meshio(path, names[extension])[0])[0])


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
    return saving(path, lambda target: _writer(path.suffix.lower())(target, whole))


def _writer(extension: str) -> Callable[[Path, HexMesh], list[str]]:
    if extension in _VTK:

        def write_grid(target: Path, mesh: HexMesh) -> list[str]:
            grid, lost = to_pyvista(mesh)
            write_vtk(target, grid if extension == ".vtk" else grid.cast_to_unstructured_grid())
            return lost

        return write_grid
    return lambda target, mesh: write_meshio(target, mesh, _MESHIO[extension])
