"""Shape functions of quadratic cells: products of Lagrange polynomials at 27 nodes, equation (13d), and derivatives.

Places are told by coordinates in the unit cube, some of whose edges or faces are one point of other cells than
hexahedra. Derivatives are those with respect to the reference coordinates of the type, its corner 0 and the neighbours
of this being the origin and the unit vectors: polynomials in the coordinates of the cube, too.
"""

from __future__ import annotations

import itertools
from functools import cache
from math import comb

import numpy as np
from numpy.typing import NDArray

from ..cell_type import CellType
from ..collapsed import COLLAPSED
from ..hexahedron import shape_gradients
from .cell_types import LATTICE, from_nodes

__all__ = ["bernstein_derivatives", "quadratic_polynomials", "quadratic_shape_gradients", "quadratic_shapes"]

Field = NDArray[np.float64]

_BITS = 64.0  # the tables are multiples of 1/64


def quadratic_shapes(places: Field, cell_type: CellType) -> Field:
    """Shape functions of a type.

    Parameters
    ----------
    places
        (q, 3) points in the unit cube.
    cell_type
        A quadratic type, or a linear one.

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
    values, _ = quadratic_polynomials(places)
    return np.asarray(_products(values) @ from_nodes(cell_type))


def quadratic_shape_gradients(places: Field, cell_type: CellType) -> Field:
    """Derivatives of the shape functions of a type.

    Parameters
    ----------
    places
        (q, 3) points in the unit cube.
    cell_type
        A quadratic type, or a linear one.

    Returns
    -------
    (q, k, 3) derivatives with respect to the three reference coordinates.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON27, WEDGE15
    >>> gradients = quadratic_shape_gradients(np.array([[0.3, 0.6, 0.1]]), HEXAHEDRON27)
    >>> bool(np.allclose(HEXAHEDRON27.ideal.T @ gradients[0], np.eye(3)))
    True
    >>> gradients = quadratic_shape_gradients(np.array([[0.3, 1.0, 0.1]]), WEDGE15)
    >>> bool(np.allclose(WEDGE15.ideal.T @ gradients[0], (WEDGE15.ideal[[1, 2, 3]] - WEDGE15.ideal[0]).T))
    True
    """
    polynomials = [_bernstein(np.asarray(places, dtype=np.float64), axis) for axis in range(3)]
    return np.stack([one @ table for one, table in zip(polynomials, bernstein_derivatives(cell_type), strict=True)], -1)


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


@cache
def bernstein_derivatives(cell_type: CellType) -> Field:
    """(3, 18, k) coefficients of the derivatives with respect to each reference coordinate in Bernstein polynomials.

    Of degree 1 along an axis of the cube and 2 along the others; number i + 2 j + 6 k of axis 0, i + 3 j + 6 k of axis
    1, i + 3 j + 9 k of axis 2 belongs to the polynomials i, j, k of the three coordinates.

    Examples
    --------
    >>> from hexconformal.elements import TETRAHEDRON10
    >>> bernstein_derivatives(TETRAHEDRON10)[0, 0].tolist()
    [-3.0, -1.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    """
    places = np.array(list(itertools.product((0.1, 0.35, 0.6, 0.85), repeat=3)))
    values, slopes = quadratic_polynomials(places)
    along = np.eye(3, dtype=bool)[:, None, :, None]
    in_cube = np.stack([_products(np.where(axis, slopes, values)) for axis in along], axis=1) @ from_nodes(cell_type)
    # The reference coordinates are trilinear in the cube.
    corners = cell_type.reference_corners[list(COLLAPSED[cell_type.linear.name])]
    to_cube = np.linalg.inv(shape_gradients(places).transpose(0, 2, 1) @ corners)
    derivatives = to_cube @ in_cube
    solved = [np.linalg.lstsq(_bernstein(places, axis), derivatives[:, axis], rcond=None)[0] for axis in range(3)]
    tables = np.rint(_BITS * np.array(solved)) / _BITS + 0.0
    tables.setflags(write=False)
    return tables


def _bernstein(places: Field, axis: int) -> Field:
    """(q, 18) Bernstein polynomials of degree 1 along an axis and 2 along the others."""
    factors = []
    for i in range(3):
        degree = 1 if i == axis else 2
        t, powers = places[:, i, None], np.arange(degree + 1)
        factors.append([comb(degree, k) for k in powers] * t**powers * (1.0 - t) ** (degree - powers))
    return np.asarray(np.einsum("qk,qj,qi->qkji", *factors[::-1]).reshape(len(places), 18))


def _products(factors: Field) -> Field:
    """(q, 27) of a factor for each coordinate, of those (q, 3, 3) that a node has by its place in the lattice."""
    return np.asarray(factors[:, np.arange(3), LATTICE].prod(axis=2))
