"""Constraints that keep the shape: what holds nodes, the saddle-point problem (17, 18), projection.

Belongs here: where nodes of a surface may go. Imports `hexconformal.common`, `hexconformal.kernel`,
`hexconformal.geometry`, `hexconformal.mesh`, `hexconformal.energy`, `hexconformal.solver`, `mesh` and `energy`.
"""

from .features import find_features, held_projectors
from .input_surface import InputSurface
from .interfaces import Interfaces, find_interfaces
from .nearness import Nearness
from .saddle_point import NORMALS, ConstrainedSystem, constrained_system
from .smooth_projection import SmoothProjection

__all__ = [
    "NORMALS",
    "ConstrainedSystem",
    "InputSurface",
    "Interfaces",
    "Nearness",
    "SmoothProjection",
    "constrained_system",
    "find_features",
    "find_interfaces",
    "held_projectors",
]
