"""Regularizing quadratic cells, and making hexahedra quadratic on a surface."""

from .curving import Curved, curved
from .run import QuadraticRegularization

__all__ = ["Curved", "QuadraticRegularization", "curved"]
