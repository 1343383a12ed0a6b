"""The kernel of the quaternionic distortion, and the compiling and threading of loops.

Belongs here: algebra of single vectors, quaternions and frames, equations (2) to (8), which serves numpy and compiled
loops alike. Imports `common`.
"""

from .cell_chunks import CellChunks
from .distortion import (
    Frame,
    barrier_factor,
    barrier_gradient,
    barrier_second,
    cofactor,
    determinant,
    frame_density,
    frame_frozen_second,
    frame_gradient,
    frame_second,
    plane_density,
    plane_gradient,
    plane_normal,
    regularized,
)
from .jit import algebra, loop, strict_loop
from .quaternion import Vector, add, combine, cross, dot, polar, scale, subtract
from .simd_frames import EIGHT, Lanes, frame_at, store, store_inverses, vector_at
from .small_matrices import cross_matrix, matrix_product, orthogonal_projection, outer_sum, plus, times, transpose
from .threads import parallel_ranges, use_threads

__all__ = [
    "EIGHT",
    "CellChunks",
    "Frame",
    "Lanes",
    "Vector",
    "add",
    "algebra",
    "barrier_factor",
    "barrier_gradient",
    "barrier_second",
    "cofactor",
    "combine",
    "cross",
    "cross_matrix",
    "determinant",
    "dot",
    "frame_at",
    "frame_density",
    "frame_frozen_second",
    "frame_gradient",
    "frame_second",
    "loop",
    "matrix_product",
    "orthogonal_projection",
    "outer_sum",
    "parallel_ranges",
    "plane_density",
    "plane_gradient",
    "plane_normal",
    "plus",
    "polar",
    "regularized",
    "scale",
    "store",
    "store_inverses",
    "strict_loop",
    "subtract",
    "times",
    "transpose",
    "use_threads",
    "vector_at",
]
