"""The formats of files named .mesh, .meshb and .mfem: a .mesh tells by its beginning whose it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...format_tools.capabilities import Capabilities, supported_part
from ...format_tools.format import Format
from ...format_tools.meshio_files import checked_contents, file_head, join_blocks, parsing, write_with_meshio
from ...format_tools.rewriting import changed_arrays, decoded, encoded, named
from ...source_file import FileContents, SourceFile
from . import medit_binary, medit_text, mfem_text

__all__ = ["MEDIT", "MFEM"]

_MEDIT = Capabilities(
    cell_types="line triangle quad tetra pyramid wedge hexahedron",
    point_arrays="one",
    cell_arrays="one",
    array_name="medit:ref",
)
_MFEM = Capabilities(
    cell_types="vertex line triangle quad tetra pyramid wedge hexahedron", cell_arrays="one", array_name="attribute"
)
_OF_MFEM = "MFEM"  # the version of a file of MFEM, whatever its extension


def _read(path: Path) -> FileContents:
    data = path.read_bytes()
    if file_head(path).lstrip().startswith(b"MFEM") or path.suffix.lower() == ".mfem":
        with parsing("mfem") as output:
            mesh = mfem_text.read_text(decoded(data))
        return checked_contents(mesh, SourceFile(path, "mesh", _OF_MFEM, True, data=data), output)
    with parsing("medit") as output:
        import meshio

        if path.suffix.lower() == ".meshb":
            return checked_contents(meshio.medit.read(str(path)), SourceFile(path, "mesh", data=data), output)
        found = medit_text.read_text(decoded(data))
    contents = checked_contents(found.mesh, SourceFile(path, "mesh", ascii=True, data=data), output)
    return replace(contents, notes=found.notes, held=found.held)


def _put_points(file: SourceFile, mesh: Any) -> tuple[bytes, list[str]] | None:
    changed, points = changed_arrays(mesh), np.asarray(mesh.points)
    if any("medit:ref" in arrays or "attribute" in arrays for arrays in changed):
        return None
    lost = named(changed)
    if not file.ascii:
        data, is_single = medit_binary.put_points(file.data, points)
        return data, [*lost, *(["digits beyond single precision"] if is_single else [])]
    put_into = mfem_text.put_points if file.version == _OF_MFEM else medit_text.put_points
    return encoded(put_into(decoded(file.data), points)), lost


def _write_mfem(target: Path, mesh: Any) -> list[str]:
    out, lost = supported_part(mesh, "mfem", _MFEM)
    # Attributes must be positive; a file without is of one material.
    refs = next(iter(out.cell_data.values()), [np.ones(len(block.data), np.int64) for block in out.cells])
    blocks = [
        (block.type, np.asarray(block.data), np.maximum(np.asarray(ref), 1))
        for block, ref in zip(out.cells, refs, strict=True)
    ]
    points = np.pad(np.asarray(out.points, np.float64), ((0, 0), (0, 3 - out.points.shape[1])))
    target.write_text(mfem_text.mesh_text(points, blocks), encoding="ascii")
    return lost


def _write(target: Path, mesh: Any) -> list[str]:
    file = getattr(mesh.origin, "file", None)
    if target.suffix.lower() == ".mesh" and file is not None and file.version == _OF_MFEM:
        return _write_mfem(target, mesh)
    out, lost = supported_part(mesh, "medit", _MEDIT)
    write_with_meshio(target, join_blocks(out), "medit")  # the format has one section for each type
    return lost


MEDIT = Format("mesh", _read, _write, _MEDIT, put_points=_put_points)
MFEM = Format("mesh", _read, _write_mfem, _MFEM, put_points=_put_points)
