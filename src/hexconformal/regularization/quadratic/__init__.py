"""Regularizing quadratic hexahedra while their boundary stays."""

from .run import QuadraticRegularization

__all__ = ["QuadraticRegularization"]
