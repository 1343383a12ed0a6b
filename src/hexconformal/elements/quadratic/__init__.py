"""Quadratic cells of all types: their types, shape functions, validity and measures."""

from .cell_types import (
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
    between,
    edge_nodes,
    from_nodes,
    means_of_corners,
    quadratic_type,
    reference_nodes,
)
from .control_vectors import ControlVectors, control_vectors
from .measures import quadratic_measures
from .parts import CellParts, cell_parts
from .places import edge_derivatives, in_cube, nearest_corners, quadratic_rule
from .shape_functions import quadratic_polynomials, quadratic_shape_gradients, quadratic_shapes
from .validity import quadratic_bounds, quadratic_coefficients

__all__ = [
    "BETWEEN",
    "HEXAHEDRON20",
    "HEXAHEDRON27",
    "LATTICE",
    "PYRAMID13",
    "PYRAMID14",
    "QUADRATIC_TYPES",
    "SECOND_ORDER",
    "TETRAHEDRON10",
    "WEDGE15",
    "WEDGE18",
    "CellParts",
    "ControlVectors",
    "between",
    "cell_parts",
    "control_vectors",
    "edge_derivatives",
    "edge_nodes",
    "from_nodes",
    "in_cube",
    "means_of_corners",
    "nearest_corners",
    "quadratic_bounds",
    "quadratic_coefficients",
    "quadratic_measures",
    "quadratic_polynomials",
    "quadratic_rule",
    "quadratic_shape_gradients",
    "quadratic_shapes",
    "quadratic_type",
    "reference_nodes",
]
