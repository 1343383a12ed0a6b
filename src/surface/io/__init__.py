"""Surfaces from and to files and other libraries.

Belongs here: conversions, readers and writers. Imports `hexconformal.common`, `hexconformal.geometry`,
`hexconformal.mesh`, `hexconformal.io` and `mesh`.
"""

from .convert import as_pyvista
from .read_write import EXTENSIONS, as_surface_mesh, read, write
from .vtk_mesh import from_vtk, to_vtk

__all__ = [
    "EXTENSIONS",
    "as_pyvista",
    "as_surface_mesh",
    "from_vtk",
    "read",
    "to_vtk",
    "write",
]
