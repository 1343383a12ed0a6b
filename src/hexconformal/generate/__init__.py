"""Meshes made from formulas, for demonstrations and tests: regular ones, and valid but distorted ones.

Every generator of hexahedra returns ``(points, cells)``: (n, 3) float64 and (m, 8) int64 in VTK node order; those of
other types return the cells by the name of their type, as :func:`hexconformal.as_volume_mesh` takes them.

Imports `common`, `elements` and `mesh`.
"""

from .bricks import bent_bar, boundary_layer, box, sheared_block, sheared_cube, twisted_cube
from .jitter import jittered
from .o_grids import ball, curved_ball, curved_cylinder, cylinder
from .swept import swept_cylinder

__all__ = [
    "ball",
    "bent_bar",
    "boundary_layer",
    "box",
    "curved_ball",
    "curved_cylinder",
    "cylinder",
    "jittered",
    "sheared_block",
    "sheared_cube",
    "swept_cylinder",
    "twisted_cube",
]
