"""Compiled loop of equation (10a): the distortion at points of quadratic cells, and how even det J is there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...kernel import (
    Frame,
    algebra,
    barrier_factor,
    barrier_gradient,
    cofactor,
    combine,
    determinant,
    frame_at,
    frame_density,
    frame_gradient,
    loop,
    regularized,
    store,
)
from ..convex_frames import JACOBIAN_WEIGHT, directions, of_columns

__all__ = ["largest_angles", "quadratic_sums"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

# First rows of what the work array holds for each point.
_FRAME, _STRESS, _ENERGY, _DETERMINANT, _POSITIVE, _ROWS = 0, 9, 18, 19, 20, 21
_TINY = 1e-300  # keeps what is folded at eps = 0 huge rather than not a number


@algebra
def _store_frames(points: Field, cells: Ints, c: int, table: Field, boxes: Field, s: Field) -> None:
    """The columns of J at the points."""
    s[_FRAME : _FRAME + 9] = 0.0
    for a in range(1, table.shape[1]):
        for k in range(3):
            x = points[cells[c, a], k] - points[cells[c, 0], k]
            for i in range(3):
                share = x / boxes[c, i] if len(boxes) > 0 else x
                for q in range(table.shape[2]):
                    s[_FRAME + 3 * i + k, q] += table[i, a, q] * share


@algebra
def _angle_density(f: Frame) -> float:
    """e(u) of the unit columns u of a frame, which grows with the angles between them alone."""
    u, _ = directions(f)
    return (frame_density(u) + JACOBIAN_WEIGHT) * barrier_factor(determinant(u), 0.0)[0] - JACOBIAN_WEIGHT


@algebra
def _add_angles(s: Field, count: int, angle: float, stiffness: float) -> float:
    """Mean of phi(e(u)) over the points, times a weight, and its derivatives; infinite beyond the stiffness."""
    total, share = 0.0, angle / count
    for q in range(count):
        f = frame_at(s, _FRAME, q)
        u, r = directions(f)
        d = determinant(u)
        density, g = frame_gradient(u)
        factor, slope, _ = barrier_factor(d, 0.0)
        density += JACOBIAN_WEIGHT
        e, a = density * factor - JACOBIAN_WEIGHT, cofactor(u)
        margin = 1.0 - stiffness * e
        if not (d > 0.0 and margin > 0.0):
            return np.inf
        total += share * e / margin
        steep = share / (margin * margin)
        turned = (
            combine(steep * factor, g[0], steep * density * slope, a[0]),
            combine(steep * factor, g[1], steep * density * slope, a[1]),
            combine(steep * factor, g[2], steep * density * slope, a[2]),
        )
        v, stress = of_columns(u, r, turned), frame_at(s, _STRESS, q)
        store(
            (
                combine(1.0, stress[0], 1.0, v[0]),
                combine(1.0, stress[1], 1.0, v[1]),
                combine(1.0, stress[2], 1.0, v[2]),
            ),
            s,
            _STRESS,
            q,
        )
    return total


@algebra
def _store_stresses(s: Field, weights: Field, eps: float, evenness: float, distortion: float) -> float:
    """Distortion of a cell; its derivatives with respect to the columns, times the weights, stay in the array."""
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
        w, v = distortion * weights[q], weights[q] * slope
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
    return distortion * total + evenness * uneven


@loop
def quadratic_sums(  # type: ignore[no-untyped-def]
    first, last, points, cells, table, weights, boxes, eps, evenness, distortion, angle, stiffness, energies, forces
):
    """Energy (m,) of each cell and its derivative (m, k, 3) with respect to the cell's own nodes.

    The table (3, k, q) takes nodes to the columns of J at the points; weights (q,) sum to one. These are divided by
    boxes (m, 3), the edge lengths along the axes of the ideal, where there are any. Weights
    and stiffness as of equation (12): distortion * e + evenness + angle * phi(e(u)), the latter at all points alike.
    """
    s = np.empty((_ROWS, len(weights)))
    for c in range(first, last):
        _store_frames(points, cells, c, table, boxes, s)
        energies[c] = _store_stresses(s, weights, eps, evenness, distortion)
        if angle > 0.0:
            energies[c] += _add_angles(s, len(weights), angle, stiffness)
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


@loop
def largest_angles(first, last, points, cells, table, boxes, out):  # type: ignore[no-untyped-def]
    """Per cell (m,) the largest e(u) at the points; infinite where one is folded."""
    s = np.empty((_ROWS, table.shape[2]))
    for c in range(first, last):
        _store_frames(points, cells, c, table, boxes, s)
        out[c] = 0.0
        for q in range(table.shape[2]):
            f = frame_at(s, _FRAME, q)
            out[c] = max(out[c], _angle_density(f)) if determinant(f) > 0.0 else np.inf
