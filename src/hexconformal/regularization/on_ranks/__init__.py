"""Runs on a mesh that is shared out between ranks: what they can do, their boundary, their report."""

from .mesh_on_ranks import MeshOnRanks

__all__ = ["MeshOnRanks"]
