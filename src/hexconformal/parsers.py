"""The readers and writers of meshio and VTK, kept from printing, exiting, guessing and losing quietly."""

from __future__ import annotations

import contextlib
import io
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from . import exodus
from .abaqus import read_deck, replaced_nodes
from .convert import to_meshio
from .errors import ReadError, WriteError
from .format_limits import GMSH_TAGS, drop_unknown_cells, drop_what_is_not_kept
from .mesh import HexMesh
from .selection import SourceFile
from .sound_files import require_announced, require_cells, require_survival, require_whole

__all__ = ["read_meshio", "read_vtk", "write_meshio", "write_vtk"]

# Formats that have the extension of another one: how they begin, and what to do.
_NAMESAKES = {
    "medit": (rb"MFEM ", "this is MFEM's own format: write it as VTK or Gmsh 2.2, or hand over points and cells"),
    "abaqus": (rb"(#.*\s+)*\d+([ \t]+\d+){4}\s*\n", "this is an AVS UCD file: give it the extension .avs"),
    "gmsh": (rb"\$NOD", "this is a Gmsh 1 file: let Gmsh save it again, in version 2.2 or 4.1"),
}
# meshio writes the last Abaqus name it knows for a type: a hybrid brick, an axisymmetric pore pressure quadrilateral.
_ABAQUS = {"C3D8RH": "C3D8", "CAX4P": "S4", "R3D3": "S3", "B33H": "B31", "C3D10MH": "C3D10", "C3D20RH": "C3D20"}


def read_meshio(path: Path, name: str) -> tuple[Any, SourceFile, list[str]]:
    """Read a file with meshio's parser of that name: the meshio.Mesh, its file, and the parser's warnings."""
    with _quiet() as said:
        from unittest import mock

        import meshio
        from meshio._helpers import reader_map

        file = SourceFile(path)
        begins, advice = _NAMESAKES.get(name, (rb"(?!)", ""))
        if re.match(rb"\s*" + begins, _head(path)):
            raise ReadError(advice)
        if name == "gmsh":
            file = _gmsh_variant(path)
            if not file.version:
                name = "ansys"
        if name == "ply" and b"end_header" not in _head(path):
            # meshio would look for it for ever.
            raise ReadError("not a sound ply file (its header has no end)")
        try:
            # meshio.read() would try several parsers, print their complaints, and exit.
            gmsh = mock.patch("meshio.gmsh._gmsh22.cell_data_from_raw", _split_cell_data)
            with gmsh, mock.patch.dict("meshio.exodus._exodus.exodus_to_meshio_type", exodus.NAMES):
                if name == "abaqus":
                    mesh, deck, notes = read_deck(path)
                    return mesh, SourceFile(path, deck=deck), notes
                mesh = reader_map[name](str(path))
        except (ImportError, MemoryError, ReadError):
            raise
        except (Exception, SystemExit) as problem:
            reason = f"{type(problem).__name__}: {problem}" if str(problem) else "malformed"
            if name == "exodus" and isinstance(problem, KeyError):
                reason = f"elements of type {problem} are not known"
            known = "gmsh or ansys" if name == "ansys" else name
            raise ReadError(f"not a sound {known} file ({reason})") from problem
    if not isinstance(mesh, meshio.Mesh) or len(mesh.points) == 0 or not sum(len(block.data) for block in mesh.cells):
        raise ReadError(f"the {name} file holds no mesh, or only the beginning of one")
    if name == "exodus":
        mesh.cells = exodus.to_vtk(mesh.cells)
    return mesh, file, [line for line in said.getvalue().splitlines() if line.strip()]


def write_meshio(target: Path, mesh: HexMesh, name: str) -> list[str]:
    """Write with meshio's writer of that name; returns what the format could not keep."""
    out, lost = to_meshio(mesh)
    file = getattr(mesh.origin, "file", None)
    if name == "abaqus" and file is not None and file.deck:
        if np.array_equal(mesh.cells, mesh.origin.selection.cells):
            lost += drop_what_is_not_kept(out, name)
            target.write_text(replaced_nodes(file.deck, out.points), encoding="utf-8", errors="surrogateescape")
            return lost
        lost.append("all of the deck but nodes, elements and sets, because the node order of elements changed")
    lost += drop_unknown_cells(out, name) + drop_what_is_not_kept(out, name)
    if len({block.type for block in out.cells}) < len(out.cells) and name in ("med", "exodus"):
        out = _one_block_per_type(out)
    if len(out.field_data.get("med:nom", ())) != len({*out.point_data, *out.cell_data} - {"point_tags", "cell_tags"}):
        # Names of components are told by position, which holds only as long as no array is added.
        out.field_data.pop("med:nom", None)
    if name == "exodus":
        out.cells = exodus.from_vtk(out.cells)
    options: dict[str, Any] = {}
    form = name
    if name == "gmsh":
        form, options, more = _gmsh_options(out, file)
        lost += more
    with _quiet():
        import meshio

        meshio.write(target, out, file_format=form, **options)
    if name == "abaqus":
        text = target.read_text()
        target.write_text(re.sub(r"(?<=TYPE=)\w+", lambda match: _ABAQUS.get(match[0], match[0]), text))
    if name == "nastran":
        lost.append("digits of coordinates beyond the 16 characters of a field")
    return lost


