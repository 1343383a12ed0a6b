"""Sums of fields on nodes, in place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel import loop, parallel_ranges

__all__ = ["accumulate"]

Field = NDArray[np.float64]

_SMALLEST = 65536  # rows that a thread of its own is worth


@loop
def _accumulate(first, last, x, factor, y):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        for k in range(3):
            x[i, k] += factor * y[i, k]


def accumulate(x: Field, factor: float, y: Field) -> None:
    """Add a multiple of one field to another, in place."""
    parallel_ranges(_accumulate, len(x), x, factor, y, smallest=_SMALLEST)
