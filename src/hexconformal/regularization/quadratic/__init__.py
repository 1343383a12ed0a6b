"""Regularizing quadratic hexahedra, and making them of linear ones on a surface."""

from .curving import Curved, curved
from .run import QuadraticRegularization

__all__ = ["Curved", "QuadraticRegularization", "curved"]
