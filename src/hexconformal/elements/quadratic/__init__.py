"""Quadratic hexahedra of 20 and 27 nodes: their types, shape functions, validity and measures."""

from .cell_types import (
    BETWEEN,
    EDGE_NODES,
    HEXAHEDRON20,
    HEXAHEDRON27,
    LATTICE,
    QUADRATIC_TYPES,
    SECOND_ORDER,
    from_nodes,
)
from .control_vectors import ControlVectors, control_vectors
from .measures import quadratic_measures
from .parts import CellParts, cell_parts
from .shape_functions import quadratic_polynomials, quadratic_shape_gradients, quadratic_shapes
from .validity import quadratic_bounds, quadratic_coefficients

__all__ = [
    "BETWEEN",
    "EDGE_NODES",
    "HEXAHEDRON20",
    "HEXAHEDRON27",
    "LATTICE",
    "QUADRATIC_TYPES",
    "SECOND_ORDER",
    "CellParts",
    "ControlVectors",
    "cell_parts",
    "control_vectors",
    "from_nodes",
    "quadratic_bounds",
    "quadratic_coefficients",
    "quadratic_measures",
    "quadratic_polynomials",
    "quadratic_shape_gradients",
    "quadratic_shapes",
]
