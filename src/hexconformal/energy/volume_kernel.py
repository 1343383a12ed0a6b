"""Compiled loop of the volume term.

A cell of volume V that should have the volume W pays V / W + W / V - 2: nothing at W, the same for a times too large
and a times too small, infinitely much for none. With g = dV / V and r = V / W its first derivative is (r - 1 / r) g;
of the second, the part max(2 / r, r + 1 / r) g g^T is kept. Equation (10) of docs/mathematics.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..elements import FACES
from ..kernel import algebra, loop
from .block_matrix import Places

__all__ = ["volume_sums"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@algebra
def _join_places(cells: Ints, c: int, g: Field) -> None:
    """Of a collapsed cell: what belongs to one node at several places of the row goes to the first of them."""
    for a in range(1, 8):
        for b in range(a):
            if cells[c, a] == cells[c, b]:
                for i in range(3):
                    g[b, i] += g[a, i]
                    g[a, i] = 0.0
                break


@algebra
def _sum(
    first: int, last: int, points: Field, cells: Ints, target: Field, weight: float, order: int,
    forces: Field, data: Field, places: Places,
) -> float:  # fmt: skip
    """That of cells first to last; see :func:`volume_sums`."""
    x, g, total = np.empty((8, 3)), np.empty((8, 3)), 0.0
    for c in range(first, last):
        if not target[c] > 0.0:
            continue
        for a in range(8):
            for i in range(3):
                x[a, i] = points[cells[c, a], i] - points[cells[c, 0], i]
                g[a, i] = 0.0
        volume = 0.0
        for f in range(6):
            n0, n1, n2, n3 = FACES[f, 0], FACES[f, 1], FACES[f, 2], FACES[f, 3]
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                # Sum of the nodes s, diagonals p and q of a face: it contributes s . (p x q) / 24.
                sj, sk = x[n0, j] + x[n1, j] + x[n2, j] + x[n3, j], x[n0, k] + x[n1, k] + x[n2, k] + x[n3, k]
                pj, pk, qj, qk = x[n2, j] - x[n0, j], x[n2, k] - x[n0, k], x[n3, j] - x[n1, j], x[n3, k] - x[n1, k]
                area, turned_p, turned_q = pj * qk - pk * qj, qj * sk - qk * sj, sj * pk - sk * pj
                volume += (x[n0, i] + x[n1, i] + x[n2, i] + x[n3, i]) * area / 24.0
                g[n0, i] += (area - turned_p) / 24.0
                g[n1, i] += (area - turned_q) / 24.0
                g[n2, i] += (area + turned_p) / 24.0
                g[n3, i] += (area + turned_q) / 24.0
        ratio = volume / target[c]
        if not ratio > 0.0:
            return np.inf
        total += weight * (ratio + 1.0 / ratio - 2.0)
        if order == 0:
            continue
        if cells[c, 6] == cells[c, 7]:
            _join_places(cells, c, g)
        slope = weight * (ratio - 1.0 / ratio)
        curvature = weight * max(2.0 / ratio, ratio + 1.0 / ratio)
        for a in range(8):
            for i in range(3):
                g[a, i] /= volume
                forces[cells[c, a], i] += slope * g[a, i]
        for a in range(8 if order > 1 else 0):
            for b in range(a + 1):
                place = places[c, a * (a + 1) // 2 + b]
                if place < 0:
                    continue
                share = 2.0 * curvature if a == b else curvature
                row, column = (a, b) if cells[c, a] >= cells[c, b] else (b, a)
                for i in range(3):
                    for k in range(3):
                        data[place, i, k] += share * g[row, i] * g[column, k]
    return total


@loop
def volume_sums(  # type: ignore[no-untyped-def]
    first, last, chunks, size, sums, points, cells, target, weight, order, forces, data, places
):
    """Sum of weight (V / W + W / V - 2) over the cells whose target volume W (m,) is positive; infinite for V <= 0.

    With order 1 adds the first derivative to forces (n, 3), with order 2 also the convex part of the second to the
    3 x 3 blocks data at places (m, 36), see :func:`hexconformal.energy.block_matrix.block_places`. There may be no
    blocks for the two ends of a diagonal of the cell, so (g_a . x_a - g_b . x_b)^2 is added for those, which takes the
    mixed terms away. A sum for each of some chunks of cells, see :class:`hexconformal.kernel.CellChunks`.
    """
    for n in range(first, last):
        chunk = chunks[n]
        begin, end = chunk * size, min((chunk + 1) * size, len(cells))
        sums[chunk] = _sum(begin, end, points, cells, target, weight, order, forces, data, places)
        if sums[chunk] == np.inf:
            return
