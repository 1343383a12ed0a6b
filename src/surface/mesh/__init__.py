"""Surface meshes: the container, its geometry and its edges.

Belongs here: what is known of triangles and quadrilaterals without asking for their quality. Imports
`hexconformal.common`, `hexconformal.elements`, `hexconformal.mesh` and `hexconformal.io`.
"""

from .edges import EdgeTable, edge_table
from .geometry import (
    Cells,
    Floats,
    Ints,
    area_gradient,
    area_vectors,
    cell_angles,
    cell_areas,
    corner_triangles,
    enclosed_volume,
    fan_triangles,
    mean_edge_length,
    nodal_area_vectors,
    nodal_areas,
    slivers,
    unit_vectors,
)
from .surface_mesh import ArraysOrigin, SurfaceMesh

__all__ = [
    "ArraysOrigin",
    "Cells",
    "EdgeTable",
    "Floats",
    "Ints",
    "SurfaceMesh",
    "area_gradient",
    "area_vectors",
    "cell_angles",
    "cell_areas",
    "corner_triangles",
    "edge_table",
    "enclosed_volume",
    "fan_triangles",
    "mean_edge_length",
    "nodal_area_vectors",
    "nodal_areas",
    "slivers",
    "unit_vectors",
]
