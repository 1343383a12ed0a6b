"""Surface meshes: the container, its geometry and its edges.

Belongs here: what is known of triangles and quadrilaterals without asking for their quality. Imports
`hexconformal.common`, `hexconformal.mesh` and `hexconformal.io`.
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
    mean_edge_length,
    nodal_areas,
    nodal_vectors,
    slivers,
    transport_vectors,
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
    "mean_edge_length",
    "nodal_areas",
    "nodal_vectors",
    "slivers",
    "transport_vectors",
    "unit_vectors",
]
