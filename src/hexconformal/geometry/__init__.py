"""Surfaces: edges, patches, feature curves, closest points, distances, and the distance barrier (14).

Belongs here: what is asked of a surface as a shape, by both packages. Imports `common`, `kernel`, `mesh`, `energy`
and `io`.
"""

from .area_normals import area_normals, enclosed_volume, simpson_normals
from .closest_point import ClosestPoints, SurfaceLocator
from .closest_point_kernels import closest_on_triangle
from .distance_barrier import DistanceBarrier
from .features import find_features, surface_tags
from .hausdorff import distance_between, hausdorff

__all__ = [
    "ClosestPoints",
    "DistanceBarrier",
    "SurfaceLocator",
    "area_normals",
    "closest_on_triangle",
    "distance_between",
    "enclosed_volume",
    "find_features",
    "hausdorff",
    "simpson_normals",
    "surface_tags",
]
