"""What is minimized over a mesh: cells, targets, admissible directions, and what keeps the surface.

Belongs here: how terms, directions and weights are put together, of a mesh or of a patch. Imports `common`,
`elements`, `energy`, `mesh`, `geometry`, `ranks` and `solver`.
"""

from .barrier_on_ranks import BarrierOnRanks
from .compatible_constraint import CompatibleConstraint
from .faces_on_ranks import FacesOnRanks
from .formulation import LEVEL, Formulation, ValidCells, convex_newton
from .iteration import Iteration
from .patch_on_ranks import on_one_rank, steps_on_one_rank
from .schedules import MinimizationSchedule, ReturnSchedule, Schedules
from .unfolding_schedules import UntanglingSchedule
from .work import Work

__all__ = [
    "LEVEL",
    "BarrierOnRanks",
    "CompatibleConstraint",
    "FacesOnRanks",
    "Formulation",
    "Iteration",
    "MinimizationSchedule",
    "ReturnSchedule",
    "Schedules",
    "UntanglingSchedule",
    "ValidCells",
    "Work",
    "convex_newton",
    "on_one_rank",
    "steps_on_one_rank",
]
