"""Energies: objectives and the terms they are sums of, and the block matrix their second derivatives are added to.

Belongs here: the distortion at quadrature points (6) and at corners (11, 12), the volume term (10), target shapes.
Imports `common`, `kernel`, `elements` and `mesh`.
"""

from .block_matrix import Assembly, BlockMatrix
from .composed_term import ComposedTerm
from .corner_term import CornerMeasures, CornerTerm, CornerWeights
from .distortion_term import DistortionTerm
from .objective import Objective
from .quadratic import QuadraticTerm
from .soft_minimum import SoftMinimumTerm, corner_jacobians
from .target import (
    STRETCHED_ASPECTS,
    aspect_ratios,
    inverse_targets,
    jacobian_matrices,
    normalized_target,
    stretch_of,
    stretched_boxes,
    target_volumes,
)
from .term import Patch, Term
from .volume_term import VolumeTerm

__all__ = [
    "STRETCHED_ASPECTS",
    "Assembly",
    "BlockMatrix",
    "ComposedTerm",
    "CornerMeasures",
    "CornerTerm",
    "CornerWeights",
    "DistortionTerm",
    "Objective",
    "Patch",
    "QuadraticTerm",
    "SoftMinimumTerm",
    "Term",
    "VolumeTerm",
    "aspect_ratios",
    "corner_jacobians",
    "inverse_targets",
    "jacobian_matrices",
    "normalized_target",
    "stretch_of",
    "stretched_boxes",
    "target_volumes",
]
