"""What keeps the shape: features, the saddle-point problem (17, 18), projection, distance from the input.

Belongs here: where nodes of a surface may go. Imports `hexconformal.common`, `hexconformal.kernel`,
`hexconformal.mesh`, `hexconformal.energy`, `hexconformal.geometry`, `mesh` and `energy`.
"""

from .features import CORNER, SMOOTH, Features, detect_features, holding
from .input_surface import Shape
from .saddle_point import NORMALS, Linear, system
from .smooth_projection import Target

__all__ = [
    "CORNER",
    "NORMALS",
    "SMOOTH",
    "Features",
    "Linear",
    "Shape",
    "Target",
    "detect_features",
    "holding",
    "system",
]
