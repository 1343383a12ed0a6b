"""Polygon files (.ply): what they hold, and how they are read, rewritten and written."""

from .format import PLY

__all__ = ["PLY"]
