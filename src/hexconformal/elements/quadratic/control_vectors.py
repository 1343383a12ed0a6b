"""Derivatives of quadratic cells in Bernstein polynomials, from differences of nodes.

The derivative with respect to a reference coordinate has degree 1 along that axis of the cube and 2 along the others:
18 control vectors. Each is a combination of differences of nodes that lie on lines along that axis, so that in thin
cells, too, rounding is small against it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from math import comb

import numpy as np
from numpy.typing import NDArray

from ..cell_type import CellType
from .cell_types import edge_nodes, reference_nodes
from .shape_functions import bernstein_derivatives

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
        terms, factors = np.zeros((2, 3, int(starts[:, -1].max())))
        for axis, (table, places) in enumerate(zip(self.table, filled, strict=True)):
            terms[axis, : starts[axis, -1]], factors[axis, : starts[axis, -1]] = places[1], table.T[places]
        return self.pairs, starts, terms.astype(np.int64), factors, 1.0 / self.binomials**2, self.rounding


@cache
def control_vectors(cell_type: CellType) -> ControlVectors:
    """The tables of a quadratic type.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON20, HEXAHEDRON27, TETRAHEDRON10
    >>> [control_vectors(one).pairs.shape for one in (HEXAHEDRON20, HEXAHEDRON27, TETRAHEDRON10)]
    [(3, 12, 2), (3, 18, 2), (3, 4, 2)]
    """
    derivatives, every = bernstein_derivatives(cell_type), np.eye(len(cell_type.nodes))
    found = [_pairs_along(axis, cell_type, table) for axis, table in enumerate(derivatives)]
    most = max(map(len, found))
    # Axes with fewer of them have differences of a node to itself, which are nothing.
    pairs = np.array([[*some, *[(0, 0)] * (most - len(some))] for some in found], dtype=np.int64)
    tables = []
    for axis, some in zip(range(3), pairs, strict=True):
        solved = np.linalg.lstsq((every[some[:, 1]] - every[some[:, 0]]).T, derivatives[axis].T, rcond=None)[0]
        tables.append(np.round(_BITS * solved) / _BITS)
    table, weights = np.array(tables), np.array([_binomials(axis) for axis in range(3)])
    # A sum of d products, each of a rounded difference, is off by at most so many roundings of the sum of their sizes.
    roundings = 3 * (table.shape[1] + 2) * np.abs(table).sum(axis=1).max() + _FURTHER_ROUNDINGS
    result = ControlVectors(pairs, table * weights[:, None], weights, float(roundings * np.finfo(np.float64).eps))
    for array in (result.pairs, result.table, result.binomials):
        array.setflags(write=False)
    return result


def _pairs_along(axis: int, cell_type: CellType, derivatives: Field) -> list[tuple[int, int]]:
    """Neighbours on each line through nodes along an axis, and as many halves of edges as it needs besides.

    To the apex of a pyramid no lines lead along the axis. No pair closes a circle, so that there is one way to combine
    them.
    """
    places = np.rint(2.0 * reference_nodes(cell_type)).astype(np.int64)
    others = np.delete(places, axis, axis=1)
    order = np.lexsort((places[:, axis], *others.T)).tolist()
    pairs = [(a, b) for a, b in zip(order, order[1:], strict=False) if (others[a] == others[b]).all()]
    halves = [pair for a, b, middle in edge_nodes(cell_type).tolist() for pair in ((a, middle), (middle, b))]
    joined = np.arange(len(places))
    for a, b in pairs:
        joined[joined == joined[a]] = joined[b]
    for a, b in halves:
        # What is combined has no share in the sum over nodes that hang together.
        sums = np.array([derivatives[:, joined == label].sum(axis=1) for label in np.unique(joined)])
        if not sums.any():
            break
        if joined[a] != joined[b]:
            pairs.append((a, b))
            joined[joined == joined[a]] = joined[b]
    return pairs


def _binomials(axis: int) -> Field:
    """(18,) of the degrees (1, 2, 2) of the derivative along an axis."""
    x, y, z = ([comb(1 if axis == i else 2, k) for k in range(2 if axis == i else 3)] for i in range(3))
    return np.asarray(np.kron(z, np.kron(y, x)), dtype=np.float64)
