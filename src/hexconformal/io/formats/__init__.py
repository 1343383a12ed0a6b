"""The file formats, a module each, and the table of them: whatever is asked of a format is found by the extension."""

from __future__ import annotations

from pathlib import Path

from ...common import MeshError
from ..format_tools.file_checks.hdf5_checks import check_hdf5
from ..format_tools.format import Format
from ..source_file import FileContents
from .abaqus import ABAQUS
from .exodus import EXODUS
from .gmsh import GMSH
from .med import MED
from .medit import MEDIT, MFEM
from .meshio_read_only import MESHIO_READ_ONLY
from .nastran import NASTRAN
from .obj import OBJ
from .off import OFF
from .ply import PLY
from .stl import STL
from .vtk import VTK_GRID, VTK_POLYDATA, VTK_READ_ONLY
from .xdmf import XDMF

__all__ = [
    "FORMATS",
    "READ_EXTENSIONS",
    "SURFACE_EXTENSIONS",
    "WRITE_EXTENSIONS",
    "Format",
    "files_named_by",
    "read_contents",
]

_ALL = (
    ABAQUS,
    EXODUS,
    GMSH,
    MED,
    MEDIT,
    MFEM,
    NASTRAN,
    OBJ,
    OFF,
    PLY,
    STL,
    VTK_GRID,
    VTK_POLYDATA,
    VTK_READ_ONLY,
    XDMF,
    *MESHIO_READ_ONLY,
)
FORMATS: dict[str, Format] = {extension: form for form in _ALL for extension in form.extensions}

# Of volumes, read and written; and of all that a surface can be taken from.
READ_EXTENSIONS = tuple(sorted(key for key, form in FORMATS.items() if not form.surfaces_only))
WRITE_EXTENSIONS = tuple(key for key in READ_EXTENSIONS if FORMATS[key].write is not None)
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
