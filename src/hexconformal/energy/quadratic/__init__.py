"""The distortion of quadratic cells, equation (10a)."""

from .term import QuadraticTerm

__all__ = ["QuadraticTerm"]
