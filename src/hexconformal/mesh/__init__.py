"""Hexahedral meshes: the container, topology and adjacency, and a normalized copy that runs work on.

Belongs here: containers, topology, adjacency. Imports `common`, `kernel` and `elements`.
"""

from .adjacency import binary_search, corner_incidences, node_pattern, scalar_matrix
from .arrays import checked_cells, checked_data, checked_points, read_only
from .couplings import Couplings, find_couplings
from .edges import face_edges, unique_edges
from .hex_mesh import HexMesh
from .node_pairs import NodePairs
from .normalized_mesh import NormalizedMesh
from .regions import Regions, find_regions, interface_quads
from .spatial_order import morton_codes
from .topology import (
    FaceTable,
    boundary_quads,
    components,
    connected_components,
    connected_regions,
    face_table,
    node_rings,
)

__all__ = [
    "Couplings",
    "FaceTable",
    "HexMesh",
    "NodePairs",
    "NormalizedMesh",
    "Regions",
    "binary_search",
    "boundary_quads",
    "checked_cells",
    "checked_data",
    "checked_points",
    "components",
    "connected_components",
    "connected_regions",
    "corner_incidences",
    "face_edges",
    "face_table",
    "find_couplings",
    "find_regions",
    "interface_quads",
    "morton_codes",
    "node_pattern",
    "node_rings",
    "read_only",
    "scalar_matrix",
    "unique_edges",
]
