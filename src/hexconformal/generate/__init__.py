"""Hexahedral meshes made from formulas, for demonstrations and tests: regular ones, and valid but distorted ones.

Every generator returns ``(points, cells)``: (n, 3) float64 and (m, 8) int64 in VTK node order.

Imports `common`, `elements` and `mesh`.
"""

from .bricks import bent_bar, boundary_layer, box, sheared_block, sheared_cube, twisted_cube
from .jitter import jittered
from .o_grids import ball, cylinder

__all__ = [
    "ball",
    "bent_bar",
    "boundary_layer",
    "box",
    "cylinder",
    "jittered",
    "sheared_block",
    "sheared_cube",
    "twisted_cube",
]
