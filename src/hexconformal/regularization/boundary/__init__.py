"""The boundary of a run: what a mesh says of its geometry, what is held exactly, and the barrier around the rest."""

from .boundary import Boundary, Measure, Value, boundary_of
from .exact_parts import flat_normals
from .given_surface import GivenSurface
from .kept_geometry import KeptGeometry, kept_geometry
from .said import Said

__all__ = [
    "Boundary",
    "GivenSurface",
    "KeptGeometry",
    "Measure",
    "Said",
    "Value",
    "boundary_of",
    "flat_normals",
    "kept_geometry",
]
