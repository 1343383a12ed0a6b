"""Digests of rows with ids that do not depend on their order, and add up: that of a whole is the sum of its parts'."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["row_digest"]

Words = NDArray[np.uint64]

_SEEDS = (0x243F6A8885A308D3, 0x13198A2E03707344)  # digits of pi
_STEP = np.uint64(0x9E3779B97F4A7C15)


def row_digest(ids: NDArray[Any], rows: NDArray[Any]) -> Words:
    """Digest (2,) of rows of numbers, each with its id.

    Parameters
    ----------
    ids
        (k,) integers.
    rows
        (k, ...) integers, or floats, of which every bit counts but the sign of zero.

    Returns
    -------
    Two sums, modulo 2^64, of a hash of every row and its id (the finalizer of splitmix64: Steele, Lea, Flood 2014).

    Examples
    --------
    >>> ids, rows = np.array([4, 7, 9]), np.array([[0.5, 1.0], [2.0, 3.0], [-1.0, 0.0]])
    >>> whole = row_digest(ids, rows)
    >>> bool((whole == row_digest(ids[::-1], rows[::-1])).all())
    True
    >>> bool((whole == row_digest(ids[:1], rows[:1]) + row_digest(ids[1:], rows[1:])).all())
    True
    >>> bool((whole == row_digest(ids, rows[::-1])).any())
    False
    """
    flat = np.asarray(rows).reshape(len(rows), int(np.prod(np.shape(rows)[1:], dtype=np.int64)))
    bits = (flat + 0.0).view(np.uint64) if flat.dtype.kind == "f" else flat.astype(np.int64).view(np.uint64)
    sums = np.zeros(len(_SEEDS), dtype=np.uint64)
    for place, seed in enumerate(_SEEDS):
        hashes = _mixed(np.asarray(ids).astype(np.int64).view(np.uint64) ^ np.uint64(seed))
        for column in bits.T:
            hashes = _mixed((hashes + _STEP) ^ column)
        sums[place] = hashes.sum(dtype=np.uint64)
    return sums


def _mixed(words: Words) -> Words:
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))
