"""Compiled loop of equation (10a): the distortion at 27 points of quadratic hexahedra, and how even det J is there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...kernel import algebra, barrier_gradient, cofactor, combine, determinant, frame_at, loop, regularized, store

__all__ = ["quadratic_sums"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

# First rows of what the work array holds for each point.
_FRAME, _STRESS, _ENERGY, _DETERMINANT, _POSITIVE, _ROWS = 0, 9, 18, 19, 20, 21
_TINY = 1e-300  # keeps what is folded at eps = 0 huge rather than not a number


@algebra
def _store_frames(points: Field, cells: Ints, c: int, table: Field, boxes: Field, s: Field) -> None:
    """The columns of J W^-1 at the points."""
    s[_FRAME : _FRAME + 9] = 0.0
    for a in range(1, table.shape[1]):
        for k in range(3):
            x = points[cells[c, a], k] - points[cells[c, 0], k]
            for i in range(3):
                share = x / boxes[c, i] if len(boxes) > 0 else x
                for q in range(table.shape[2]):
                    s[_FRAME + 3 * i + k, q] += table[i, a, q] * share


@algebra
def _store_stresses(s: Field, weights: Field, eps: float, evenness: float) -> float:
    """Energy of a cell; its derivatives with respect to the columns, times the weights, stay in the array."""
    total = above = below = 0.0
    for q in range(len(weights)):
        f = frame_at(s, _FRAME, q)
        s[_ENERGY, q], stress = barrier_gradient(f, eps)
        store(stress, s, _STRESS, q)
        d = determinant(f)
        s[_DETERMINANT, q], s[_POSITIVE, q] = d, regularized(d, eps) + _TINY
        total += weights[q] * s[_ENERGY, q]
        above += weights[q] * s[_POSITIVE, q]
        below += weights[q] / s[_POSITIVE, q]
    uneven = 0.0
    for q in range(len(weights)):
        # The same as above * below - 1, as the weights sum to one, without cancellation.
        uneven += weights[q] * (s[_POSITIVE, q] - above) ** 2 / (s[_POSITIVE, q] * above)
        d, positive = s[_DETERMINANT, q], s[_POSITIVE, q]
        # The derivative of chi is chi / sqrt(eps^2 + d^2).
        slope = evenness * (below - above / positive**2) * positive / (np.sqrt(eps * eps + d * d) + _TINY)
        a, stress = cofactor(frame_at(s, _FRAME, q)), frame_at(s, _STRESS, q)
        w, v = weights[q], weights[q] * slope
        store(
            (
                combine(w, stress[0], v, a[0]),
                combine(w, stress[1], v, a[1]),
                combine(w, stress[2], v, a[2]),
            ),
            s,
            _STRESS,
            q,
        )
    return total + evenness * uneven


@loop
def quadratic_sums(first, last, points, cells, table, weights, boxes, eps, evenness, energies, forces):  # type: ignore[no-untyped-def]
    """Energy (m,) of each cell and its derivative (m, k, 3) with respect to the cell's own nodes.

    The table (3, k, q) holds derivatives of the shape functions at the points; weights (q,) sum to one. W
    has the edge lengths boxes (m, 3) of each cell on its diagonal, and is the identity where there are none.
    """
    s = np.empty((_ROWS, len(weights)))
    for c in range(first, last):
        _store_frames(points, cells, c, table, boxes, s)
        energies[c] = _store_stresses(s, weights, eps, evenness)
        for k in range(3):
            rest = 0.0
            for a in range(1, table.shape[1]):
                force = 0.0
                for i in range(3):
                    along = 0.0
                    for q in range(len(weights)):
                        along += table[i, a, q] * s[_STRESS + 3 * i + k, q]
                    force += along / boxes[c, i] if len(boxes) > 0 else along
                forces[c, a, k] = force
                rest -= force
            forces[c, 0, k] = rest
