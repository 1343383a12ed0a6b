"""XDMF (.xdmf, .xmf), with its numbers in an HDF5 file beside it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from ...common import ReadError
from ..format_tools.capabilities import Capabilities, supported_part
from ..format_tools.file_checks.hdf5_checks import check_hdf5_beside
from ..format_tools.file_checks.references import referenced_file
from ..format_tools.file_checks.xml_checks import parse_xml
from ..format_tools.format import Format
from ..format_tools.meshio_files import checked_contents, parsing, require_disk_space, write_with_meshio
from ..source_file import FileContents, SourceFile

__all__ = ["XDMF"]

# Of wedges of 18 nodes meshio cannot read back what it has written beside other cells.
_CAPABILITIES = Capabilities(
    cell_types="""vertex line line3 triangle triangle6 quad quad8 quad9 tetra tetra10 pyramid wedge hexahedron
        hexahedron20 hexahedron27 hexahedron64 hexahedron125 hexahedron216 hexahedron343 hexahedron512 hexahedron729
        hexahedron1000""",
    point_arrays="all",
    cell_arrays="all",
)


def _read(path: Path) -> FileContents:
    _check_files(path)
    with parsing("xdmf") as output:
        import meshio

        grids = re.findall(rb"<Grid\b[^>]*>", path.read_bytes())
        named = [name[1] for grid in grids if (name := re.search(rb"\bName\s*=\s*[\"']([^\"']*)", grid))]
        if len(grids) > 1:
            raise ReadError(
                f"it holds {len(grids)} grids ({b', '.join(named[:4]).decode('utf-8', 'replace')}): files of several "
                "grids (tags of DOLFINx, times, collections) are not supported; write one grid with its arrays into it"
            )
        mesh = meshio.xdmf.read(str(path))
    return checked_contents(mesh, SourceFile(path, "xdmf"), output)


def _check_files(path: Path) -> None:
    """Raise a ReadError if the file declares entities, or names files outside its folder, or damaged ones."""
    for name, kind in _names(path).items():
        if kind == "HDF":
            check_hdf5_beside(path, name)
        else:
            referenced_file(path, name)


def _names(path: Path) -> dict[str, str]:
    """Names of the files that one names, and of which kind they are: "HDF" or "Binary"."""
    formats: list[str] = []
    words: list[str] = []

    def begin(name: str, given: dict[str, str]) -> None:
        formats.append(given.get("Format", "XML") if name == "DataItem" else "XML")
        words.clear()

    def end(name: str) -> None:
        reference = "".join(words).strip()
        kind = formats.pop()
        if kind in ("HDF", "Binary"):
            names.setdefault(reference.partition(":")[0] if kind == "HDF" else reference, kind)
        words.clear()

    def text(piece: str) -> bool:
        if formats[-1] in ("HDF", "Binary"):
            words.append(piece)
        return formats[-1] in ("HDF", "Binary")

    names: dict[str, str] = {}
    parse_xml(path.read_bytes(), begin, end, characters=text)
    return names


def _files_named(path: Path) -> list[Path]:
    return [path.parent / name for name in _names(path)]


def _write(target: Path, mesh: Any) -> list[str]:
    out, lost = supported_part(mesh, "xdmf", _CAPABILITIES)
    require_disk_space(target, out)
    write_with_meshio(target, out, "xdmf")
    return lost


XDMF = Format("xdmf", _read, _write, _CAPABILITIES, files_named=_files_named)
