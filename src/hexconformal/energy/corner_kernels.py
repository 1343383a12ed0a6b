"""Compiled loops over the corners of cells: values, gradients and convex Hessian blocks of equations (8) and (12)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import (
    Frame,
    Lanes,
    algebra,
    barrier_factor,
    determinant,
    dot,
    frame_at,
    frame_density,
    loop,
    matrix_product,
    store,
    store_inverses,
    transpose,
)
from .block_matrix import Places
from .convex_frames import (
    DENSITY,
    FOLDED,
    FRAME,
    JACOBIAN_WEIGHT,
    MARGIN,
    ROWS,
    add_angles,
    add_proportions,
    add_shapes,
    directions,
    store_distortion,
)
from .corner_blocks import COLUMN, INVERSE, SIGN, add_blocks, add_forces, pull_back, to_nodes

__all__ = ["corner_densities", "corner_fullness", "corner_sums"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@algebra
def _store_frames(points: Field, cells: Ints, c: int, corners: Ints, inverses: Field, s: Field, lanes: Lanes) -> None:
    """The frames at the corners of a cell, W^-1 there, and the signs that turn edges into derivatives."""
    for q in range(len(lanes)):
        here = cells[c, q]
        for i in range(3):
            there, sign = cells[c, corners[q, i]], corners[q, 3 + i]
            s[SIGN + i, q] = sign
            for k in range(3):
                s[FRAME + 3 * i + k, q] = sign * (points[there, k] - points[here, k])
    store_inverses(inverses, c, s, INVERSE, lanes)
    if len(inverses) > 0:
        for q in range(len(lanes)):
            store(matrix_product(transpose(frame_at(s, INVERSE, q)), frame_at(s, FRAME, q)), s, FRAME, q)


@algebra
def _angle_density(f: Frame, lanes: Lanes) -> tuple[float, float]:
    """e(u) of the unit columns u of a frame of a hexahedron, e(f) of other types; and the determinant."""
    if len(lanes) < 8:
        d = determinant(f)
        return frame_density(f) * barrier_factor(d, 0.0)[0], d
    u, _ = directions(f)
    d = determinant(u)
    return (frame_density(u) + JACOBIAN_WEIGHT) * barrier_factor(d, 0.0)[0] - JACOBIAN_WEIGHT, d


@algebra
def _store_densities(s: Field, eps: float, distortion: float, angle: float, stiffness: float, lanes: Lanes) -> None:
    """Density of each corner, and the margin that has to be positive there."""
    for q in range(len(lanes)):
        f = frame_at(s, FRAME, q)
        d = determinant(f)
        s[DENSITY, q] = distortion * frame_density(f) * barrier_factor(d, eps)[0]
        s[MARGIN, q] = d if eps == 0.0 else 1.0
    if angle > 0.0:
        for q in range(len(lanes)):
            density, d = _angle_density(frame_at(s, FRAME, q), lanes)
            margin = 1.0 - stiffness * density
            s[DENSITY, q] += angle * density / margin
            s[MARGIN, q] = min(s[MARGIN, q], min(margin, d))


@algebra
def _sum(
    first: int, last: int, points: Field, cells: Ints, corners: Ints, inverses: Field, scales: Field, eps: float,
    distortion: float, angle: float, stiffness: float, proportion: float, slender: Field, order: int,
    forces: Field, data: Field, places: Places, lanes: Lanes, nodes: Lanes,
) -> float:  # fmt: skip
    """That of cells first to last; see :func:`corner_sums`."""
    s, local, total = np.empty((ROWS, len(lanes))), np.empty((36, 3, 3)), 0.0
    for c in range(first, last):
        _store_frames(points, cells, c, corners, inverses, s, lanes)
        weight = scales[c] if len(scales) > 0 else 1.0
        if order > 0:
            store_distortion(s, eps, weight * distortion, lanes)
            if angle > 0.0 and len(lanes) == 8:
                add_angles(s, weight * angle, stiffness, lanes)
            elif angle > 0.0:
                add_shapes(s, weight * angle, stiffness, lanes)
        else:
            _store_densities(s, eps, weight * distortion, weight * angle, stiffness, lanes)
        if proportion > 0.0 and len(slender) > 0:
            add_proportions(s, weight * proportion, slender[c], order, lanes)
        for q in range(len(lanes)):
            if not (s[MARGIN, q] > 0.0 and s[DENSITY, q] < FOLDED):
                return np.inf
            total += s[DENSITY, q]
        if order == 0:
            continue
        if len(inverses) > 0:
            pull_back(s, lanes)
        to_nodes(s, lanes)
        add_forces(s, cells, c, corners, forces, lanes)
        if order > 1:
            add_blocks(s, cells, c, corners, places, local, data, lanes, nodes)
    return total


@loop
def corner_sums(  # type: ignore[no-untyped-def]
    first, last, chunks, size, sums,
    points, cells, corners, inverses, scales, eps, distortion, angle, stiffness, proportion, slender, order,
    forces, data, places, lanes, nodes,
):  # fmt: skip
    """Sum of distortion * e(f) + angle * phi(e(u)) over all corners, u the unit columns of f, times scales of cells.

    Of other types than hexahedra the edges at a corner belong together: there u is f itself. Corners are at the first
    nodes of a cell, and as many as `lanes`, as are its nodes; `corners` (k, 6) has the neighbours of each, and the
    signs that turn edges into derivatives. And proportion times the densities of edges that differ more than `slender`,
    equation (12a). A sum for each of some chunks of cells, see :class:`hexconformal.kernel.CellChunks`.

    phi(e) = e / (1 - stiffness e) rises without bound as the worst corner nears 1 / stiffness. Infinite where a
    corner is folded (eps = 0) or beyond that bound. With order 1 adds the first derivative to forces (n, 3), with
    order 2 also the convex Hessian to the 3 x 3 blocks data at places (m, 36) of the pairs
    of nodes, see :func:`hexconformal.energy.block_matrix.block_places`.
    """
    for n in range(first, last):
        chunk = chunks[n]
        sums[chunk] = _sum(
            chunk * size, min((chunk + 1) * size, len(cells)), points, cells, corners, inverses, scales,
            eps, distortion, angle, stiffness, proportion, slender, order, forces, data, places, lanes, nodes,
        )  # fmt: skip
        if sums[chunk] == np.inf:
            return


@algebra
def _fullness(f: Frame, determinant_of: float) -> float:
    """det f / (|f|^2 / 3)^(3/2)."""
    square = (dot(f[0], f[0]) + dot(f[1], f[1]) + dot(f[2], f[2])) / 3.0
    return determinant_of / (square * np.sqrt(square) + 1e-300)


@loop
def corner_fullness(first, last, points, cells, corners, inverses, lanes, fullness):  # type: ignore[no-untyped-def]
    """Per cell, of f = J W^-1 at the corners, see :class:`CornerMeasures`."""
    s = np.empty((ROWS, len(lanes)))
    for c in range(first, last):
        _store_frames(points, cells, c, corners, inverses, s, lanes)
        for q in range(len(lanes)):
            f = frame_at(s, FRAME, q)
            s[MARGIN, q] = _fullness(f, determinant(f))
        fullness[c] = np.inf
        for q in range(len(lanes)):
            fullness[c] = min(fullness[c], s[MARGIN, q])


@loop
def corner_densities(  # type: ignore[no-untyped-def]
    first, last, points, cells, corners, inverses, lanes, smallest, fullness, slenderness, distortion, angle
):
    """Per cell, of f = J W^-1 at the corners, see :class:`CornerMeasures`."""
    s = np.empty((ROWS, len(lanes)))
    for c in range(first, last):
        _store_frames(points, cells, c, corners, inverses, s, lanes)
        for q in range(len(lanes)):
            f = frame_at(s, FRAME, q)
            s[MARGIN, q] = determinant(f)
            a, b, d = dot(f[0], f[0]), dot(f[1], f[1]), dot(f[2], f[2])
            s[FRAME + 1, q] = np.sqrt(max(a, max(b, d)) / min(a, min(b, d)))
            s[FRAME, q] = _fullness(f, s[MARGIN, q])
            s[DENSITY, q] = frame_density(f) * barrier_factor(determinant(f), 0.0)[0]
            s[COLUMN, q], _ = _angle_density(f, lanes)
        smallest[c], fullness[c], slenderness[c], distortion[c], angle[c] = np.inf, np.inf, 1.0, 0.0, 0.0
        for q in range(len(lanes)):
            smallest[c] = min(smallest[c], s[MARGIN, q])
            fullness[c] = min(fullness[c], s[FRAME, q])
            slenderness[c] = max(slenderness[c], s[FRAME + 1, q])
            distortion[c] = max(distortion[c], s[DENSITY, q])
            angle[c] = max(angle[c], s[COLUMN, q])
        if not smallest[c] > 0.0:
            distortion[c] = angle[c] = np.inf
