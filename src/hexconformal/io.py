"""Files: reading and writing meshes safely, and saying what a format cannot keep."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from hexconformal.errors import MeshError, ReadError, WriteError
from hexconformal.mesh import HexMesh

__all__ = [
    "READ_EXTENSIONS",
    "SURFACE_EXTENSIONS",
    "WRITE_EXTENSIONS",
    "check_writable",
    "read",
    "read_surface",
    "saving",
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
_WITH_COMPANION = (".xdmf", ".xmf")  # numbers go into an .h5 file beside them
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

_MISSING = "{} files need an optional package: pip install 'hexconformal[formats]' ({})"


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
    >>> from hexconformal.elements import CORNERS
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


@contextmanager
def reading(path: Path, extensions: tuple[str, ...]) -> Iterator[str]:
    """The extension of a file that is there and can be opened; what goes wrong becomes a readable error."""
    extension = path.suffix.lower()
    if path.is_dir():
        raise ReadError(f"{path} is a folder, not a mesh file")
    if not path.exists():
        raise ReadError(f"{path} does not exist")
    if extension not in extensions:
        raise ReadError(f"{path}: unknown extension {extension or '(none)'}; known are {' '.join(extensions)}")
    try:
        if path.stat().st_size == 0:
            raise ReadError("the file is empty")
        with path.open("rb"):
            pass
        yield extension
    except ReadError as problem:
        raise ReadError(f"cannot read {path}: {problem}") from problem
    except MeshError as problem:
        raise MeshError(f"{path}: {problem}") from problem
    except ImportError as problem:
        raise ReadError(f"cannot read {path}: {_MISSING.format(extension, problem)}") from problem
    except (OSError, MemoryError) as problem:
        raise ReadError(f"cannot read {path}: {problem}") from problem


def _read(path: Path, extension: str, other_cells: str, linearise: bool) -> HexMesh:
    from hexconformal import meshio_mesh, pyvista_mesh
    from hexconformal.parsers import read_meshio, read_vtk

    if extension in _VTK + _VTK_READ_ONLY:
        grid, file = read_vtk(path)
        return pyvista_mesh.from_pyvista(grid, other_cells, linearise, file)
    mesh, file, notes = read_meshio(path, {**_MESHIO, **_MESHIO_READ_ONLY}[extension])
    result = meshio_mesh.from_meshio(mesh, other_cells, linearise, file)
    selection = replace(result.origin.selection, notes=(*result.notes, *notes))
    return replace(result, origin=replace(result.origin, selection=selection))


def _read_surface(path: Path, extension: str) -> Any:
    from hexconformal.convert import grid_from_meshio
    from hexconformal.parsers import read_meshio, read_vtk
    from hexconformal.pyvista_mesh import triangles

    if extension in _VTK + _VTK_READ_ONLY + _VTK_SURFACES:
        return triangles(read_vtk(path)[0])
    names = {**_MESHIO, **_MESHIO_READ_ONLY, **_MESHIO_SURFACES}
    return triangles(grid_from_meshio(read_meshio(path, names[extension])[0])[0])


def write(path: str | os.PathLike[str], mesh: HexMesh) -> list[str]:
    """Write a mesh with all it came with; the extension tells the format.

    The file appears under its name only once it is complete; a file that was there stays until then.

    Parameters
    ----------
    path
        A file with one of `WRITE_EXTENSIONS`, in a folder that exists. Gmsh files are written in the version
        (2.2 or 4.1, text or binary) the mesh was read from, otherwise as binary 2.2; VTK files in binary.
    mesh
        What to write.

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
    check_writable(path)
    return saving(path, lambda target: _writer(path.suffix.lower())(target, mesh))


def _writer(extension: str) -> Callable[[Path, HexMesh], list[str]]:
    from hexconformal.convert import to_pyvista
    from hexconformal.parsers import write_meshio, write_vtk

    if extension in _VTK:

        def write_grid(target: Path, mesh: HexMesh) -> list[str]:
            grid, lost = to_pyvista(mesh)
            write_vtk(target, grid if extension == ".vtk" else grid.cast_to_unstructured_grid())
            return lost

        return write_grid
    return lambda target, mesh: write_meshio(target, mesh, _MESHIO[extension])


def check_writable(path: str | os.PathLike[str], extensions: tuple[str, ...] = WRITE_EXTENSIONS) -> None:
    """Raise unless a file of this name can be written: meant to be called before long work.

    Raises
    ------
    WriteError
        If the extension is unknown, the folder is missing or cannot be written to, or a file that would come
        with it belongs to another.
    """
    path = Path(path)
    if path.suffix.lower() not in extensions:
        known = " ".join(extensions)
        raise WriteError(f"cannot write {path}: unknown extension {path.suffix or '(none)'}; known are {known}")
    folder = _place(path).parent
    if not folder.is_dir():
        raise WriteError(f"cannot write {path}: the folder {folder} does not exist")
    if path.is_dir():
        raise WriteError(f"cannot write {path}: it is a folder")
    if not os.access(folder, os.W_OK | os.X_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise WriteError(f"cannot write {path}: permission denied")
    companion = _place(path).with_suffix(".h5")
    if path.suffix.lower() in _WITH_COMPANION and companion.exists() and not path.exists():
        raise WriteError(f"cannot write {path}: its companion {companion.name} belongs to another file already")


def saving(path: Path, writer: Callable[[Path], list[str] | None]) -> list[str]:
    """Let `writer` make the file in a folder beside its place, then move it (and its companions) there at once."""
    place = _place(path)
    with _as_write_error(path), tempfile.TemporaryDirectory(prefix=".hexconformal-", dir=place.parent) as folder:
        target = Path(folder) / place.name
        lost = writer(target) or []
        if not target.is_file() or target.stat().st_size == 0:
            raise WriteError("nothing was written; is the disk full?")
        # The file that names the others comes last.
        files = sorted(Path(folder).iterdir(), key=lambda made: made == target)
        for made in files:
            os.replace(made, place.parent / made.name)
    return lost


def _place(path: Path) -> Path:
    # Where a link points to, so that the link stays one.
    return Path(os.path.realpath(path))


@contextmanager
def _as_write_error(path: Path) -> Iterator[None]:
    try:
        yield
    except MeshError:
        raise
    except ImportError as problem:
        raise WriteError(f"cannot write {path}: {_MISSING.format(path.suffix, problem)}") from problem
    except (Exception, SystemExit) as problem:
        raise WriteError(f"cannot write {path}: {_reason(problem)}") from problem


def _reason(problem: Any) -> str:
    return str(problem) if isinstance(problem, OSError) else f"{type(problem).__name__}: {problem}"
