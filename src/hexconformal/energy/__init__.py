"""Energies: the distortion at quadrature points (6) and at corners (11, 12), the volume term (10), target shapes.

Belongs here: energies with their derivatives, and the block matrix these are collected in. Imports `common`,
`kernel`, `elements` and `mesh`.
"""

from .block_matrix import BlockMatrix
from .corner_energy import VOLUME_WEIGHT, CornerEnergy, Weights
from .distortion_energy import DistortionEnergy
from .target import (
    STRETCHED_ASPECTS,
    aspect_ratios,
    inverse_targets,
    jacobian_matrices,
    normalized_target,
    stretched_boxes,
    target_volumes,
)

__all__ = [
    "STRETCHED_ASPECTS",
    "VOLUME_WEIGHT",
    "BlockMatrix",
    "CornerEnergy",
    "DistortionEnergy",
    "Weights",
    "aspect_ratios",
    "inverse_targets",
    "jacobian_matrices",
    "normalized_target",
    "stretched_boxes",
    "target_volumes",
]
