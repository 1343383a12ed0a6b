"""Validity and measures of tables (m, 8) in which cells of other types are collapsed hexahedra."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .cell_measures import MEASURES, worst_corners
from .collapsed import are_collapsed, rows_by_type
from .hexahedron import HEXAHEDRON
from .linear_measures import measures_of
from .linear_validity import determinant_bounds
from .validity import hexahedra_are_valid, hexahedron_bounds

__all__ = ["all_valid", "corner_scaled_jacobian", "corner_shape", "is_valid", "minimum_jacobian"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def minimum_jacobian(points: Floats, cells: Ints) -> tuple[Floats, Floats]:
    """Bracket the minimum of det J over every cell.

    The bounds are as tight as the sign needs: hexahedra are subdivided only while it is undecided.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, 8) nodes in VTK order, other types than hexahedra collapsed.

    Returns
    -------
    (m,) lower bounds, rounding included: positive proves the cell valid;
    (m,) upper bounds, values that det J attains: not positive proves it invalid.

    Examples
    --------
    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> lower, upper = minimum_jacobian(2.0 * CORNERS, np.arange(8)[None])
    >>> bool(np.isclose(lower[0], 8.0)), float(upper[0])
    (True, 8.0)
    """
    if not are_collapsed(cells).any():
        return hexahedron_bounds(points, cells)
    lower, upper = np.empty((2, len(cells)))
    for one in rows_by_type(cells):
        lower[one.rows], upper[one.rows] = determinant_bounds(points, one.own_nodes(cells), one.cell_type)
    return lower, upper


def is_valid(points: Floats, cells: Ints) -> NDArray[np.bool_]:
    """Tell for every cell whether det J > 0 everywhere in it, certified.

    Cells that stay undecided (det J touches zero within rounding, or NaN) are not valid.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, 8) nodes in VTK order, other types than hexahedra collapsed.

    Examples
    --------
    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> points = CORNERS.astype(float)
    >>> cells = np.arange(8)[None]
    >>> is_valid(points, cells), is_valid(-points, cells)
    (array([ True]), array([False]))
    """
    return minimum_jacobian(points, cells)[0] > 0


def all_valid(points: Floats, cells: Ints, among: Ints | None = None) -> bool:
    """Tell whether every cell is valid (see `is_valid`), and stop at the first hexahedron that is not.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, 8) nodes in VTK order, other types than hexahedra collapsed.
    among
        Ids of the cells to look at; default all.

    Examples
    --------
    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> all_valid(CORNERS.astype(float), np.arange(8)[None])
    True
    """
    if among is not None:
        cells = cells[among]
    if not are_collapsed(cells).any():
        return hexahedra_are_valid(points, cells)
    return bool(is_valid(points, cells).all())


def corner_scaled_jacobian(points: Floats, cells: Ints) -> Floats:
    """Smallest scaled Jacobian of the corners, nothing else: cheap enough for every iteration.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, 8) nodes in VTK order, other types than hexahedra collapsed.

    Returns
    -------
    (m,) values in [-1, 1], 1 for the ideal of the type; 0 at the most where an edge has no length.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> corner_scaled_jacobian(*box((1, 1, 2)))
    array([1., 1.])
    """
    return _worst_corners(points, cells, "scaled_jacobian")


def corner_shape(points: Floats, cells: Ints) -> Floats:
    """Smallest mean ratio of the corners, 3 det^(2/3) / (sum of squared edges), nothing else.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, 8) nodes in VTK order, other types than hexahedra collapsed.

    Returns
    -------
    (m,) values in [0, 1]; 0 where a corner is folded or flat.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> corner_shape(*box((1, 1, 1), (1.0, 1.0, 8.0))).round(4)
    array([0.1818])
    """
    return _worst_corners(points, cells, "shape")


def _worst_corners(points: Floats, cells: Ints, name: str) -> Floats:
    if not are_collapsed(cells).any():
        return worst_corners(points, cells, name == "shape")
    out = np.empty(len(cells))
    for one in rows_by_type(cells):
        nodes = one.own_nodes(cells)
        if one.cell_type is HEXAHEDRON:
            out[one.rows] = worst_corners(points, nodes, name == "shape")
        else:
            out[one.rows] = measures_of(points, nodes, one.cell_type)[MEASURES.index(name)]
    return out
