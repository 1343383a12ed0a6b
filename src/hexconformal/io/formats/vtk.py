"""VTK's files, read and written by VTK itself; what it only warns of, and what it would crash of, is an error here."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import ReadError, WriteError
from ..convert import to_pyvista
from ..format_tools.captured_output import captured_output, captured_vtk_messages
from ..format_tools.file_checks.memory import require_memory
from ..format_tools.file_checks.vtk_file_checks import check_last_array, check_reader_survives
from ..format_tools.file_checks.vtk_xml_checks import MOST_IMPLICIT_POINTS, check_vtk_xml, pieces_of
from ..format_tools.format import Format
from ..format_tools.meshio_files import file_head
from ..grid_cells import cell_offsets
from ..pyvista_mesh import to_polydata
from ..source_file import FileContents, SourceFile
from ..vtk_mesh import check_cell_nodes, is_grid_of_numbers

__all__ = ["CELL_IDS", "NODE_IDS", "VTK_GRID", "VTK_POLYDATA", "VTK_READ_ONLY", "write_vtk"]

NODE_IDS, CELL_IDS = "GlobalNodeId", "GlobalCellId"  # arrays by which pieces of a file know each other
_BEFORE_5, _SINCE_5 = 42, 51  # the layouts of .vtk files, as VTK's writer numbers them
_VERSION = "4.2"  # of files that came from elsewhere: most programs read no newer layout
_TEXT_DIGITS = 11
_READERS = {
    ".pvtu": ("vtkIOXML", "vtkXMLPUnstructuredGridReader"),
    ".vti": ("vtkIOXML", "vtkXMLImageDataReader"),
    ".vtk": ("vtkIOLegacy", "vtkDataSetReader"),
    ".vtp": ("vtkIOXML", "vtkXMLPolyDataReader"),
    ".vtr": ("vtkIOXML", "vtkXMLRectilinearGridReader"),
    ".vts": ("vtkIOXML", "vtkXMLStructuredGridReader"),
    ".vtu": ("vtkIOXML", "vtkXMLUnstructuredGridReader"),
}
_SHARE_READ, _SHARE_WRITTEN = 4, 6  # memory that VTK takes, over what arrays and file have


def _read(path: Path) -> FileContents:
    extension = path.suffix.lower()
    if extension == ".vtk":
        check_last_array(path)
        check_reader_survives(path)
        require_memory(_SHARE_READ * path.stat().st_size)
    else:
        require_memory(_SHARE_READ * (check_vtk_xml(path) + path.stat().st_size))
    with captured_output(), captured_vtk_messages() as messages:
        try:
            grid = _dataset(path)
        except (ImportError, MemoryError):
            raise
        except (Exception, SystemExit) as problem:
            raise ReadError(f"not a sound VTK file ({problem})") from problem
    bad = [line for line in messages if "error" in line.lower()]
    if bad:
        raise ReadError(f"the file is malformed or truncated ({bad[0].splitlines()[0]})")
    if grid is None:
        raise ReadError("the file holds no mesh, or only the beginning of one")
    if grid.IsA("vtkImageData") or grid.IsA("vtkRectilinearGrid"):
        most = max(MOST_IMPLICIT_POINTS, 1100 * path.stat().st_size)
        if grid.GetNumberOfPoints() > most:
            what = f"{grid.GetNumberOfPoints()} points, at most {most}"
            raise ReadError(f"it announces more than a file of its size can hold: {what}")
    if grid.IsA("vtkDataSet"):
        if grid.GetNumberOfPoints() == 0 or grid.GetNumberOfCells() == 0:
            raise ReadError("the file holds no mesh, or only the beginning of one")
        check_cell_nodes(grid)
        if extension == ".pvtu":
            grid = _with_nodes_once(grid)
    return FileContents(grid, SourceFile(path, "VTK", *_legacy_layout(path)))


def _dataset(path: Path) -> Any:
    """What a file holds: a grid of VTK where that tells all of it, otherwise a dataset of pyvista.

    Loading pyvista takes longer than most files.
    """
    module, name = _READERS[path.suffix.lower()]
    reader = getattr(import_module(f"vtkmodules.{module}"), name)()
    if path.suffix.lower() == ".vtk":
        for kind in ("Scalars", "ColorScalars", "Normals", "TCoords", "Vectors", "Fields", "Tensors"):
            getattr(reader, f"ReadAll{kind}On")()
    reader.SetFileName(str(path))
    reader.Update()
    dataset = reader.GetOutputDataObject(0)
    if dataset is None or is_grid_of_numbers(dataset):
        return dataset
    import pyvista as pv

    wrapped = pv.wrap(dataset)
    wrapped._restore_metadata()  # which arrays were of booleans, or complex
    return wrapped


def _with_nodes_once(grid: Any) -> Any:
    """A grid of pieces with each node once, where an array of ids tells which points are one."""
    import pyvista as pv

    grid = pv.wrap(grid)
    ids = grid.point_data.get(NODE_IDS)
    if ids is None or ids.ndim != 1 or len(np.unique(ids)) == len(ids):
        return grid
    first, place = np.unique(ids, return_index=True, return_inverse=True)[1:]
    offsets = cell_offsets(grid)
    table = np.insert(place.ravel()[grid.cell_connectivity], offsets[:-1], np.diff(offsets))
    merged = pv.UnstructuredGrid(table, grid.celltypes, grid.points[first])
    for name, values in grid.point_data.items():
        merged.point_data[name] = values[first]
    for name, values in grid.cell_data.items():
        merged.cell_data[name] = values
    for name, values in grid.field_data.items():
        merged.field_data[name] = values
    return merged


def _legacy_layout(path: Path) -> tuple[str, bool]:
    """The version of a .vtk file, and whether it is text; other formats of VTK have none that matters."""
    if path.suffix.lower() != ".vtk":
        return "", False
    match = re.match(rb"#[^\n]*Version\s+(\d\.\d)[^\n]*\n[^\n]*\n\s*(\w+)", file_head(path))
    return (match[1].decode(), match[2].upper() == b"ASCII") if match else ("", False)


def _write(target: Path, mesh: Any) -> list[str]:
    grid, lost = to_pyvista(mesh)
    if target.suffix.lower() != ".vtk":
        write_vtk(target, grid.cast_to_unstructured_grid())
        return lost
    file = getattr(mesh.origin, "file", None)
    version, as_text = ("", False) if file is None or file.format != "VTK" else (file.version, file.ascii)
    return lost + write_vtk(target, grid, version or _VERSION, as_text)


def _write_polydata(target: Path, mesh: Any) -> list[str]:
    grid, lost = to_pyvista(mesh)
    write_vtk(target, grid if grid.IsA("vtkPolyData") else to_polydata(grid.cast_to_unstructured_grid()))
    return lost


def write_vtk(target: Path, grid: Any, legacy_version: str = _VERSION, as_text: bool = False) -> list[str]:
    """Write a pyvista dataset in the format of the target's extension.

    By way of memory: on a full disk VTK's own writing crashes, or leaves half a file without a word.

    Parameters
    ----------
    target
        The file.
    grid
        The dataset.
    legacy_version, as_text
        Of a .vtk file: what its first line says, some programs read one version only, and whether it is text.

    Returns
    -------
    What could not be kept, in words.
    """
    from vtkmodules.vtkIOLegacy import vtkDataSetWriter
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

    writer: Any
    legacy = target.suffix.lower() == ".vtk"
    require_memory(_SHARE_WRITTEN * 1024 * grid.GetActualMemorySize())
    with captured_output(), captured_vtk_messages() as messages:
        grid._store_metadata()  # which arrays are of booleans, or complex
        if legacy:
            writer = vtkDataSetWriter()
            (writer.SetFileTypeToASCII if as_text else writer.SetFileTypeToBinary)()
            writer.SetFileVersion(_SINCE_5 if legacy_version.startswith("5") else _BEFORE_5)
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
    data = text if isinstance(text, bytes) else text.encode()
    if legacy and not legacy_version.startswith("5"):
        data = data.replace(f" {_VERSION}\n".encode(), f" {legacy_version}\n".encode(), 1)
    if not (legacy and as_text):
        target.write_bytes(data)
        return []
    target.write_bytes(_with_all_digits(data, np.asarray(grid.points)))
    short = [
        f"digits of the {what} array {name!r} beyond the {_TEXT_DIGITS} of VTK's text"
        for what, arrays in (("point", grid.point_data), ("cell", grid.cell_data))
        for name in arrays
        if _has_more_digits(np.asarray(arrays[name]))
    ]
    return short


def _with_all_digits(data: bytes, points: NDArray[Any]) -> bytes:
    """The bytes of a legacy text file with all digits of its points: VTK writes some only."""
    match = re.search(rb"\nPOINTS \d+ \w+\n", data)
    if match is None:
        return data
    end = re.compile(rb"\n(?=[A-Z])").search(data, match.end())
    rows = "\n".join(" ".join(map(repr, row)) for row in points.tolist()).encode()
    return data[: match.end()] + rows + (b"\n" if end is None else data[end.start() :])


def _has_more_digits(array: NDArray[Any]) -> bool:
    if array.dtype != np.float64:
        return False
    numbers = np.unique(array[np.isfinite(array)])
    return any(float(f"{number:.{_TEXT_DIGITS}g}") != number for number in numbers.tolist())


VTK_GRID = Format("VTK", _read, _write)
VTK_READ_ONLY = Format("VTK", _read, files_named=pieces_of)
VTK_POLYDATA = Format("VTK", _read, _write_polydata)
