"""Moving a mesh with its boundary, step after step (28).

Belongs here: MeshMotion, the extension of displacements, and runs by a table, pages. Imports `common`, `kernel`,
`elements`, `mesh`, `energy`, `io`, `geometry`, `page`, `quality`, `ranks`, `runs` and `solver`.
"""

from .mesh_motion import MeshMotion
from .motion_page import motion_page
from .motion_run import MotionRun
from .motion_table import BoundaryMotion, read_motion
from .report import MotionReport, MotionStep
from .schedule import MotionSchedule

__all__ = [
    "BoundaryMotion",
    "MeshMotion",
    "MotionReport",
    "MotionRun",
    "MotionSchedule",
    "MotionStep",
    "motion_page",
    "read_motion",
]
