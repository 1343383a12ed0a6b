"""The boundary of a run: what a mesh says of its geometry, what is held exactly, and the barrier around the rest."""

from .boundary import Boundary, boundary_of
from .exact_parts import flat_normals

__all__ = ["Boundary", "boundary_of", "flat_normals"]
