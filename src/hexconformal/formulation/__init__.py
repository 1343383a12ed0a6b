"""What is minimized over a mesh: cells, targets, admissible directions, and what keeps the surface.

Belongs here: how terms, directions and weights are put together, of a mesh or of a patch. Imports `elements`, `energy`,
`mesh`, `geometry` and `solver`.
"""

from .compatible_constraint import CompatibleConstraint
from .formulation import VOLUME_WEIGHT, Formulation, ValidCells, convex_newton
from .iteration import Iteration

__all__ = ["VOLUME_WEIGHT", "CompatibleConstraint", "Formulation", "Iteration", "ValidCells", "convex_newton"]
