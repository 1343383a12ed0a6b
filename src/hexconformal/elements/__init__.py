"""Types of cells, a module each: their nodes, edges and faces, their ideals, and measures of single cells.

Belongs here: tables of a type of cell, cells of all types in one table, loops over cells that look at one cell at a
time, validity by Bernstein coefficients, equations (13) and (13c). Imports `kernel`.
"""

from .cell_measures import MEASURES, cell_measures
from .cell_type import CellType
from .collapsed import COLLAPSED, TypedRows, are_collapsed, collapsed_cells, recognized, rows_by_type
from .hexahedron import (
    CORNER_NEIGHBOURS,
    CORNERS,
    EDGES,
    FACES,
    HEXAHEDRON,
    QUADRATURE_RULES,
    edge_weights,
    gauss_rule,
    shape_gradients,
)
from .lengths_volumes import cell_volumes, edge_lengths
from .linear_measures import measures_of
from .linear_validity import determinant_bounds, valid_cells
from .pyramid import PYRAMID
from .quadratic import (
    BETWEEN,
    EDGE_NODES,
    HEXAHEDRON20,
    HEXAHEDRON27,
    LATTICE,
    QUADRATIC_TYPES,
    SECOND_ORDER,
    CellParts,
    cell_parts,
    from_nodes,
    quadratic_bounds,
    quadratic_coefficients,
    quadratic_measures,
    quadratic_polynomials,
    quadratic_shape_gradients,
    quadratic_shapes,
)
from .registry import CELL_TYPES, SOLID_TYPES
from .table_measures import all_valid, corner_scaled_jacobian, corner_shape, is_valid, minimum_jacobian
from .tetrahedron import TETRAHEDRON
from .validity import contiguous
from .wedge import WEDGE

__all__ = [
    "BETWEEN",
    "CELL_TYPES",
    "COLLAPSED",
    "CORNERS",
    "CORNER_NEIGHBOURS",
    "EDGES",
    "EDGE_NODES",
    "FACES",
    "HEXAHEDRON",
    "HEXAHEDRON20",
    "HEXAHEDRON27",
    "LATTICE",
    "MEASURES",
    "PYRAMID",
    "QUADRATIC_TYPES",
    "QUADRATURE_RULES",
    "SECOND_ORDER",
    "SOLID_TYPES",
    "TETRAHEDRON",
    "WEDGE",
    "CellParts",
    "CellType",
    "TypedRows",
    "all_valid",
    "are_collapsed",
    "cell_measures",
    "cell_parts",
    "cell_volumes",
    "collapsed_cells",
    "contiguous",
    "corner_scaled_jacobian",
    "corner_shape",
    "determinant_bounds",
    "edge_lengths",
    "edge_weights",
    "from_nodes",
    "gauss_rule",
    "is_valid",
    "measures_of",
    "minimum_jacobian",
    "quadratic_bounds",
    "quadratic_coefficients",
    "quadratic_measures",
    "quadratic_polynomials",
    "quadratic_shape_gradients",
    "quadratic_shapes",
    "recognized",
    "rows_by_type",
    "shape_gradients",
    "valid_cells",
]
