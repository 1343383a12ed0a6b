"""A term of points that depend linearly on those of the mesh."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from .term import Patch, Term

__all__ = ["ComposedTerm"]

Field = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ComposedTerm(Term):
    """f(S x + b) for a term f and a matrix S: of nodes that lie inside cells, for instance.

    Attributes
    ----------
    term
        The term f.
    matrix
        (k, n) S.
    offset
        (k, 3) b: what nodes that do not move contribute.

    Examples
    --------
    >>> from hexconformal.energy import DistortionTerm
    >>> from hexconformal.generate import box
    >>> points, cells = box((6, 6, 6), (1.0, 1.0, 2.0))
    >>> halved = scipy.sparse.csr_array(0.5 * scipy.sparse.eye_array(len(points)))
    >>> round(ComposedTerm(DistortionTerm(cells, len(points)), halved).value(points), 10)
    6.0
    """

    term: Term
    matrix: scipy.sparse.csr_array
    offset: Field | float = 0.0

    def places(self, points: Field) -> Field:
        """(k, 3) S x + b."""
        return np.asarray(self.matrix @ points + self.offset)

    def value(self, points: Field) -> float:
        """Value at the points (n, 3)."""
        return self.term.value(self.places(points))

    def value_gradient(self, points: Field) -> tuple[float, Field]:
        """Value and gradient (n, 3)."""
        value, gradient = self.term.value_gradient(self.places(points))
        return value, np.asarray(self.matrix.T @ gradient)

    def second_product(self, points: Field, variation: Field) -> Field:
        """The second derivative S^T H S times a variation (n, 3)."""
        return np.asarray(self.matrix.T @ self.term.second_product(self.places(points), self.matrix @ variation))

    def restricted(self, patch: Patch) -> ComposedTerm:
        """The same where only the nodes of a patch move; what the others contribute is a constant."""
        others = patch.points.copy()
        others[patch.nodes] = 0.0
        return replace(self, matrix=self.matrix[:, patch.nodes], offset=self.places(others))
