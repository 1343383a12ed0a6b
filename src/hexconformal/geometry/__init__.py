"""Surfaces: edges, patches, feature curves, closest points, distances, area vectors, the distance barrier (14).

Belongs here: the geometry of surfaces that both packages need. Imports `common`, `kernel`,
`elements`, `mesh`, `energy` and `io`.
"""

from .area_vectors import enclosed_volume, nodal_area_vectors, simpson_mean
from .barrier_schedule import BarrierSchedule
from .closest_point import ClosestPoints, SurfaceLocator
from .closest_point_kernels import closest_on_triangle
from .crack_fronts import kept_edges
from .distance_barrier import DistanceBarrier
from .features import Features, find_features
from .hausdorff import distance_between, hausdorff
from .surface_tags import surface_tags

__all__ = [
    "BarrierSchedule",
    "ClosestPoints",
    "DistanceBarrier",
    "Features",
    "SurfaceLocator",
    "closest_on_triangle",
    "distance_between",
    "enclosed_volume",
    "find_features",
    "hausdorff",
    "kept_edges",
    "nodal_area_vectors",
    "simpson_mean",
    "surface_tags",
]
