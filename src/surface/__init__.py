"""Surface meshes: quaternionic remeshing of triangles and quadrilaterals, at rest and along curvature flows.

One call::

    import surface

    result = surface.remesh("statue.ply")
    print(result.report)

    flow = surface.Willmore("cube.ply", conserve=("area", "volume"))
    for moment in surface.evolve(flow, steps=200, remesh=True):
        print(moment.record.energy)
"""

from typing import TYPE_CHECKING

from hexconformal.common import loaded_later

from .io import as_surface_mesh, read, write
from .mesh import SurfaceMesh
from .quality import Quality, quality

if TYPE_CHECKING:
    from . import flow
    from .flow import Evolution, Flow, Helfrich, MeanCurvature, Moment, PWillmore, Stepping, Willmore, evolve
    from .remeshing import Options, Record, Remeshing, Report, Result, remesh
else:
    __getattr__ = loaded_later(
        __name__,
        flow="Evolution Flow Helfrich MeanCurvature Moment PWillmore Stepping Willmore evolve",
        remeshing="Options Record Remeshing Report Result remesh",
    )

__all__ = [
    "Evolution",
    "Flow",
    "Helfrich",
    "MeanCurvature",
    "Moment",
    "Options",
    "PWillmore",
    "Quality",
    "Record",
    "Remeshing",
    "Report",
    "Result",
    "Stepping",
    "SurfaceMesh",
    "Willmore",
    "as_surface_mesh",
    "evolve",
    "flow",
    "quality",
    "read",
    "remesh",
    "write",
]


def __dir__() -> list[str]:
    # What the Tab key offers: not the modules that all this is made of.
    return __all__
