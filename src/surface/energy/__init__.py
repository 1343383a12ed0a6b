"""The conformal distortion of a surface (15), its barrier (16), and what cells shall be conformal to.

Belongs here: energies with derivatives, reference shapes. Imports `hexconformal.common`, `hexconformal.kernel`,
`hexconformal.mesh` and `mesh`.
"""

from .barrier import Barrier
from .distortion_energy import ENERGIES, Distortion, Quaternionic, corner_frames
from .reference import REFERENCES, reference_shapes

__all__ = [
    "ENERGIES",
    "REFERENCES",
    "Barrier",
    "Distortion",
    "Quaternionic",
    "corner_frames",
    "reference_shapes",
]
