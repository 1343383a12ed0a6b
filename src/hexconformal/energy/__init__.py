"""What is minimized: the distortion at quadrature points (6) and at corners (11, 12), the volume term (10), targets.

Belongs here: energies with their derivatives, and the block matrix these are collected in. Imports `common`,
`kernel`, `elements` and `mesh`.
"""

from .block_matrix import BlockMatrix
from .corner_energy import VOLUME_WEIGHT, CornerEnergy, Weights
from .distortion_energy import Distortion
from .target import STRETCHED, aspects, cell_frames, inverse_targets, normalized_target, stretched_boxes, wanted_volumes

__all__ = [
    "STRETCHED",
    "VOLUME_WEIGHT",
    "BlockMatrix",
    "CornerEnergy",
    "Distortion",
    "Weights",
    "aspects",
    "cell_frames",
    "inverse_targets",
    "normalized_target",
    "stretched_boxes",
    "wanted_volumes",
]
