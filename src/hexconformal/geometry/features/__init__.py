"""Feature curves, corners and smooth patches of a surface."""

from .crack_fronts import kept_edges
from .feature_curves import Features, find_features

__all__ = ["Features", "find_features", "kept_edges"]
