"""Medit's meshes, as text (.mesh) and binary (.meshb)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..format_tools.capabilities import Capabilities, supported_part
from ..format_tools.format import Format
from ..format_tools.meshio_files import checked_contents, parsing, refuse_namesake, write_with_meshio
from ..source_file import FileContents, SourceFile

__all__ = ["MEDIT"]

_CAPABILITIES = Capabilities(
    cell_types="line triangle quad tetra pyramid wedge hexahedron",
    point_arrays="one",
    cell_arrays="one",
    array_name="medit:ref",
)
_MFEM = rb"MFEM ", "this is MFEM's own format: write it as VTK or Gmsh 2.2, or hand over points and cells"


def _read(path: Path) -> FileContents:
    with parsing("medit") as output:
        import meshio

        refuse_namesake(path, *_MFEM)
        mesh = meshio.medit.read(str(path))
    return checked_contents(mesh, SourceFile(path, "medit"), output)


def _write(target: Path, mesh: Any) -> list[str]:
    out, lost = supported_part(mesh, "medit", _CAPABILITIES)
    write_with_meshio(target, out, "medit")
    return lost


MEDIT = Format("medit", (".mesh", ".meshb"), _read, _write, _CAPABILITIES)
