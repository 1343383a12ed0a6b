"""What keeps the shape: features, the saddle-point problem (17, 18), projection, distance from the input.

Belongs here: where nodes of a surface may go. Imports `hexconformal.common`, `hexconformal.kernel`,
`hexconformal.elements`, `hexconformal.mesh`, `hexconformal.energy`, `hexconformal.geometry`, `mesh` and `energy`.
"""

from .features import CORNER, SMOOTH, Features, detect_features, held_projectors
from .input_surface import InputSurface
from .saddle_point import NORMALS, ConstrainedSystem, system
from .smooth_projection import SmoothProjection

__all__ = [
    "CORNER",
    "NORMALS",
    "SMOOTH",
    "ConstrainedSystem",
    "Features",
    "InputSurface",
    "SmoothProjection",
    "detect_features",
    "held_projectors",
    "system",
]
