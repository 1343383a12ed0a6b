"""Hexahedral meshes: the container, topology and adjacency, and a normalized copy that runs work on; and the container
of meshes of several types of cells.

Belongs here: containers, topology, adjacency, how values on nodes and cells are
summed up. Imports `common`, `kernel` and `elements`.
"""

from .adjacency import binary_search, corner_incidences, node_pattern, scalar_matrix
from .arrays import checked_cells, checked_data, checked_points, read_only
from .carried_cells import CarriedCells, telling_tags
from .couplings import Couplings, find_couplings
from .edges import face_edges, unique_edges
from .embedded import Embedded, find_embedded, same_rows
from .face_rows import face_keys, triangles_first, turned_over, whole_faces
from .hex_mesh import HexMesh, NodePairs
from .interfaces import Interfaces, curves_of, find_interfaces, region_surfaces, surfaces_around
from .middle_nodes import middle_nodes, middle_nodes_of_types, middles_between, with_middles
from .mixed_mesh import (
    CellBlock,
    MixedMesh,
    blocks_of,
    cells_in_rows,
    cells_of_no_nodes,
    collapsed_mesh,
    collapsed_table,
    counts_by_type,
    flat_nodes,
    require_nodes,
    with_wedges_upright,
)
from .normalized_mesh import NormalizedMesh
from .regions import REGION_ARRAYS, SURFACE_ARRAYS, Regions, find_regions, region_arrays
from .space import SERIAL, Space
from .spatial_order import curve_positions, morton_codes
from .topology import (
    FaceTable,
    boundary_depths,
    boundary_quads,
    components,
    connected_components,
    connected_regions,
    face_table,
    node_rings,
)

__all__ = [
    "REGION_ARRAYS",
    "SERIAL",
    "SURFACE_ARRAYS",
    "CarriedCells",
    "CellBlock",
    "Couplings",
    "Embedded",
    "FaceTable",
    "HexMesh",
    "Interfaces",
    "MixedMesh",
    "NodePairs",
    "NormalizedMesh",
    "Regions",
    "Space",
    "binary_search",
    "blocks_of",
    "boundary_depths",
    "boundary_quads",
    "cells_in_rows",
    "cells_of_no_nodes",
    "checked_cells",
    "checked_data",
    "checked_points",
    "collapsed_mesh",
    "collapsed_table",
    "components",
    "connected_components",
    "connected_regions",
    "corner_incidences",
    "counts_by_type",
    "curve_positions",
    "curves_of",
    "face_edges",
    "face_keys",
    "face_table",
    "find_couplings",
    "find_embedded",
    "find_interfaces",
    "find_regions",
    "flat_nodes",
    "middle_nodes",
    "middle_nodes_of_types",
    "middles_between",
    "morton_codes",
    "node_pattern",
    "node_rings",
    "read_only",
    "region_arrays",
    "region_surfaces",
    "require_nodes",
    "same_rows",
    "scalar_matrix",
    "surfaces_around",
    "telling_tags",
    "triangles_first",
    "turned_over",
    "unique_edges",
    "whole_faces",
    "with_middles",
    "with_wedges_upright",
]
