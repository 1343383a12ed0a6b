"""VTK's files, read and written by VTK itself; what it only warns of, and what it would crash of, is an error here."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...common import ReadError, WriteError
from ..selection import SourceFile
from .silence import quiet, vtk_messages
from .vtk_file_checks import require_announced, require_cells, require_survival, require_whole

__all__ = ["read_vtk", "write_vtk"]


def read_vtk(path: Path) -> tuple[Any, SourceFile]:
    """Read a VTK file; what VTK only warns of is an error here."""
    import pyvista as pv

    if path.suffix.lower() == ".vtk":
        require_whole(path)
        require_survival(path)
    elif path.suffix.lower().startswith((".vt", ".pvt")):
        require_announced(path)
    with quiet(), vtk_messages() as messages:
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
        require_cells(grid)
    return grid, SourceFile(path)


def write_vtk(target: Path, grid: Any) -> None:
    """Write a pyvista dataset in the format of the target's extension, byte for byte what grid.save() writes.

    By way of memory: on a full disk VTK's own writing crashes, or leaves half a file without a word.
    """
    from vtkmodules.vtkIOLegacy import vtkDataSetWriter
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

    writer: Any
    legacy = target.suffix.lower() == ".vtk"
    with quiet(), vtk_messages() as messages:
        grid._store_metadata()  # which arrays are of booleans, or complex
        if legacy:
            writer = vtkDataSetWriter()
            writer.SetFileTypeToBinary()
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
