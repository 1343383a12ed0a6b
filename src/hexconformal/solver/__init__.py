"""Minimizers: L-BFGS, Newton, majorization, with multigrid and the directions in which nodes may move.

Belongs here: methods that know energies by value and derivatives alone. Imports `common`, `kernel`, `elements`,
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
from .laplace_preconditioner import LaplacePreconditioner
from .minimizers import MINIMIZERS, Iterate, Problem, conjugate_gradients, initial_iterate, lbfgs
from .projected_newton import newton_step, next_shift, projected_newton
from .step_rounding import MESH_ROUNDING

__all__ = [
    "MESH_ROUNDING",
    "MINIMIZERS",
    "AdmissibleDirections",
    "Iterate",
    "LaplacePreconditioner",
    "Problem",
    "boundary_directions",
    "conjugate_gradients",
    "count_free_directions",
    "fixed_components",
    "initial_iterate",
    "lbfgs",
    "line_normal_sums",
    "newton_step",
    "next_shift",
    "planar_normal_sums",
    "projected_newton",
]
