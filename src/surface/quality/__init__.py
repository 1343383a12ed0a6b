"""Measures and checks of surface meshes.

Belongs here: measures and checks. Imports `hexconformal.common`, `hexconformal.geometry`, `hexconformal.quality`,
`mesh`, `energy` and `io`.
"""

from .assessment import Quality, Summary, quality, smallest_angles
from .checks import held_nodes, require_sound

__all__ = [
    "Quality",
    "Summary",
    "held_nodes",
    "quality",
    "require_sound",
    "smallest_angles",
]
