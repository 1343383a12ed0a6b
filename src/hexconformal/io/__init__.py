"""Meshes from and to files and other libraries.

Belongs here: what knows meshio, pyvista or VTK, and the formats, one module each in `formats`. Imports `common`,
`elements` and `mesh`.
"""

from .convert import to_pyvista
from .formats.meshio_formats import read_meshio, write_meshio
from .formats.vtk_files import read_vtk, write_vtk
from .meshio_mesh import MeshioOrigin
from .pyvista_mesh import PyvistaOrigin, cell_offsets, triangles
from .read_write import READ_EXTENSIONS, WRITE_EXTENSIONS, as_hex_mesh, read, read_surface, write
from .selection import Selection, SourceFile
from .vtk_mesh import cell_table, from_vtk, points_of, updated

__all__ = [
    "READ_EXTENSIONS",
    "WRITE_EXTENSIONS",
    "MeshioOrigin",
    "PyvistaOrigin",
    "Selection",
    "SourceFile",
    "as_hex_mesh",
    "cell_offsets",
    "cell_table",
    "from_vtk",
    "points_of",
    "read",
    "read_meshio",
    "read_surface",
    "read_vtk",
    "to_pyvista",
    "triangles",
    "updated",
    "write",
    "write_meshio",
    "write_vtk",
]
