"""The quaternion-distortion kernel, and how it is compiled and spread over threads.

Belongs here: algebra of single vectors, quaternions and frames, equations (2) to (8), which serves numpy and compiled
loops alike. Imports no other room.
"""

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
)
from .jit import algebra, loop, strict_loop
from .quaternion import Vector, add, combine, cross, dot, polar, scale, subtract
from .simd_frames import frame, put, put_inverses
from .small_matrices import cross_matrix, matrix_product, orthogonal, outer, plus, times, transposed
from .threads import parallel_ranges

__all__ = [
    "Frame",
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
    "frame",
    "frame_density",
    "frame_frozen_second",
    "frame_gradient",
    "frame_second",
    "loop",
    "matrix_product",
    "orthogonal",
    "outer",
    "parallel_ranges",
    "plane_density",
    "plane_gradient",
    "plane_normal",
    "plus",
    "polar",
    "put",
    "put_inverses",
    "scale",
    "strict_loop",
    "subtract",
    "times",
    "transposed",
]
