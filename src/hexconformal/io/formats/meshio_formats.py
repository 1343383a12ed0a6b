"""The readers and writers of meshio, kept from printing, exiting, guessing and losing quietly."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from ...common import ReadError, WriteError
from ...mesh import HexMesh
from ..convert import to_meshio
from ..selection import SourceFile
from .abaqus import read_deck, replaced_nodes
from .conventions import EXODUS_NAMES, from_vtk_order, med_families, to_vtk_order, write_med_families
from .format_limits import GMSH_TAGS, drop_unknown_cells, drop_what_is_not_kept
from .nastran import in_a_field, read_bulk
from .silence import quiet

__all__ = ["read_meshio", "write_meshio"]

# Formats that have the extension of another one: how they begin, and what to do.
_NAMESAKES = {
    "medit": (rb"MFEM ", "this is MFEM's own format: write it as VTK or Gmsh 2.2, or hand over points and cells"),
    "abaqus": (rb"(#.*\s+)*\d+([ \t]+\d+){4}\s*\n", "this is an AVS UCD file: give it the extension .avs"),
    "gmsh": (rb"\$NOD", "this is a Gmsh 1 file: let Gmsh save it again, in version 2.2 or 4.1"),
}
_IN_HDF5, _HDF5_HEAD = ("exodus", "med", "xdmf"), 100_000
# meshio writes the last Abaqus name it knows for a type: a hybrid brick, an axisymmetric pore pressure quadrilateral.
_ABAQUS = {"C3D8RH": "C3D8", "CAX4P": "S4", "R3D3": "S3", "B33H": "B31", "C3D10MH": "C3D10", "C3D20RH": "C3D20"}


def read_meshio(path: Path, name: str) -> tuple[Any, SourceFile, list[str]]:
    """Read a file with meshio's parser of that name: the meshio.Mesh, its file, and the parser's warnings."""
    with quiet() as said:
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
            with (
                mock.patch("meshio.gmsh._gmsh22.cell_data_from_raw", _split_cell_data),
                mock.patch.dict("meshio.exodus._exodus.exodus_to_meshio_type", EXODUS_NAMES),
                mock.patch("meshio.med._med._read_families", med_families),
            ):
                if name == "abaqus":
                    mesh, deck, notes = read_deck(path)
                    return mesh, SourceFile(path, deck=deck), notes
                mesh = read_bulk(path) if name == "nastran" else reader_map[name](str(path))
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
    mesh.cells = to_vtk_order(mesh.cells, name)
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
    out.cells = from_vtk_order(out.cells, name)
    if name in _IN_HDF5:
        _require_room(target, out)
    options: dict[str, Any] = {}
    form = name
    if name == "gmsh":
        form, options, more = _gmsh_options(out, file)
        lost += more
    with quiet():
        from unittest import mock

        import meshio

        with (
            mock.patch("meshio.nastran._nastran._float_to_nastran_string", in_a_field),
            mock.patch("meshio.med._med._write_families", write_med_families),
        ):
            meshio.write(target, out, file_format=form, **options)
    if name == "abaqus":
        text = target.read_text()
        target.write_text(re.sub(r"(?<=TYPE=)\w+", lambda match: _ABAQUS.get(match[0], match[0]), text))
    if name == "nastran":
        lost.append("digits of coordinates beyond the 16 characters of a field")
    return lost


def _require_room(target: Path, out: Any) -> None:
    # HDF5 may crash where a disk is full, or lose what it has not written yet.
    arrays = [out.points, *(block.data for block in out.cells), *out.point_data.values()]
    arrays += [part for parts in out.cell_data.values() for part in parts]
    needed = sum(np.asarray(array).nbytes for array in arrays) + _HDF5_HEAD
    free = shutil.disk_usage(target.parent).free
    if free < needed:
        raise WriteError(f"the disk is full: some {needed / 1e6:.1f} MB are needed, {free / 1e6:.1f} MB are free")


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
        # Serializable Python floats: the writer spells out NumPy's as np.float64(...).
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
