"""Surfaces: faces, edges, patches, feature curves, closest points, distances, areas, the distance barrier (14).

Belongs here: the geometry of surfaces of triangles and quadrilaterals, once for both packages. Imports `common`,
`kernel`, `elements`, `mesh`, `energy` and `io`.
"""

from .area_vectors import enclosed_volume, face_area_vectors, nodal_area_vectors, simpson_mean, unit_vectors
from .areas import area_gradient, corner_angles, face_areas, mean_edge_length, nodal_areas, slivers
from .barrier_schedule import BarrierSchedule, Steep
from .bilinear_surface import BilinearSurface
from .closest_point import ClosestPoints, CurveLocator, SurfaceLocator
from .closest_point_kernels import walk
from .distance_barrier import DistanceBarrier
from .distance_samples import Curves, Samples
from .edges import EdgeTable, edge_table
from .faces import Faces, corner_triangles, fan_triangles
from .features import (
    CORNER,
    CURVE,
    SHARP,
    SMOOTH,
    CreaseSchedule,
    Features,
    FeatureSchedule,
    InnerSheets,
    find_creases,
    find_features,
    find_inner_sheets,
    joined_features,
    kept_edges,
    nonmanifold_nodes,
    sharp_length,
    wire_features,
    with_one_side_out,
)
from .hausdorff import distance_between, faces_beyond, hausdorff
from .matching import Matching, MatchingSchedule, Skin, match_features
from .mean_distance import mean_distance

__all__ = [
    "CORNER",
    "CURVE",
    "SHARP",
    "SMOOTH",
    "BarrierSchedule",
    "BilinearSurface",
    "ClosestPoints",
    "CreaseSchedule",
    "CurveLocator",
    "Curves",
    "DistanceBarrier",
    "EdgeTable",
    "Faces",
    "FeatureSchedule",
    "Features",
    "InnerSheets",
    "Matching",
    "MatchingSchedule",
    "Samples",
    "Skin",
    "Steep",
    "SurfaceLocator",
    "area_gradient",
    "corner_angles",
    "corner_triangles",
    "distance_between",
    "edge_table",
    "enclosed_volume",
    "face_area_vectors",
    "face_areas",
    "faces_beyond",
    "fan_triangles",
    "find_creases",
    "find_features",
    "find_inner_sheets",
    "hausdorff",
    "joined_features",
    "kept_edges",
    "match_features",
    "mean_distance",
    "mean_edge_length",
    "nodal_area_vectors",
    "nodal_areas",
    "nonmanifold_nodes",
    "sharp_length",
    "simpson_mean",
    "slivers",
    "unit_vectors",
    "walk",
    "wire_features",
    "with_one_side_out",
]
