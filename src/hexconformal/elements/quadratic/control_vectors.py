"""Derivatives of quadratic hexahedra in Bernstein polynomials, from differences of nodes.

The derivative along an axis has degree 1 along it and 2 along the others: 18 control vectors. Each is a combination of
differences of nodes that lie on lines along that axis, so that in thin cells, too, rounding is small against it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from math import comb

import numpy as np
from numpy.typing import NDArray

from ..cell_type import CellType
from .cell_types import LATTICE, from_nodes

__all__ = ["ControlVectors", "control_vectors"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_BITS = 64.0  # the tables are multiples of 1/64
# Roundings of a coefficient besides those of its control vectors: triple products, sums, binomials, 24 bisections.
_FURTHER_ROUNDINGS = 256


@dataclass(frozen=True, eq=False)
class ControlVectors:
    """Tables for a type of cells; axis 0, 1, 2 first in all of them.

    Control vector number i + 2 j + 6 k of axis 0, i + 3 j + 6 k of axis 1, i + 3 j + 9 k of axis 2 belongs to the
    Bernstein polynomials i, j, k of the three coordinates.

    Attributes
    ----------
    pairs
        (3, d, 2) nodes whose differences count, the second minus the first.
    table
        (3, d, 18) by which the differences make the control vectors, these times the binomials of their degrees.
    binomials
        (3, 18) the binomials.
    rounding
        Bound on the error of a coefficient of det J over the product of the sizes of what it was made from.
    """

    pairs: Ints
    table: Field
    binomials: Field
    rounding: float

    @cached_property
    def for_loops(self) -> tuple[Ints, Ints, Ints, Field, Field, float]:
        """What compiled loops take: of the table what is not zero, vector by vector.

        The pairs; (3, 19) where the differences of each vector start; (3, e) their numbers, and factors; (3, 18) one
        over the squared binomials; the bound on rounding.
        """
        filled = [np.nonzero(table.T) for table in self.table]
        starts = np.array([np.searchsorted(vectors, np.arange(19)) for vectors, _ in filled])
        terms = np.array([numbers for _, numbers in filled])
        factors = np.array([table.T[places] for table, places in zip(self.table, filled, strict=True)])
        return self.pairs, starts, terms, factors, 1.0 / self.binomials**2, self.rounding


@cache
def control_vectors(cell_type: CellType) -> ControlVectors:
    """The tables of a type, HEXAHEDRON20 or HEXAHEDRON27.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON20, HEXAHEDRON27
    >>> control_vectors(HEXAHEDRON20).pairs.shape, control_vectors(HEXAHEDRON27).pairs.shape
    ((3, 12, 2), (3, 18, 2))
    """
    pairs = np.array([_pairs_along(axis, len(cell_type.nodes)) for axis in range(3)])
    tables, binomials = [], []
    for axis in range(3):
        differences = np.eye(len(cell_type.nodes))[pairs[axis, :, 1]] - np.eye(len(cell_type.nodes))[pairs[axis, :, 0]]
        wanted = _derivative(axis) @ from_nodes(cell_type)
        solved = np.linalg.lstsq(differences.T, wanted.T, rcond=None)[0]
        tables.append(np.round(_BITS * solved) / _BITS)
        binomials.append(_binomials(axis))
    table, weights = np.array(tables), np.array(binomials)
    # A sum of d products, each of a rounded difference, is off by at most so many roundings of the sum of their sizes.
    roundings = 3 * (table.shape[1] + 2) * np.abs(table).sum(axis=1).max() + _FURTHER_ROUNDINGS
    result = ControlVectors(pairs, table * weights[:, None], weights, float(roundings * np.finfo(np.float64).eps))
    for array in (result.pairs, result.table, result.binomials):
        array.setflags(write=False)
    return result


def _pairs_along(axis: int, count: int) -> list[tuple[int, int]]:
    """Neighbours on each line of the lattice along an axis, of so many nodes."""
    order = np.lexsort((LATTICE[:count, axis], *np.delete(LATTICE[:count], axis, axis=1).T)).tolist()
    others = np.delete(LATTICE, axis, axis=1)
    return [(a, b) for a, b in zip(order, order[1:], strict=False) if (others[a] == others[b]).all()]


def _derivative(axis: int) -> Field:
    """(18, 27) control vectors of the derivative along an axis, from the 27 nodes."""
    to_bernstein = np.array([[1.0, 0.0, 0.0], [-0.5, 2.0, -0.5], [0.0, 0.0, 1.0]])
    slope = 2.0 * np.diff(to_bernstein, axis=0)
    x, y, z = (slope if axis == i else to_bernstein for i in range(3))
    places = LATTICE @ [1, 3, 9]
    return np.asarray(np.kron(z, np.kron(y, x))[:, places])


def _binomials(axis: int) -> Field:
    """(18,) of the degrees (1, 2, 2) of the derivative along an axis."""
    x, y, z = ([comb(1 if axis == i else 2, k) for k in range(2 if axis == i else 3)] for i in range(3))
    return np.asarray(np.kron(z, np.kron(y, x)), dtype=np.float64)
