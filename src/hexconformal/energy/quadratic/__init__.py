"""The distortion of quadratic hexahedra, equation (10a)."""

from .term import QuadraticTerm

__all__ = ["QuadraticTerm"]
