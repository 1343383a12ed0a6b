"""Feature curves, corners and smooth patches of a surface."""

from .crack_fronts import kept_edges
from .creases import find_creases
from .feature_curves import CORNER, CURVE, SMOOTH, Features, find_features, nonmanifold_nodes
from .inner_sheets import InnerSheets, find_inner_sheets, joined_features, wire_features, with_one_side_out
from .schedules import CreaseSchedule, FeatureSchedule
from .sharp_edges import SHARP, sharp_length

__all__ = [
    "CORNER",
    "CURVE",
    "SHARP",
    "SMOOTH",
    "CreaseSchedule",
    "FeatureSchedule",
    "Features",
    "InnerSheets",
    "find_creases",
    "find_features",
    "find_inner_sheets",
    "joined_features",
    "kept_edges",
    "nonmanifold_nodes",
    "sharp_length",
    "wire_features",
    "with_one_side_out",
]
