"""Terms: the functions of the points of a mesh that objectives are sums of."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..kernel import CellChunks
from .block_matrix import Assembly, Places

__all__ = ["Patch", "SummedTerm", "Term"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_NO_BLOCKS = np.empty((0, 3, 3)), np.empty((0, 36), np.int32)
_DIFFERENCE = 1e-6  # step of differences of gradients where edges are about 1: half of the digits are left


@dataclass(frozen=True, eq=False)
class Patch:
    """Some cells of a mesh, with nodes that move while all others stay.

    Attributes
    ----------
    cells
        Ids of its cells: all that have a node that moves.
    nodes
        Ids of the nodes of these.
    moving
        (n,) the nodes of the mesh that move.
    points
        (n, 3) where the nodes of the mesh are.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((3, 1, 1))
    >>> moving = np.zeros(len(points), dtype=bool)
    >>> moving[cells[0, 0]] = True
    >>> patch = Patch.around(moving, cells, points)
    >>> patch.cells, len(patch.nodes), patch.local[cells[0]]
    (array([0]), 8, array([0, 1, 3, 2, 4, 5, 7, 6]))
    """

    cells: Ints
    nodes: Ints
    moving: Mask
    points: Field

    @classmethod
    def around(cls, moving: Mask, cells: Ints, points: Field) -> Patch:
        """The patch of the nodes (n,) that move."""
        around = np.flatnonzero(moving[cells].any(axis=1))
        return cls(around, np.unique(cells[around]), moving, points)

    @cached_property
    def local(self) -> Ints:
        """(n,) place in the patch of every node of the mesh; -1 for those outside."""
        local = np.full(len(self.moving), -1)
        local[self.nodes] = np.arange(len(self.nodes))
        return local


class Term(ABC):
    """A function of the points (n, 3) of a mesh; outside its domain it is infinite.

    A subclass gives value, gradient, and its restriction to a patch; for the convex equation also the convex part of
    the second derivative in 3 x 3 blocks. One that looks for closest points may also look again from where it is.
    """

    @abstractmethod
    def value(self, points: Field) -> float:
        """The value at some points."""

    @abstractmethod
    def value_gradient(self, points: Field) -> tuple[float, Field]:
        """The value, and the gradient (n, 3)."""

    @abstractmethod
    def restricted(self, patch: Patch) -> Term:
        """The term as a function of the points of a patch."""

    def add_convex(self, points: Field, gradient: Field, assembly: Assembly) -> tuple[float, Term]:
        """Add the gradient, and the convex part of the second derivative; returns the value and the term from here."""
        raise NotImplementedError(f"{type(self).__name__} has no convex part: minimize it by L-BFGS")

    def renewed(self, points: Field) -> Term:
        """The term as it is seen from these points."""
        return self

    def second_product(self, points: Field, variation: Field) -> Field:
        """The second derivative times a variation (n, 3), by differences of gradients where nothing better is known."""
        largest = float(np.abs(variation).max(initial=0.0))
        if largest == 0.0:
            return np.zeros_like(variation)
        step = _DIFFERENCE / largest
        ahead, behind = (self.value_gradient(points + sign * step * variation)[1] for sign in (1.0, -1.0))
        return np.asarray((ahead - behind) / (2.0 * step))

    def frozen_product(self, points: Field, variation: Field) -> Field:
        """The same of what lies above the term and touches it at the points, with normals frozen."""
        return self.second_product(points, variation)


class SummedTerm(Term):
    """A term that one compiled loop over cells sums up, to any order of its derivatives."""

    cells: Ints

    @abstractmethod
    def _sums(
        self, chunks: CellChunks, points: Field, order: int, gradient: Field, data: Field, places: Places
    ) -> float:
        """The value; from order 1 on adds the gradient, from 2 on the convex blocks to the data at places (m, 36)."""

    @cached_property
    def _chunks(self) -> CellChunks:
        """The cells in chunks that threads may add to nodes at once."""
        return CellChunks.of(self.cells, int(self.cells.max(initial=-1)) + 1)

    def value(self, points: Field) -> float:
        """The value at some points (n, 3)."""
        return self._sums(CellChunks.unshared(len(self.cells)), points, 0, np.empty((0, 3)), *_NO_BLOCKS)

    def value_gradient(self, points: Field) -> tuple[float, Field]:
        """The value, and the gradient (n, 3)."""
        gradient = np.zeros_like(points)
        return self._sums(self._chunks, points, 1, gradient, *_NO_BLOCKS), gradient

    def add_convex(self, points: Field, gradient: Field, assembly: Assembly) -> tuple[float, Term]:
        """Add gradient and convex blocks."""
        return self._sums(assembly.chunks, points, 2, gradient, assembly.matrix.data, assembly.places), self
