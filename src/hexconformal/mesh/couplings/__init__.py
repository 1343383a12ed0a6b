"""Nodes of a mesh that move together, and the rigid maps between them."""

from .couplings import Couplings, find_couplings

__all__ = ["Couplings", "find_couplings"]
