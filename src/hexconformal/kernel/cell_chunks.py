"""Cells in chunks, of which threads may take several at once where no two of them share a node.

Sums over cells add to nodes and to blocks of pairs of nodes. Chunks of cells are coloured so that those of one colour
share no node; colour after colour, each entry is written by one thread at a time, and always in the same order. What is
summed up is summed per chunk. So results do not depend on the number of threads, and nothing is written twice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .jit import loop
from .threads import parallel_ranges

__all__ = ["CellChunks"]

Ints = NDArray[np.int64]

_SIZE = 128  # cells of a chunk: some hundred microseconds each, far above what it costs to hand one over
_FEWEST = 8  # chunks: fewer cells are one
_COLOURS = 64  # bits of a mask; where cells are in no order chunks may need more, and get one of their own


@dataclass(frozen=True, eq=False)
class CellChunks:
    """Chunks of consecutive cells, by colour.

    Attributes
    ----------
    count, size
        Number of cells, and of those in a chunk; the last has what is left.
    order
        (k,) numbers of the chunks, colour after colour.
    starts
        (c + 1,) where each colour begins.

    Examples
    --------
    >>> CellChunks.unshared(600).starts
    array([0, 1])
    """

    count: int
    size: int
    order: Ints
    starts: Ints

    @classmethod
    def unshared(cls, count: int) -> CellChunks:
        """Chunks for loops that write to no node: all of one colour."""
        size = _SIZE if count >= _FEWEST * _SIZE else max(count, 1)
        chunks = -(-count // size)
        return cls(count, size, np.arange(chunks), np.array([0, chunks]))

    @classmethod
    def of(cls, cells: Ints, nodes: int) -> CellChunks:
        """Chunks of cells (m, k) of so many nodes: the fewer colours, the better they are ordered in space."""
        plain = cls.unshared(len(cells))
        if len(plain.order) < 2:
            return plain
        colours = np.empty(len(plain.order), np.int64)
        _colour(cells, plain.size, np.zeros(nodes, np.uint64), np.zeros(_COLOURS, np.int64), colours)
        sizes = np.unique(colours, return_counts=True)[1]
        order = np.argsort(colours, kind="stable")
        return cls(plain.count, plain.size, order, np.concatenate([[0], np.cumsum(sizes)]))

    def total(self, function: Callable[..., None], *arguments: Any) -> float:
        """The sum of what ``function(first, last, chunks, size, sums, *arguments)`` finds for the chunks.

        It takes the cells of ``chunks[first:last]``, and writes their sums to ``sums[chunk]``; it may end at the first
        that is not finite.
        """
        sums = np.zeros(len(self.order))
        for first, last in pairwise(self.starts):
            chunks = self.order[first:last]
            parallel_ranges(function, len(chunks), chunks, self.size, sums, *arguments, smallest=1)
            if not np.isfinite(sums[chunks]).all():
                return float("inf")
        return float(sums.sum())


@loop
def _colour(cells, size, taken, used, colours):  # type: ignore[no-untyped-def]
    """The colour of each chunk: of those that no node of it has, the one that fewest chunks have so far."""
    known, own = 0, len(used)
    for chunk in range(len(colours)):
        first, last = chunk * size, min((chunk + 1) * size, len(cells))
        mask = np.uint64(0)
        for c in range(first, last):
            for a in range(cells.shape[1]):
                mask |= taken[cells[c, a]]
        best = -1
        for colour in range(known):
            if (mask >> np.uint64(colour)) & np.uint64(1) == np.uint64(0) and (best < 0 or used[colour] < used[best]):
                best = colour
        if best < 0 and known < len(used):
            best, known = known, known + 1
        if best < 0:
            colours[chunk], own = own, own + 1
            continue
        colours[chunk] = best
        used[best] += 1
        for c in range(first, last):
            for a in range(cells.shape[1]):
                taken[cells[c, a]] |= np.uint64(1) << np.uint64(best)
