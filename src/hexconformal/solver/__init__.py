"""Minimizers: L-BFGS and Newton, conjugate gradients, multigrid, and the directions in which nodes may move.

Belongs here: methods that know objectives by value and derivatives alone. Imports `common`, `kernel`, `elements`,
`mesh` and `energy`.
"""

from .admissible import (
    AdmissibleDirections,
    boundary_directions,
    count_free_directions,
    fixed_components,
    line_normal_sums,
    planar_normal_sums,
)
from .block_solver import block_preconditioner, solve_blocks
from .block_sweeps import BlockPreconditioner
from .conjugate_gradients import conjugate_gradients
from .coupled_nodes import UNCOUPLED, CoupledNodes
from .coupling_groups import coupled_groups, coupled_nodes
from .laplace_preconditioner import LaplacePreconditioner
from .lbfgs import lbfgs
from .multigrid import MultigridSchedule
from .newton import ConvexEquation, Equation, MatrixFreeEquation, NewtonSchedule, newton, newton_step
from .problem import Iterate, Preconditioner, Problem, SearchSchedule, line_search

__all__ = [
    "UNCOUPLED",
    "AdmissibleDirections",
    "BlockPreconditioner",
    "ConvexEquation",
    "CoupledNodes",
    "Equation",
    "Iterate",
    "LaplacePreconditioner",
    "MatrixFreeEquation",
    "MultigridSchedule",
    "NewtonSchedule",
    "Preconditioner",
    "Problem",
    "SearchSchedule",
    "block_preconditioner",
    "boundary_directions",
    "conjugate_gradients",
    "count_free_directions",
    "coupled_groups",
    "coupled_nodes",
    "fixed_components",
    "lbfgs",
    "line_normal_sums",
    "line_search",
    "newton",
    "newton_step",
    "planar_normal_sums",
    "solve_blocks",
]
