"""The trilinear hexahedron in VTK node order: corners, edges, faces, gradients of the shape functions, quadrature."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .cell_type import CellType

__all__ = [
    "CORNERS",
    "CORNER_NEIGHBOURS",
    "EDGES",
    "FACES",
    "HEXAHEDRON",
    "QUADRATURE_RULES",
    "corner_rule",
    "edge_weights",
    "gauss_rule",
]
__all__ += ["shape_gradients", "trilinear_shapes"]

# Reference coordinates in the unit cube of the eight nodes.
CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=np.int64
)

# Neighbours of each node along e1, e2, e3, ordered so that a valid cell spans a positive volume.
CORNER_NEIGHBOURS = np.array(
    [[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]], dtype=np.int64
)

# Four parallel to e1, four to e2, four to e3, each from its lower to its upper end.
EDGES = np.array(
    [[0, 1], [3, 2], [4, 5], [7, 6], [0, 3], [1, 2], [4, 7], [5, 6], [0, 4], [1, 5], [3, 7], [2, 6]], dtype=np.int64
)

# Counter-clockwise seen from outside.
FACES = np.array([[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]], dtype=np.int64)

HEXAHEDRON = CellType(
    name="hexahedron",
    singular="hexahedron",
    plural="hexahedra",
    vtk=12,
    ideal=CORNERS.astype(np.float64),
    axes=np.eye(3),
    neighbours=CORNER_NEIGHBOURS.copy(),
    samples=(0, 1, 2, 3, 4, 5, 6, 7),
    edges=EDGES.copy(),
    faces=tuple(tuple(face) for face in FACES.tolist()),
    mirrored=(4, 5, 6, 7, 0, 1, 2, 3),
    reference_volume=1.0,
)


def trilinear_shapes(xi: NDArray[np.float64]) -> NDArray[np.float64]:
    """(q, 8) the eight trilinear shape functions at points (q, 3) in the unit cube.

    Examples
    --------
    >>> trilinear_shapes(np.array([[0.5, 0.0, 0.0]]))
    array([[0.5, 0.5, 0. , 0. , 0. , 0. , 0. , 0. ]])
    """
    return np.asarray(np.where(CORNERS == 1, xi[:, None], 1.0 - xi[:, None]).prod(axis=2))


def shape_gradients(xi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Derivatives of the eight trilinear shape functions.

    Parameters
    ----------
    xi
        (q, 3) points in the unit cube.

    Returns
    -------
    (q, 8, 3) derivatives with respect to the three reference coordinates.

    Examples
    --------
    >>> shape_gradients(np.array([[0.0, 0.0, 0.0]]))[0, :2]
    array([[-1., -1., -1.],
           [ 1., -0., -0.]])
    """
    factors = np.where(CORNERS == 1, xi[:, None, :], 1 - xi[:, None, :])
    signs = np.where(CORNERS == 1, 1.0, -1.0)
    gradients = np.empty((len(xi), 8, 3))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        gradients[:, :, i] = signs[:, i] * factors[:, :, j] * factors[:, :, k]
    return gradients


def edge_weights(xi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights of the edge vectors in the derivatives of the trilinear map.

    The derivative along axis i is a mean of the four edges ``EDGES[4 i : 4 i + 4]``.

    Parameters
    ----------
    xi
        (q, 3) points in the unit cube.

    Returns
    -------
    (q, 12) weights; each group of four sums to one.
    """
    gradients = shape_gradients(xi)
    return np.stack([gradients[:, EDGES[e, 1], e // 4] for e in range(12)], axis=1)


def gauss_rule() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The 2x2x2 Gauss rule on the unit cube: (8, 3) points and (8,) weights, exact for cubics."""
    offset = 0.5 / np.sqrt(3.0)
    return 0.5 + offset * (2.0 * CORNERS - 1.0), np.full(8, 0.125)


def corner_rule() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The corner (trapezoidal) rule on the unit cube: the (8, 3) nodes and (8,) weights."""
    return CORNERS.astype(np.float64), np.full(8, 0.125)


QUADRATURE_RULES = {"gauss": gauss_rule, "corners": corner_rule}  # quadrature by name
