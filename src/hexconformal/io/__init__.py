"""Meshes from and to files and other libraries.

Belongs here: what knows meshio, pyvista or VTK. Each file format is a module in `formats` and an entry in the table
there; what several of them share is in `format_tools`. Imports `common`,
`elements` and `mesh`.
"""

from .convert import to_pyvista
from .elevation import elevated
from .format_tools.file_checks.references import outside_references_allowed, referenced_file
from .format_tools.file_checks.vtk_xml_checks import pieces_of
from .format_tools.vtu_rows import VtuRows
from .formats import (
    FORMATS,
    READ_EXTENSIONS,
    SURFACES_ONLY,
    WRITE_EXTENSIONS,
    Format,
    files_named_by,
    read_contents,
)
from .formats.vtk import CELL_IDS, NODE_IDS, write_vtk
from .grid_cells import cell_nodes, cell_offsets
from .meshio_mesh import MeshioOrigin
from .pyvista_mesh import PyvistaOrigin, triangles, triangles_of
from .read_write import as_hex_mesh, as_volume_mesh, library_of, read, read_surface, write
from .selection import HEXAHEDRA, Selection
from .source_file import SourceFile
from .vtk_mesh import cell_table, from_vtk, points_of, updated_dataset

__all__ = [
    "CELL_IDS",
    "FORMATS",
    "HEXAHEDRA",
    "NODE_IDS",
    "READ_EXTENSIONS",
    "SURFACES_ONLY",
    "WRITE_EXTENSIONS",
    "Format",
    "MeshioOrigin",
    "PyvistaOrigin",
    "Selection",
    "SourceFile",
    "VtuRows",
    "as_hex_mesh",
    "as_volume_mesh",
    "cell_nodes",
    "cell_offsets",
    "cell_table",
    "elevated",
    "files_named_by",
    "from_vtk",
    "library_of",
    "outside_references_allowed",
    "pieces_of",
    "points_of",
    "read",
    "read_contents",
    "read_surface",
    "referenced_file",
    "to_pyvista",
    "triangles",
    "triangles_of",
    "updated_dataset",
    "write",
    "write_vtk",
]
