"""VTK's files, read and written by VTK itself; what it only warns of, and what it would crash of, is an error here."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from ...common import ReadError, WriteError
from ..convert import to_pyvista
from ..format_tools.captured_output import captured_output, captured_vtk_messages
from ..format_tools.format import Format
from ..format_tools.meshio_files import file_head
from ..format_tools.vtk_file_checks import check_counts, check_last_array, check_reader_survives
from ..pyvista_mesh import check_cell_nodes, to_polydata
from ..source_file import FileContents, SourceFile

__all__ = ["VTK_GRID", "VTK_POLYDATA", "VTK_READ_ONLY", "write_vtk"]

_OLDEST, _NEWEST = 42, 51  # the layouts of .vtk files, as VTK's writer numbers them


def _read(path: Path) -> FileContents:
    import pyvista as pv

    if path.suffix.lower() == ".vtk":
        check_last_array(path)
        check_reader_survives(path)
    else:
        check_counts(path)
    with captured_output(), captured_vtk_messages() as messages:
        try:
            grid = pv.read(path)
        except (ImportError, MemoryError):
            raise
        except (Exception, SystemExit) as problem:
            raise ReadError(f"not a sound VTK file ({problem})") from problem
    bad = [line for line in messages if "error" in line.lower()]
    if bad:
        raise ReadError(f"the file is malformed or truncated ({bad[0].splitlines()[0]})")
    if isinstance(grid, pv.DataSet):
        if grid.n_points == 0 or grid.n_cells == 0:
            raise ReadError("the file holds no mesh, or only the beginning of one")
        check_cell_nodes(grid)
    return FileContents(grid, SourceFile(path, "VTK", version=_legacy_version(path)))


def _legacy_version(path: Path) -> str:
    """The version of a .vtk file; other formats of VTK have none that matters."""
    if path.suffix.lower() != ".vtk":
        return ""
    match = re.match(rb"#[^\n]*Version\s+([\d.]+)", file_head(path))
    return match[1].decode() if match else ""


def _write(target: Path, mesh: Any) -> list[str]:
    grid, lost = to_pyvista(mesh)
    if target.suffix.lower() != ".vtk":
        write_vtk(target, grid.cast_to_unstructured_grid())
        return lost
    version = getattr(getattr(mesh.origin, "file", None), "version", "")
    # Most programs read no newer layout than that of VTK before 5, so it is left only for those that came in a newer.
    write_vtk(target, grid, _NEWEST if version.startswith("5") else _OLDEST)
    return lost


def _write_polydata(target: Path, mesh: Any) -> list[str]:
    grid, lost = to_pyvista(mesh)
    write_vtk(target, grid if grid.IsA("vtkPolyData") else to_polydata(grid.cast_to_unstructured_grid()))
    return lost


def write_vtk(target: Path, grid: Any, legacy_version: int = _OLDEST) -> None:
    """Write a pyvista dataset in the format of the target's extension.

    By way of memory: on a full disk VTK's own writing crashes, or leaves half a file without a word.
    """
    from vtkmodules.vtkIOLegacy import vtkDataSetWriter
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

    writer: Any
    legacy = target.suffix.lower() == ".vtk"
    with captured_output(), captured_vtk_messages() as messages:
        grid._store_metadata()  # which arrays are of booleans, or complex
        if legacy:
            writer = vtkDataSetWriter()
            writer.SetFileTypeToBinary()  # its text has 11 digits of a number
            writer.SetFileVersion(legacy_version)
        else:
            writer = (vtkXMLPolyDataWriter if grid.IsA("vtkPolyData") else vtkXMLUnstructuredGridWriter)()
            writer.SetDataModeToBinary()
            writer.SetCompressorTypeToZLib()
        writer.SetInputData(grid)
        writer.WriteToOutputStringOn()
        writer.Write()
        text: str | bytes = writer.GetOutputStdString() if legacy else writer.GetOutputString()
    bad = [line for line in messages if "error" in line.lower()]
    if bad:
        raise WriteError(bad[0].splitlines()[0])
    target.write_bytes(text if isinstance(text, bytes) else text.encode())


VTK_GRID = Format("VTK", (".vtk", ".vtu"), _read, _write)
VTK_READ_ONLY = Format("VTK", (".pvtu", ".vti", ".vtr", ".vts"), _read)
VTK_POLYDATA = Format("VTK", (".vtp",), _read, _write_polydata, surfaces_only=True)
