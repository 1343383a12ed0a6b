"""Remeshing a surface: options, the descent, acceptance, report.

Belongs here: what is done with a surface at rest. Imports `hexconformal.common`, `hexconformal.geometry`,
`hexconformal.mesh`, `hexconformal.page`, `mesh`, `page`, `energy`, `io`, `constraint` and `quality`.
"""

from .options import EMPHASES, Options, Record
from .remesh_surface import remesh
from .report import Report
from .result import Result
from .run import Remeshing
from .schedules import Schedules

__all__ = [
    "EMPHASES",
    "Options",
    "Record",
    "Remeshing",
    "Report",
    "Result",
    "Schedules",
    "remesh",
]
