"""Rows of a sparse triangle in parts that threads work on at once, and the entries between these."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernel import loop, parallel_ranges

__all__ = ["RowParts"]

Ints = NDArray[np.int64]

_PART, _PARTS = 4096, 64  # rows of a part at least, and parts at most: more parts need more iterations


@dataclass(frozen=True, eq=False)
class RowParts:
    """Consecutive rows in parts, and the entries between these.

    Attributes
    ----------
    bounds
        (p + 1,) first row of each part, and the end.
    inner
        (n,) place of the first entry of each row that is in its own part.
    offsets, rows, places
        Entries (i, j) of rows in later parts, by their column j: (n + 1,) offsets, their rows and their places.
    """

    bounds: Ints
    inner: Ints
    offsets: Ints
    rows: NDArray[np.int32]
    places: Ints

    @classmethod
    def of(cls, indptr: Ints, indices: NDArray[np.int32]) -> RowParts:
        """Parts of the rows of a lower triangle."""
        count = len(indptr) - 1
        parts = min(max(count // _PART, 1), _PARTS)
        bounds = np.array([count * k // parts for k in range(parts + 1)])
        inner, offsets = np.empty(count, np.int64), np.zeros(count + 1, np.int64)
        parallel_ranges(_inner, parts, bounds, indptr, indices, inner, smallest=1)
        _count_between(indptr, indices, inner, offsets)
        offsets = np.cumsum(offsets)
        rows, places = np.empty(offsets[-1], np.int32), np.empty(offsets[-1], np.int64)
        _list_between(indptr, indices, inner, offsets[:-1].copy(), rows, places)
        return cls(bounds, inner, offsets, rows, places)


@loop
def _inner(first, last, bounds, indptr, indices, inner):  # type: ignore[no-untyped-def]
    for part in range(first, last):
        for i in range(bounds[part], bounds[part + 1]):
            k = indptr[i]
            while k < indptr[i + 1] and indices[k] < bounds[part]:
                k += 1
            inner[i] = k


@loop
def _count_between(indptr, indices, inner, offsets):  # type: ignore[no-untyped-def]
    for i in range(len(inner)):
        for k in range(indptr[i], inner[i]):
            offsets[indices[k] + 1] += 1


@loop
def _list_between(indptr, indices, inner, ends, rows, places):  # type: ignore[no-untyped-def]
    for i in range(len(inner)):
        for k in range(indptr[i], inner[i]):
            j = indices[k]
            rows[ends[j]], places[ends[j]] = i, k
            ends[j] += 1
