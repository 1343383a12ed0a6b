"""The conformal distortion of a surface (15), its barrier (16), and what cells should be conformal to.

Belongs here: energies with derivatives, target shapes. Imports `hexconformal.common`, `hexconformal.kernel`,
`hexconformal.mesh`, `hexconformal.geometry` and `mesh`.
"""

from .barrier import Barrier, TurnedCellsSchedule
from .distortion_energy import ENERGIES, Quaternionic, SurfaceEnergy, corner_frames
from .target import TARGETS, target_shapes

__all__ = [
    "ENERGIES",
    "TARGETS",
    "Barrier",
    "Quaternionic",
    "SurfaceEnergy",
    "TurnedCellsSchedule",
    "corner_frames",
    "target_shapes",
]
