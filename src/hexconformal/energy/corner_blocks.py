"""Derivatives with respect to the nodes of a cell, from those with respect to the frames at its corners."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import Lanes, algebra, frame_at, matrix_product, plus, scale, store, times, transpose
from .block_matrix import Places

__all__ = [
    "BLOCKS",
    "COLUMN",
    "END",
    "INVERSE",
    "SIGN",
    "add_blocks",
    "add_forces",
    "add_local",
    "pull_back",
    "to_nodes",
]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

# First rows of what the work array (hexconformal.kernel.simd_frames) of the corners holds here: first derivatives;
# second ones, of the pairs of columns 11, 12, 13, 22, 23, 33, nine rows each; those of each neighbour with the corner
# itself, and of the corner with itself; W^-1; and the signs that turn edges into derivatives.
COLUMN, BLOCKS, _MIXED, _OWN, INVERSE, SIGN, END = 0, 9, 63, 90, 99, 108, 111


@algebra
def pull_back(s: Field, lanes: Lanes) -> None:
    """Derivatives with respect to J W^-1 become derivatives with respect to J."""
    for q in range(len(lanes)):
        store(matrix_product(frame_at(s, INVERSE, q), frame_at(s, COLUMN, q)), s, COLUMN, q)
    for k in range(3):
        for l in range(k + 1):
            one, two = BLOCKS + 3 * k + l, BLOCKS + 3 * l + k
            for q in range(len(lanes)):
                # Entries (k, l) of all nine blocks, as a matrix over the pairs of columns.
                m = (
                    (s[one, q], s[one + 9, q], s[one + 18, q]),
                    (s[two + 9, q], s[one + 27, q], s[one + 36, q]),
                    (s[two + 18, q], s[two + 36, q], s[one + 45, q]),
                )
                w = frame_at(s, INVERSE, q)
                m = matrix_product(matrix_product(w, m), transpose(w))
                s[one, q], s[one + 9, q], s[one + 18, q] = m[0]
                s[two + 9, q], s[one + 27, q], s[one + 36, q] = m[1]
                s[two + 18, q], s[two + 36, q], s[one + 45, q] = m[2]
                s[two, q], s[two + 27, q], s[two + 45, q] = m[0][0], m[1][1], m[2][2]


@algebra
def to_nodes(s: Field, lanes: Lanes) -> None:
    """Derivatives with respect to edges, then to the nodes: moving the corner itself moves all three edges back."""
    for q in range(len(lanes)):
        x, y, z = s[SIGN, q], s[SIGN + 1, q], s[SIGN + 2, q]
        f = frame_at(s, COLUMN, q)
        store((scale(x, f[0]), scale(y, f[1]), scale(z, f[2])), s, COLUMN, q)
        b00, b11, b22 = frame_at(s, BLOCKS, q), frame_at(s, BLOCKS + 27, q), frame_at(s, BLOCKS + 45, q)
        b01 = times(x * y, frame_at(s, BLOCKS + 9, q))
        b02 = times(x * z, frame_at(s, BLOCKS + 18, q))
        b12 = times(y * z, frame_at(s, BLOCKS + 36, q))
        store(b01, s, BLOCKS + 9, q)
        store(b02, s, BLOCKS + 18, q)
        store(b12, s, BLOCKS + 36, q)
        m0 = plus(b00, plus(b01, b02))
        m1 = plus(transpose(b01), plus(b11, b12))
        m2 = plus(transpose(b02), plus(transpose(b12), b22))
        store(times(-1.0, m0), s, _MIXED, q)
        store(times(-1.0, m1), s, _MIXED + 9, q)
        store(times(-1.0, m2), s, _MIXED + 18, q)
        store(plus(m0, plus(m1, m2)), s, _OWN, q)


@algebra
def _add_block(s: Field, row: int, q: int, a: int, b: int, local: Field) -> None:
    """Add block (a, b) of the cell's nodes to local (36, 3, 3), which holds the pairs a >= b."""
    if a >= b:
        pair = a * (a + 1) // 2 + b
        for r in range(3):
            for c in range(3):
                local[pair, r, c] += s[row + 3 * r + c, q]
    else:
        pair = b * (b + 1) // 2 + a
        for r in range(3):
            for c in range(3):
                local[pair, c, r] += s[row + 3 * r + c, q]


@algebra
def _gather(s: Field, corners: Ints, local: Field, lanes: Lanes) -> None:
    """Blocks of the cell's nodes from those of its corners."""
    local[:] = 0.0
    for q in range(len(lanes)):
        x, y, z = corners[q, 0], corners[q, 1], corners[q, 2]
        _add_block(s, BLOCKS, q, x, x, local)
        _add_block(s, BLOCKS + 9, q, x, y, local)
        _add_block(s, BLOCKS + 18, q, x, z, local)
        _add_block(s, BLOCKS + 27, q, y, y, local)
        _add_block(s, BLOCKS + 36, q, y, z, local)
        _add_block(s, BLOCKS + 45, q, z, z, local)
        _add_block(s, _MIXED, q, x, q, local)
        _add_block(s, _MIXED + 9, q, y, q, local)
        _add_block(s, _MIXED + 18, q, z, q, local)
        _add_block(s, _OWN, q, q, q, local)


@algebra
def add_forces(s: Field, cells: Ints, c: int, corners: Ints, forces: Field, lanes: Lanes) -> None:
    """Add the first derivatives of a cell to forces (n, 3)."""
    for q in range(len(lanes)):
        for i in range(3):
            for k in range(3):
                force = s[COLUMN + 3 * i + k, q]
                forces[cells[c, corners[q, i]], k] += force
                forces[cells[c, q], k] -= force


@algebra
def add_blocks(
    s: Field, cells: Ints, c: int, corners: Ints, places: Places, local: Field, data: Field, lanes: Lanes, nodes: Lanes
) -> None:
    """Add the second derivatives of a cell to the blocks data at places (m, 36); local (36, 3, 3) is for use here."""
    _gather(s, corners, local, lanes)
    add_local(cells, c, places, local, data, nodes)


@algebra
def add_local(cells: Ints, c: int, places: Places, local: Field, data: Field, nodes: Lanes) -> None:
    """Add the blocks local (36, 3, 3) of a cell to the blocks data at places (m, 36), where there are any."""
    for a in range(len(nodes)):
        for b in range(a + 1):
            pair = a * (a + 1) // 2 + b
            place = places[c, pair]
            if place < 0:
                continue
            if cells[c, a] >= cells[c, b]:
                for r in range(3):
                    for k in range(3):
                        data[place, r, k] += local[pair, r, k]
            else:
                for r in range(3):
                    for k in range(3):
                        data[place, r, k] += local[pair, k, r]
