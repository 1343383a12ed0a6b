"""What corners that are held allow: an upper bound of the smallest scaled Jacobian, and whether cells can be valid."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..elements import CORNER_NEIGHBOURS, HEXAHEDRON, MEASURES, CellType, edge_nodes, measures_of, rows_by_type

__all__ = ["attainable_scaled_jacobian", "attainable_scaled_jacobians", "nodes_without_room"]

_ROOM = 1e-9  # det J over the areas of faces, below which a corner has no volume but for rounding


def attainable_scaled_jacobian(
    points: NDArray[np.float64], cells: NDArray[np.int64], held: NDArray[np.bool_]
) -> tuple[float, int | None]:
    """Upper bound of the smallest scaled Jacobian while some nodes cannot move.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, 8) hexahedra.
    held
        (n,) nodes that cannot move.

    Returns
    -------
    The bound and the cell it belongs to; 1 and None where nothing is held. A corner whose node and three neighbours
    are held keeps its scaled Jacobian; one whose node and two neighbours are held has at most the sine of the angle
    between those two edges.

    Examples
    --------
    >>> from hexconformal.generate import sheared_block
    >>> points, cells = sheared_block(1, shear=1.0)
    >>> bound, cell = attainable_scaled_jacobian(points, cells, points[:, 0] < 1.5)
    >>> round(bound, 6), int(cell)
    (0.707107, 0)
    """
    limits = attainable_scaled_jacobians(points, cells, held)
    cell = int(limits.argmin()) if len(limits) and limits.min() < 1.0 else None
    return (1.0, None) if cell is None else (float(limits[cell]), cell)


def attainable_scaled_jacobians(
    points: NDArray[np.float64], cells: NDArray[np.int64], held: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """The same bound for every cell (m,); 1 for other types than hexahedra but for what is held altogether."""
    limits = np.ones(len(cells))
    for one in rows_by_type(cells):
        own = one.own_nodes(cells)
        if one.cell_type is HEXAHEDRON:
            limits[one.rows] = _of_hexahedra(points, own, held)
        else:
            whole = np.flatnonzero(held[own].all(axis=1))
            kept = np.ones(len(own))
            kept[whole] = measures_of(points, own[whole], one.cell_type)[MEASURES.index("scaled_jacobian")]
            limits[one.rows] = kept
    return limits


def _of_hexahedra(
    points: NDArray[np.float64], cells: NDArray[np.int64], held: NDArray[np.bool_]
) -> NDArray[np.float64]:
    neighbours, limits = cells[:, CORNER_NEIGHBOURS], np.ones(len(cells))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cell, corner = np.nonzero(held[cells] & held[neighbours[:, :, i]] & held[neighbours[:, :, j]])
        edges = points[neighbours[cell, corner]] - points[cells[cell, corner]][:, None]
        edges /= np.maximum(np.linalg.norm(edges, axis=2, keepdims=True), 1e-300)
        area = np.cross(edges[:, i], edges[:, j])
        whole = held[neighbours[cell, corner, k]]
        values = np.where(whole, np.einsum("ki,ki->k", area, edges[:, k]), np.linalg.norm(area, axis=1))
        np.minimum.at(limits, cell, values)
    return limits


def nodes_without_room(
    points: NDArray[np.float64], blocks: Iterable[tuple[CellType, NDArray[np.int64]]], held: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Nodes around which the cells cannot all be valid, wherever those nodes are that are not held.

    At a corner with two held edges det J is n . w, where n is their cross product and w the third edge. Where this is
    the same for several cells, as at most nodes of a boundary, it has to be on the positive side of all of their n:
    there is such a w unless a face is turned over, and that is a linear program in three unknowns (Gordan's theorem).
    Edges of quadratic cells are the derivatives there, 4 m - 3 a - b with the ends a, b and the middle m.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    blocks
        Types of cells, and the nodes (m, j) of those of each.
    held
        (n,) nodes that cannot move.

    Returns
    -------
    ndarray
        (k,) nodes, one of whose cells at least stays invalid; others may be missed.

    Examples
    --------
    The node in the middle of the bottom of four cells, beyond the rim.

    >>> from hexconformal.generate import box
    >>> points, cells = box((2, 2, 1))
    >>> nodes_without_room(points, [(HEXAHEDRON, cells)], points[:, 2] == 0)
    array([], dtype=int64)
    >>> points[4] = [1.5, 0.5, 0.0]
    >>> nodes_without_room(points, [(HEXAHEDRON, cells)], points[:, 2] == 0)
    array([4])
    """
    found, parts = list[NDArray[np.int64]](), list[tuple[NDArray[np.int64], NDArray[np.float64]]]()
    for cell_type, cells in blocks:
        corners, ends = cells[:, : len(cell_type.neighbours)], cells[:, cell_type.neighbours]
        edges = points[ends] - points[corners][:, :, None]
        stays = held[ends] & held[corners][:, :, None]
        if cell_type.straight:
            middles = cells[:, _middles(cell_type)]
            edges = 4.0 * (points[middles] - points[corners][:, :, None]) - edges
            stays &= held[middles]
        flat = stays.all(axis=2) & (np.linalg.det(edges) <= 0.0)
        found.append(corners[flat])
        cell, corner = np.nonzero(stays.sum(axis=2) == 2)
        free = stays[cell, corner].argmin(axis=1)
        normals = np.cross(edges[cell, corner, (free + 1) % 3], edges[cell, corner, (free + 2) % 3])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        parts.append((np.column_stack([corners[cell, corner], ends[cell, corner, free]]), normals))
    if parts:
        found.append(_without_room(*(np.concatenate(one) for one in zip(*parts, strict=True))))
    return np.unique(np.concatenate([np.empty(0, dtype=np.int64), *found]))


@cache
def _middles(cell_type: CellType) -> NDArray[np.int64]:
    """(c, 3) nodes in the middle of the edges at each corner of a quadratic type."""
    middles = {frozenset((a, b)): middle for a, b, middle in edge_nodes(cell_type).tolist()}
    corners = enumerate(cell_type.neighbours.tolist())
    return np.array([[middles[frozenset((corner, end))] for end in ends] for corner, ends in corners])


def _without_room(edges: NDArray[np.int64], normals: NDArray[np.float64]) -> NDArray[np.int64]:
    """First nodes of edges (k, 2) that cannot be on the side of all normals (k, 3) of edges with the same nodes."""
    ends, which = np.unique(edges, axis=0, return_inverse=True)
    which = which.ravel()
    sums, least = np.zeros((len(ends), 3)), np.full(len(ends), np.inf)
    np.add.at(sums, which, normals)
    np.minimum.at(least, which, np.einsum("ki,ki->k", normals, sums[which]))
    return ends[[one for one in np.flatnonzero(least <= _ROOM) if not _have_room(normals[which == one])], 0]


def _have_room(normals: NDArray[np.float64]) -> bool:
    """Whether a vector w with components of at most 1 has n . w > 0 for all normals (k, 3)."""
    from scipy.optimize import linprog  # takes as long to load as all else together

    system = np.column_stack([-normals, np.ones(len(normals))])
    bounds = [(-1.0, 1.0)] * 3 + [(None, 1.0)]
    found = linprog([0.0, 0.0, 0.0, -1.0], A_ub=system, b_ub=np.zeros(len(normals)), bounds=bounds)
    return bool(np.asarray(found.x)[3] > _ROOM)