def read_vtk(path: Path) -> tuple[Any, SourceFile]:
    """Read a VTK file; what VTK only warns of is an error here."""
    import pyvista as pv

    if path.suffix.lower() == ".vtk":
        require_whole(path)
        require_survival(path)
    elif path.suffix.lower().startswith((".vt", ".pvt")):
        require_announced(path)
    with _quiet(), _vtk_messages() as messages:
        try:
            grid = pv.read(path)
        except (ImportError, MemoryError):
            raise
        except (Exception, SystemExit) as problem:
            raise ReadError(f"not a sound VTK file ({problem})") from problem
    bad = [text for text in messages if "error" in text.lower()]
    if bad:
        raise ReadError(f"the file is malformed or truncated ({bad[0].splitlines()[0]})")
    if isinstance(grid, pv.DataSet):
        if grid.n_points == 0 or grid.n_cells == 0:
            raise ReadError("the file holds no mesh, or only the beginning of one")
        require_cells(grid)
    return grid, SourceFile(path)


def write_vtk(target: Path, grid: Any) -> None:
    """Write a pyvista dataset in the format of the target's extension."""
    with _quiet(), _vtk_messages() as messages:
        grid.save(target)
    bad = [text for text in messages if "error" in text.lower()]
    if bad:
        raise WriteError(bad[0].splitlines()[0])


def _head(path: Path) -> bytes:
    with path.open("rb") as handle:
        return handle.read(1 << 16)


def _gmsh_variant(path: Path) -> SourceFile:
    match = re.search(rb"\$MeshFormat\s+(\S+)\s+(\d)", _head(path))
    if match is None:
        return SourceFile(path)
    return SourceFile(path, version=match[1].decode(), ascii=match[2] == b"0")


def _gmsh_options(out: Any, file: SourceFile | None) -> tuple[str, dict[str, Any], list[str]]:
    lost = []
    as_text = file is not None and file.ascii
    arrays = [*out.point_data.items(), *((name, parts[0]) for name, parts in out.cell_data.items())]
    whole = [name for name, array in arrays if array.dtype.kind in "iu" and name not in GMSH_TAGS]
    if whole:
        lost.append(f"the integer type of {', '.join(whole)} (kept as floating point)")
    version = "2.2"
    if file is not None and file.version.startswith("4"):
        version = "4.1" if _entities_are_known(out) else "2.2"
    if version == "2.2":
        out.point_data.pop("gmsh:dim_tags", None)
        if file is not None and file.version.startswith("4"):
            lost.append("the geometric entities of Gmsh 4 (written as version 2.2)")
    # Both writers ask for both tags; Gmsh itself leaves those of physical groups out where there are none.
    for tag in GMSH_TAGS[:2]:
        out.cell_data.setdefault(tag, [np.zeros(len(block.data), dtype=np.int32) for block in out.cells])
    if as_text:
        # Plain Python floats: the writer spells out NumPy's as np.float64(...).
        for name in set(out.point_data) - set(GMSH_TAGS):
            out.point_data[name] = out.point_data[name].astype(np.float64).astype(object)
        for name in set(out.cell_data) - set(GMSH_TAGS):
            out.cell_data[name] = [part.astype(np.float64).astype(object) for part in out.cell_data[name]]
    return ("gmsh22" if version == "2.2" else "gmsh"), {"binary": not as_text}, lost


def _entities_are_known(out: Any) -> bool:
    # The 4.1 writer keeps the tags of those entities only that own a node.
    tags, geometry = out.point_data.get("gmsh:dim_tags"), out.cell_data.get("gmsh:geometrical")
    if tags is None or geometry is None:
        return False
    known = {tuple(row) for row in np.unique(np.asarray(tags, dtype=np.int64), axis=0).tolist()}
    entities = [(block.dim, *np.unique(part).tolist()) for block, part in zip(out.cells, geometry, strict=True)]
    return len(set(entities)) == len(entities) and known.issuperset(entities)


def _split_cell_data(cells: Any, raw: dict[str, Any]) -> dict[str, list[Any]]:
    # meshio's own takes the two entries of a (type, nodes) tuple for two cells.
    ends = np.cumsum([len(block[1]) for block in cells])[:-1]
    return {name: np.split(np.asarray(data), ends) for name, data in raw.items()}


def _one_block_per_type(mesh: Any) -> Any:
    import meshio

    types = list(dict.fromkeys(block.type for block in mesh.cells))
    groups = [[number for number, block in enumerate(mesh.cells) if block.type == name] for name in types]
    cell_data = {
        name: [np.concatenate([parts[number] for number in group]) for group in groups]
        for name, parts in mesh.cell_data.items()
    }
    blocks = [
        (name, np.concatenate([mesh.cells[number].data for number in group]))
        for name, group in zip(types, groups, strict=True)
    ]
    result = meshio.Mesh(mesh.points, blocks, mesh.point_data, cell_data, mesh.field_data, mesh.point_sets)
    for name in vars(mesh).keys() - vars(result).keys():
        setattr(result, name, getattr(mesh, name))
    return result


@contextlib.contextmanager
def _quiet() -> Iterator[io.StringIO]:
    """Keep parsers from printing, and return what they say."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield said


@contextlib.contextmanager
def _vtk_messages() -> Iterator[list[str]]:
    """Collect what VTK would print."""
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow

    messages: list[str] = []
    window, before = vtkStringOutputWindow(), vtkOutputWindow.GetInstance()
    verbosity = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    vtkOutputWindow.SetInstance(window)
    try:
        yield messages
    finally:
        said: str | bytes = window.GetOutput()
        text = said if isinstance(said, str) else said.decode("utf-8", "replace")
        messages += [line for line in text.splitlines() if line.strip()]
        vtkOutputWindow.SetInstance(before)
        vtkLogger.SetStderrVerbosity(vtkLogger.ConvertToVerbosity(verbosity))
