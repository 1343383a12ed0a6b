"""Many cells together: the container of a mesh, which cells meet where, the order and unit that runs work in.

Belongs here: containers, topology, adjacency. Imports `common`, `kernel` and `elements`.
"""

from .adjacency import corner_incidences, find, node_pattern, scalar_matrix
from .arrays import checked_cells, checked_data, checked_points, frozen
from .edges import UniqueEdges, face_edges, unique_edges
from .hex_mesh import HexMesh
from .normalized_mesh import NormalizedMesh
from .spatial_order import along_curve
from .topology import (
    FaceTable,
    boundary_quads,
    by_first_appearance,
    components,
    connected_components,
    face_table,
    islands,
    rings,
)

__all__ = [
    "FaceTable",
    "HexMesh",
    "NormalizedMesh",
    "UniqueEdges",
    "along_curve",
    "boundary_quads",
    "by_first_appearance",
    "checked_cells",
    "checked_data",
    "checked_points",
    "components",
    "connected_components",
    "corner_incidences",
    "face_edges",
    "face_table",
    "find",
    "frozen",
    "islands",
    "node_pattern",
    "rings",
    "scalar_matrix",
    "unique_edges",
]
