"""How it is minimized: L-BFGS, Newton, majorization, multigrid, and where nodes may go.

Belongs here: methods that know energies by value and derivatives alone. Imports `common`, `kernel`, `elements`,
`mesh` and `energy`.
"""

from .admissible import Constraint, boundary_constraint, fixed_components, free_directions, planar_normals
from .laplace_preconditioner import LaplacePreconditioner
from .minimizers import MINIMIZERS, Iterate, Problem, conjugate_gradients, lbfgs, start
from .projected_newton import newton_step, next_shift, projected_newton
from .step_rounding import WHOLE_ROUNDING

__all__ = [
    "MINIMIZERS",
    "WHOLE_ROUNDING",
    "Constraint",
    "Iterate",
    "LaplacePreconditioner",
    "Problem",
    "boundary_constraint",
    "conjugate_gradients",
    "fixed_components",
    "free_directions",
    "lbfgs",
    "newton_step",
    "next_shift",
    "planar_normals",
    "projected_newton",
    "start",
]
