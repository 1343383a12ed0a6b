"""The space that fields on the nodes of a mesh, and values on its cells, live in: how they are summed and compared."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..kernel import loop, parallel_ranges

__all__ = ["SERIAL", "Space"]

Field = NDArray[np.float64]
Array = TypeVar("Array", bound=NDArray[Any])
# From a matrix (n, n) and the rows (n,) that take part to what maps a field, and its components that are wanted.
Hierarchy = Callable[[Any, NDArray[np.bool_]], Callable[[Field, Sequence[int]], Field]]

_BLOCK, _FEWEST = 8192, 8  # rows whose products are summed by themselves; blocks for a thread of its own


class Space:
    """Fields (n, 3) in one process, all of whose nodes and cells are its own.

    Where nodes are shared out, a subclass sums over the parts: all that minimizers know of that is here. Whatever
    decides how a run goes on must be one of these values, which are the same in every part.

    Examples
    --------
    >>> SERIAL.inner(np.ones((2, 3)), np.ones((2, 3)))
    6.0
    """

    #: What approximates the inverse of a scalar matrix on nodes that are shared out; None where nothing has to.
    hierarchy: Hierarchy | None = None

    @property
    def is_shared(self) -> bool:
        """True where nodes are shared out."""
        return False

    def inner(self, a: Field, b: Field) -> float:
        """Euclidean inner product of two fields, summed in blocks of rows whatever the number of threads."""
        a, b = self.own(a), self.own(b)
        sums = np.zeros(-(-len(a) // _BLOCK))
        parallel_ranges(_inner, len(sums), _BLOCK, a, b, sums, smallest=_FEWEST)
        return self.total(float(sums.sum()))

    def own(self, field: Array) -> Array:
        """The rows of a field that belong to this part: every node's in one part."""
        return field

    # ------------------------------------------------------------------------------ values of all parts
    def total(self, value: float) -> float:
        """The sum of what every part has."""
        return value

    def totals(self, values: Array) -> Array:
        """The sums of what every part has, number by number."""
        return values

    def everywhere(self, holds: bool) -> bool:
        """True where something holds in every part."""
        return holds

    def anywhere(self, holds: bool) -> bool:
        """True where something holds in a part."""
        return not self.everywhere(not holds)

    def least(self, values: Array) -> Array:
        """The least of what every part has, number by number."""
        return values

    def smallest(self, values: Field) -> float:
        """The smallest of the values of all parts; infinite where there are none."""
        return float(self.least(np.array([values.min(initial=np.inf)]))[0])

    def largest(self, values: Field) -> float:
        """The largest of the values of all parts; negatively infinite where there are none."""
        return -self.smallest(-values)

    def mean(self, values: NDArray[Any]) -> float:
        """Mean of the values of all parts."""
        return float(self.means(values.reshape(1, -1))[0])

    def means(self, rows: NDArray[Any]) -> Field:
        """Mean of each of some rows (k, m) of values of all parts."""
        return np.array([row.mean() for row in rows])

    def median(self, values: Field) -> float:
        """Median of the values of all parts."""
        return float(np.median(values))

    def percentiles(self, rows: Field, shares: Sequence[float]) -> Field:
        """Those of the values of all parts, in each of some rows (k, m), that shares, in per cent, do not exceed."""
        # Values of cells, not interpolated: exact, and infinite ones do no harm.
        return np.array([np.percentile(row, shares, method="inverted_cdf") for row in rows])

    def distinct(self, values: NDArray[Any], most: float = np.inf) -> NDArray[Any] | None:
        """The different values of all parts, ascending; None where there are more than so many."""
        found = np.unique(values)
        return found if len(found) <= most else None

    def at_smallest(self, values: Field, marks: NDArray[np.bool_]) -> bool:
        """The mark (k,) at the smallest of the values (k,) of all parts, the first where there are several."""
        return bool(marks[values.argmin()])

    def named(self, label: Any) -> Any:
        """A label that a part has, where others have None; the first of several."""
        return label

    # -------------------------------------------------------------------------------- fields on nodes
    def update(self, field: Array) -> Array:
        """The field with the values of nodes that others own."""
        return field

    def joined(self, nodes: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """True at nodes where a part says so."""
        return nodes

    def add(self, field: Array) -> Array:
        """The field with what others add to own nodes."""
        return field

    def least_at_nodes(self, field: Array) -> Array:
        """The least of what parts have at every node."""
        return field


SERIAL = Space()


@loop
def _inner(first, last, size, a, b, sums):  # type: ignore[no-untyped-def]
    for block in range(first, last):
        for i in range(block * size, min((block + 1) * size, len(a))):
            for k in range(3):
                sums[block] += a[i, k] * b[i, k]
