"""The file formats, a module each, and the table of them: whatever is asked of a format is found by the extension."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path

from ...common import MeshError
from ..format_tools.file_checks.hdf5_checks import check_hdf5
from ..format_tools.format import Format
from ..source_file import FileContents

__all__ = [
    "FORMATS",
    "READ_EXTENSIONS",
    "SURFACES_ONLY",
    "SURFACE_EXTENSIONS",
    "WRITE_EXTENSIONS",
    "Format",
    "files_named_by",
    "read_contents",
]

# Modules with the names of their formats, and the extensions of each.
_WRITTEN = {
    "abaqus.ABAQUS": ".inp",
    "exodus.EXODUS": ".e .ex2 .exo",
    "gmsh.GMSH": ".msh",
    "med.MED": ".med",
    "medit.MEDIT": ".mesh .meshb",
    "medit.MFEM": ".mfem",
    "nastran.NASTRAN": ".bdf .fem .nas",
    "vtk.VTK_GRID": ".vtk .vtu",
    "xdmf.XDMF": ".xdmf .xmf",
}
_READ_ONLY = {
    "meshio_read_only.AVS_UCD": ".avs",
    "meshio_read_only.FLAC3D": ".f3grid",
    "meshio_read_only.H5M": ".h5m",
    "meshio_read_only.KRATOS": ".mdpa",
    "meshio_read_only.NETGEN": ".vol",
    "meshio_read_only.SU2": ".su2",
    "meshio_read_only.TECPLOT": ".dat .tec",
    "meshio_read_only.UGRID": ".ugrid",
    "vtk.VTK_READ_ONLY": ".pvtu .vti .vtr .vts",
}
_WITHOUT_VOLUMES = {
    "obj.OBJ": ".obj",
    "off.OFF": ".off",
    "ply.PLY": ".ply",
    "stl.STL": ".stl",
    "vtk.VTK_POLYDATA": ".vtp",
}


class _Formats(Mapping[str, Format]):
    """Formats by extension; the module of one is loaded when it is asked for."""

    def __init__(self, homes: Mapping[str, str]) -> None:
        self._homes = {extension: home for home, extensions in homes.items() for extension in extensions.split()}

    def __getitem__(self, extension: str) -> Format:
        module, name = self._homes[extension].split(".")
        found: Format = getattr(import_module(f"{__name__}.{module}"), name)
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._homes)

    def __len__(self) -> int:
        return len(self._homes)


FORMATS = _Formats(_WRITTEN | _READ_ONLY | _WITHOUT_VOLUMES)

# Of volumes, read and written; of faces alone; and of all that a surface can be taken from.
READ_EXTENSIONS = tuple(sorted(_Formats(_WRITTEN | _READ_ONLY)))
WRITE_EXTENSIONS = tuple(sorted(_Formats(_WRITTEN)))
SURFACES_ONLY = tuple(sorted(_Formats(_WITHOUT_VOLUMES)))
SURFACE_EXTENSIONS = tuple(sorted(FORMATS))


def files_named_by(path: Path) -> list[Path]:
    """The files that a file names, which are read with it; none where it cannot be read: that is told by reading it."""
    form = FORMATS.get(path.suffix.lower())
    if form is None or not path.is_file():
        return []
    try:
        return [named for named in form.files_named(path) if named.is_file()]
    except (MeshError, OSError, ValueError):
        return []


def read_contents(path: Path, extension: str) -> FileContents:
    """Read a file as its extension tells, once it is known that its libraries survive it."""
    check_hdf5(path)
    return FORMATS[extension].read(path)
