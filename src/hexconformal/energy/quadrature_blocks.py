"""Compiled loop of equation (11) at quadrature points: values, gradients and convex Hessian blocks, cell by cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import EIGHT, algebra, frame_at, loop, matrix_product, store, store_inverses, transpose
from .block_matrix import Places
from .convex_frames import DENSITY, FOLDED, FRAME, MARGIN, ROWS, store_distortion, store_quaternionic
from .corner_blocks import BLOCKS, COLUMN, INVERSE, add_local, pull_back

__all__ = ["convex_sums"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@algebra
def _store_frames(points: Field, cells: Ints, c: int, shapes: Field, inverses: Field, s: Field) -> None:
    """The frames J W^-1 at the quadrature points of a cell, from the gradients of the shape functions there."""
    for q in range(8):
        for i in range(3):
            for k in range(3):
                total = 0.0
                for a in range(1, 8):
                    total += shapes[q, a, i] * (points[cells[c, a], k] - points[cells[c, 0], k])
                s[FRAME + 3 * i + k, q] = total
    store_inverses(inverses, c, s, INVERSE, EIGHT)
    if len(inverses) > 0:
        for q in range(8):
            store(matrix_product(transpose(frame_at(s, INVERSE, q)), frame_at(s, FRAME, q)), s, FRAME, q)


@algebra
def _pair(i: int, j: int) -> int:
    """First row of the second derivatives with respect to columns i <= j."""
    return BLOCKS + 9 * (i * (5 - i) // 2 + j)


@algebra
def _gather(s: Field, shapes: Field, local: Field) -> None:
    """Blocks (36, 3, 3) of the pairs a >= b of the cell's nodes."""
    local[:] = 0.0
    for q in range(8):
        for a in range(8):
            for b in range(a + 1):
                pair = a * (a + 1) // 2 + b
                for i in range(3):
                    for j in range(3):
                        share = shapes[q, a, i] * shapes[q, b, j]
                        row = _pair(min(i, j), max(i, j))
                        for r in range(3):
                            for k in range(3):
                                entry = 3 * r + k if i <= j else 3 * k + r
                                local[pair, r, k] += share * s[row + entry, q]


@algebra
def _sum(
    first: int, last: int, points: Field, cells: Ints, shapes: Field, weights: Field, scales: Field, inverses: Field,
    eps: float, forces: Field, data: Field, places: Places,
) -> float:  # fmt: skip
    """That of cells first to last; see :func:`convex_sums`."""
    s, local, total = np.empty((ROWS, 8)), np.empty((36, 3, 3)), 0.0
    for c in range(first, last):
        _store_frames(points, cells, c, shapes, inverses, s)
        scale = scales[c] if len(scales) > 1 else scales[0]
        if eps < 0.0:
            store_quaternionic(s, scale, EIGHT)
        else:
            store_distortion(s, eps, scale, EIGHT)
        for q in range(8):
            if not (s[MARGIN, q] > 0.0 and s[DENSITY, q] < FOLDED):
                return np.inf
            total += weights[q] * s[DENSITY, q]
        for row in range(COLUMN, BLOCKS + 54):
            for q in range(8):
                s[row, q] *= weights[q]
        if len(inverses) > 0:
            pull_back(s, EIGHT)
        for q in range(8):
            for a in range(8):
                for k in range(3):
                    force = 0.0
                    for i in range(3):
                        force += shapes[q, a, i] * s[COLUMN + 3 * i + k, q]
                    forces[cells[c, a], k] += force
        _gather(s, shapes, local)
        add_local(cells, c, places, local, data, EIGHT)
    return total


@loop
def convex_sums(  # type: ignore[no-untyped-def]
    first, last, chunks, size, sums, points, cells, shapes, weights, scales, inverses, eps, forces, data, places
):
    """Sum of the densities times weights (8,) of the points and scales of the cells; infinite where one is folded.

    Adds the first derivative to forces (n, 3) and the convex Hessian to the 3 x 3 blocks data at places (m, 36). The
    sign of eps tells the energy: negative is the quaternionic one. A sum for each of some chunks of cells, see
    :class:`hexconformal.kernel.CellChunks`.
    """
    for n in range(first, last):
        chunk = chunks[n]
        begin, end = chunk * size, min((chunk + 1) * size, len(cells))
        sums[chunk] = _sum(begin, end, points, cells, shapes, weights, scales, inverses, eps, forces, data, places)
        if sums[chunk] == np.inf:
            return
