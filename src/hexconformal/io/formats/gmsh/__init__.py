"""Gmsh's meshes: sections of a file, what they say, and new coordinates in a file that stays as it came."""

from .format import GMSH

__all__ = ["GMSH"]
