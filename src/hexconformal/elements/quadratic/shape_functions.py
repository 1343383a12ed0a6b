"""Shape functions of quadratic hexahedra: products of Lagrange polynomials at the 27 nodes, equation (13d)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cell_type import CellType
from .cell_types import LATTICE, from_nodes

__all__ = ["quadratic_polynomials", "quadratic_shape_gradients", "quadratic_shapes"]

Field = NDArray[np.float64]


def quadratic_shapes(xi: Field, cell_type: CellType) -> Field:
    """Shape functions of a type.

    Parameters
    ----------
    xi
        (q, 3) points in the unit cube.
    cell_type
        HEXAHEDRON20 or HEXAHEDRON27.

    Returns
    -------
    (q, k) values, a column for each node.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON20
    >>> shapes = quadratic_shapes(HEXAHEDRON20.ideal, HEXAHEDRON20)
    >>> bool(np.allclose(shapes, np.eye(20)))
    True
    """
    values, _ = quadratic_polynomials(xi)
    return np.asarray(_products(values) @ from_nodes(cell_type))


def quadratic_shape_gradients(xi: Field, cell_type: CellType) -> Field:
    """Derivatives of the shape functions of a type.

    Parameters
    ----------
    xi
        (q, 3) points in the unit cube.
    cell_type
        HEXAHEDRON20 or HEXAHEDRON27.

    Returns
    -------
    (q, k, 3) derivatives with respect to the three reference coordinates.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON27
    >>> gradients = quadratic_shape_gradients(np.array([[0.3, 0.6, 0.1]]), HEXAHEDRON27)
    >>> bool(np.allclose(HEXAHEDRON27.ideal.T @ gradients[0], np.eye(3)))
    True
    """
    values, slopes = quadratic_polynomials(xi)
    along = np.eye(3, dtype=bool)[:, None, :, None]
    gradients = np.stack([_products(np.where(axis, slopes, values)) for axis in along], axis=-1)
    return np.einsum("qai,ab->qbi", gradients, from_nodes(cell_type))


def quadratic_polynomials(t: Field) -> tuple[Field, Field]:
    """Lagrange's three polynomials on 0, 1/2, 1 and their derivatives, a further axis for each coordinate t.

    Examples
    --------
    >>> values, slopes = quadratic_polynomials(np.array([0.5, 1.0]))
    >>> values.tolist(), slopes.tolist()
    ([[0.0, 1.0, 0.0], [-0.0, 0.0, 1.0]], [[-1.0, 0.0, 1.0], [1.0, -4.0, 3.0]])
    """
    t = np.asarray(t, dtype=np.float64)
    values = np.stack([(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)], axis=-1)
    return values, np.stack([4.0 * t - 3.0, 4.0 - 8.0 * t, 4.0 * t - 1.0], axis=-1)


def _products(factors: Field) -> Field:
    """(q, 27) of a factor for each coordinate, of those (q, 3, 3) that a node has by its place in the lattice."""
    return np.asarray(factors[:, np.arange(3), LATTICE].prod(axis=2))
