"""Matching: the corners, curves and patches of a mesh's skin that are those of another surface.

Belongs here: what follows what, and where the skin belongs. Imports the rest of `geometry`, `mesh` and `elements`.
"""

from .matching import Matching, match_features
from .paths import Skin
from .schedule import MatchingSchedule

__all__ = ["Matching", "MatchingSchedule", "Skin", "match_features"]
