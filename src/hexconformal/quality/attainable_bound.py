"""Upper bound of the smallest scaled Jacobian: that of corners that are held."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..elements import CORNER_NEIGHBOURS, HEXAHEDRON, MEASURES, measures_of, rows_by_type

__all__ = ["attainable_scaled_jacobian", "attainable_scaled_jacobians"]


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
