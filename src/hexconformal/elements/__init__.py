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
    HEXAHEDRON20,
    HEXAHEDRON27,
    LATTICE,
    PYRAMID13,
    PYRAMID14,
    QUADRATIC_TYPES,
    SECOND_ORDER,
    TETRAHEDRON10,
    WEDGE15,
    WEDGE18,
    CellParts,
    between,
    cell_parts,
    edge_derivatives,
    edge_nodes,
    from_nodes,
    in_cube,
    means_of_corners,
    quadratic_bounds,
    quadratic_coefficients,
    quadratic_measures,
    quadratic_polynomials,
    quadratic_rule,
    quadratic_shape_gradients,
    quadratic_shapes,
    quadratic_type,
    reference_nodes,
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
    "FACES",
    "HEXAHEDRON",
    "HEXAHEDRON20",
    "HEXAHEDRON27",
    "LATTICE",
    "MEASURES",
    "PYRAMID",
    "PYRAMID13",
    "PYRAMID14",
    "QUADRATIC_TYPES",
    "QUADRATURE_RULES",
    "SECOND_ORDER",
    "SOLID_TYPES",
    "TETRAHEDRON",
    "TETRAHEDRON10",
    "WEDGE",
    "WEDGE15",
    "WEDGE18",
    "CellParts",
    "CellType",
    "TypedRows",
    "all_valid",
    "are_collapsed",
    "between",
    "cell_measures",
    "cell_parts",
    "cell_volumes",
    "collapsed_cells",
    "contiguous",
    "corner_scaled_jacobian",
    "corner_shape",
    "determinant_bounds",
    "edge_derivatives",
    "edge_lengths",
    "edge_nodes",
    "edge_weights",
    "from_nodes",
    "gauss_rule",
    "in_cube",
    "is_valid",
    "means_of_corners",
    "measures_of",
    "minimum_jacobian",
    "quadratic_bounds",
    "quadratic_coefficients",
    "quadratic_measures",
    "quadratic_polynomials",
    "quadratic_rule",
    "quadratic_shape_gradients",
    "quadratic_shapes",
    "quadratic_type",
    "recognized",
    "reference_nodes",
    "rows_by_type",
    "shape_gradients",
    "valid_cells",
]
