"""The hexahedron: its nodes, edges and faces, and measures of single cells.

Belongs here: tables of a type of cell, loops over cells that look at one cell at a time, validity by Bernstein
coefficients, equation (13). Imports `kernel`.
"""

from .cell_measures import MEASURES, cell_measures, corner_scaled_jacobian, corner_shape
from .hexahedron import (
    CORNER_NEIGHBOURS,
    CORNERS,
    EDGES,
    FACES,
    QUADRATURE_RULES,
    edge_weights,
    gauss_rule,
    shape_gradients,
)
from .lengths_volumes import cell_volumes, edge_lengths
from .validity import all_valid, contiguous, is_valid, minimum_jacobian

__all__ = [
    "CORNERS",
    "CORNER_NEIGHBOURS",
    "EDGES",
    "FACES",
    "MEASURES",
    "QUADRATURE_RULES",
    "all_valid",
    "cell_measures",
    "cell_volumes",
    "contiguous",
    "corner_scaled_jacobian",
    "corner_shape",
    "edge_lengths",
    "edge_weights",
    "gauss_rule",
    "is_valid",
    "minimum_jacobian",
    "shape_gradients",
]
