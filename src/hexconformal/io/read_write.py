"""Meshes from files and other libraries, and to files, with what a format cannot keep."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..common import MeshError, OptionError, check_writable, reading, save_atomically
from ..elements import SOLID_TYPES
from ..mesh import HexMesh, MixedMesh, blocks_of, counts_by_type
from .convert import grid_from_meshio
from .formats import FORMATS, READ_EXTENSIONS, SURFACE_EXTENSIONS, WRITE_EXTENSIONS, read_contents
from .meshio_mesh import MeshioOrigin, from_meshio, meshio_from_arrays
from .pyvista_mesh import from_pyvista, triangles_of
from .selection import HEXAHEDRA

__all__ = [
    "as_hex_mesh",
    "as_volume_mesh",
    "library_of",
    "read",
    "read_surface",
    "write",
]


def as_hex_mesh(source: Any, *, other_cells: str = "refuse", linearize: bool = False) -> HexMesh:
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
    linearize
        Take the corners of hexahedra with 20 or 27 nodes; of a mesh as :func:`as_volume_mesh` returns it, too.

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
    return _only_hexahedra(_taken_in(source, other_cells, linearize, HEXAHEDRA))


def as_volume_mesh(source: Any, *, other_cells: str = "refuse", linearize: bool = False) -> HexMesh | MixedMesh:
    """Take in a mesh of hexahedra, wedges, pyramids and tetrahedra, linear or quadratic, and change nothing of it.

    Parameters
    ----------
    source
        What :func:`as_hex_mesh` takes, a MixedMesh, or ``(points, cells)`` with cells by the name of their type.
    other_cells
        Solid cells of other types, such as polyhedra: "refuse" raises, "keep" carries them along.
    linearize
        Take the corners of cells of second order, which otherwise stay as they are.

    Returns
    -------
    A HexMesh if all of its cells are linear hexahedra, otherwise a MixedMesh.

    Raises
    ------
    MeshError
        If there is no cell of these types, or there are solid cells of others.
    ReadError
        If a file cannot be read.
    OptionError
        If `source` or `other_cells` is none of the above.

    Examples
    --------
    >>> from hexconformal.elements import TETRAHEDRON
    >>> as_volume_mesh((TETRAHEDRON.ideal, {"tetra": [[0, 1, 2, 3]]}))
    MixedMesh(4 points, 1 tetrahedron)
    """
    return _taken_in(source, other_cells, linearize, tuple(SOLID_TYPES))


def _taken_in(source: Any, other_cells: str, linearize: bool, types: Collection[str]) -> HexMesh | MixedMesh:
    if other_cells not in ("refuse", "keep"):
        raise OptionError(f"other_cells must be 'refuse' or 'keep', not {other_cells!r}")
    if isinstance(source, HexMesh | MixedMesh):
        return _by_corners(source, other_cells, types) if linearize else source
    if isinstance(source, (str, os.PathLike)):
        return _read(Path(source), other_cells, linearize, types)
    if isinstance(source, tuple) and len(source) == 2:
        points, cells = source
        if not isinstance(cells, Mapping):
            if getattr(cells, "shape", ())[1:] in ((4,), (5,), (6,)):
                advice = "give others by the name of their type, (points, {'tetra': cells})"
                raise MeshError(f"cells must be an (m, 8) array of hexahedra, not {cells.shape}; {advice}")
            return HexMesh(points, cells)
        if set(cells) == set(HEXAHEDRA):
            return HexMesh(points, *cells.values())
        mesh = MixedMesh.of_types(points, cells)
        return _by_corners(mesh, other_cells, types) if linearize else mesh
    library = library_of(source)
    if library == "meshio":
        return from_meshio(source, other_cells, linearize, types=types)
    if library == "pyvista":
        return from_pyvista(source, other_cells, linearize, types=types)
    raise OptionError(
        f"cannot make a mesh of {type(source).__name__}: give a path, a meshio.Mesh, a pyvista grid, a HexMesh, "
        "or a tuple (points, cells)"
    )


def _by_corners(mesh: HexMesh | MixedMesh, other_cells: str, types: Collection[str]) -> HexMesh | MixedMesh:
    """The mesh with the corners of its quadratic cells; itself if it has none."""
    if not _is_curved(mesh):
        return mesh
    if mesh.origin is None:
        return from_meshio(meshio_from_arrays(mesh), other_cells, True, types=types)
    take_in = from_meshio if isinstance(mesh.origin, MeshioOrigin) else from_pyvista
    return take_in(mesh.origin.updated_source(mesh), other_cells, True, mesh.origin.file, types)


def _only_hexahedra(mesh: HexMesh | MixedMesh) -> HexMesh:
    if isinstance(mesh, MixedMesh):
        advice = "; linearize=True (--linearize) takes quadratic ones by their corners" if _is_curved(mesh) else ""
        raise MeshError(f"a mesh must be of hexahedra alone here, and has {counts_by_type(mesh.blocks)}{advice}")
    return mesh


def _is_curved(mesh: HexMesh | MixedMesh) -> bool:
    return any(block.cell_type.straight for block in blocks_of(mesh))


def library_of(mesh: Any) -> str:
    """The library that an object is of: "meshio", "pyvista" (or VTK), or "" for any other."""
    # By the names of modules, so that neither library is imported to find that an object is not of it.
    libraries = {base.__module__.partition(".")[0] for base in type(mesh).__mro__}
    if "meshio" in libraries:
        return "meshio"
    return "pyvista" if libraries & {"pyvista", "vtkmodules"} else ""


def read(path: str | os.PathLike[str], *, other_cells: str = "refuse", linearize: bool = False) -> HexMesh:
    """Read a mesh; the extension tells the format.

    Parameters
    ----------
    path
        A file with one of `READ_EXTENSIONS`.
    other_cells, linearize
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
    return _only_hexahedra(_read(Path(path), other_cells, linearize, HEXAHEDRA))


def _read(path: Path, other_cells: str, linearize: bool, types: Collection[str]) -> HexMesh | MixedMesh:
    with reading(path, READ_EXTENSIONS) as extension:
        contents = read_contents(path, extension)
        take_in = from_meshio if library_of(contents.data) == "meshio" else from_pyvista
        mesh = take_in(contents.data, other_cells, linearize, contents.file, types)
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
        return triangles_of(grid_from_meshio(data)[0] if library_of(data) == "meshio" else data)


def write(path: str | os.PathLike[str], mesh: Any) -> list[str]:
    """Write a mesh with all it came with; the extension tells the format.

    The file appears under its name only once it is complete; a file that was there stays until then.

    Parameters
    ----------
    path
        A file with one of `WRITE_EXTENSIONS`, in a folder that exists. Files that carry a model are written as
        they came, with other coordinates; other Gmsh files as binary 2.2, other .vtk files as binary 4.2.
    mesh
        Anything :func:`hexconformal.as_volume_mesh` takes.

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
    whole = as_volume_mesh(mesh, other_cells="keep")
    return save_atomically(path, lambda target: FORMATS[path.suffix.lower()].save(target, whole))
