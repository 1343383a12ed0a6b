"""The space that fields on the nodes of a mesh live in: how sums over them are taken."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import loop, parallel_ranges

__all__ = ["SERIAL", "Space", "accumulate"]

Field = NDArray[np.float64]

_BLOCK, _FEWEST = 8192, 8  # rows whose products are summed by themselves; blocks for a thread of its own


class Space:
    """Fields (n, 3) in one process, all of whose nodes are its own.

    Where nodes are shared out, a subclass sums over the parts: all that minimizers know of that is here.

    Examples
    --------
    >>> SERIAL.inner(np.ones((2, 3)), np.ones((2, 3)))
    6.0
    """

    def inner(self, a: Field, b: Field) -> float:
        """Euclidean inner product of two fields, summed in blocks of rows whatever the number of threads."""
        sums = np.zeros(-(-len(a) // _BLOCK))
        parallel_ranges(_inner, len(sums), _BLOCK, a, b, sums, smallest=_FEWEST)
        return self.total(float(sums.sum()))

    def total(self, value: float) -> float:
        """The sum of what every part has."""
        return value

    def everywhere(self, holds: bool) -> bool:
        """True where something holds in every part."""
        return holds

    def update(self, field: Field) -> Field:
        """The field with the values of nodes that others own."""
        return field

    def add(self, field: Field) -> Field:
        """The field with what others add to own nodes."""
        return field


SERIAL = Space()


@loop
def _inner(first, last, size, a, b, sums):  # type: ignore[no-untyped-def]
    for block in range(first, last):
        for i in range(block * size, min((block + 1) * size, len(a))):
            for k in range(3):
                sums[block] += a[i, k] * b[i, k]


@loop
def _accumulate(first, last, x, factor, y):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        for k in range(3):
            x[i, k] += factor * y[i, k]


def accumulate(x: Field, factor: float, y: Field) -> None:
    """Add a multiple of one field to another, in place."""
    parallel_ranges(_accumulate, len(x), x, factor, y, smallest=_FEWEST * _BLOCK)
