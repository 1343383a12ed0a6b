"""Surface meshes: quaternionic remeshing of triangles and quadrilaterals.

One call::

    import surface

    result = surface.remesh("statue.ply")
    print(result.report)
"""

from .io import read, write
from .mesh import SurfaceMesh, as_surface_mesh
from .options import Options, Record
from .quality import Quality, quality
from .remesh import Remeshing, Result, remesh, remeshing
from .report import Report

__all__ = [
    "Options",
    "Quality",
    "Record",
    "Remeshing",
    "Report",
    "Result",
    "SurfaceMesh",
    "as_surface_mesh",
    "quality",
    "read",
    "remesh",
    "remeshing",
    "write",
]
