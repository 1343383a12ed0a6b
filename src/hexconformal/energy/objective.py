"""Objectives: sums of terms, of which nothing else needs to know what they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .block_matrix import Assembly
from .term import Patch, Term

__all__ = ["Objective"]

Field = NDArray[np.float64]


@dataclass(frozen=True)
class Objective:
    """A sum of terms.

    Attributes
    ----------
    terms
        The terms; cheap ones that may be infinite are best first.

    Examples
    --------
    >>> from hexconformal.energy import DistortionTerm
    >>> from hexconformal.generate import box
    >>> points, cells = box((6, 6, 6), (1.0, 1.0, 2.0))
    >>> distortion = DistortionTerm(cells, len(points))
    >>> round(Objective((distortion, distortion)).value(points), 10)
    48.0
    """

    terms: tuple[Term, ...]

    def value(self, points: Field) -> float:
        """The sum at points (n, 3); infinite outside the domain of a term."""
        total = 0.0
        for term in self.terms:
            total += term.value(points)
            if not np.isfinite(total):
                return float("inf")
        return total

    def value_gradient(self, points: Field) -> tuple[float, Field]:
        """The sum and its gradient (n, 3)."""
        total, gradient = self.terms[0].value_gradient(points)
        for term in self.terms[1:]:
            value, force = term.value_gradient(points)
            total += value
            gradient += force
        return total, gradient

    def convex(self, points: Field, assembly: Assembly) -> tuple[float, Field, Objective]:
        """Value, gradient (n, 3), and the objective as it is seen from here; the assembly gets the convex blocks."""
        gradient, total, terms = np.zeros_like(points), 0.0, []
        assembly.clear()
        for term in self.terms:
            value, seen = term.add_convex(points, gradient, assembly)
            total += value
            terms.append(seen)
        return total, gradient, Objective(tuple(terms))

    def second_product(self, points: Field, variation: Field) -> Field:
        """The second derivative at the points times a variation (n, 3)."""
        return self._product([term.second_product(points, variation) for term in self.terms])

    def frozen_product(self, points: Field, variation: Field) -> Field:
        """The same of the majorizing sum, normals frozen."""
        return self._product([term.frozen_product(points, variation) for term in self.terms])

    def restricted(self, patch: Patch) -> Objective:
        """The objective as a function of the points of a patch."""
        return Objective(tuple(term.restricted(patch) for term in self.terms))

    def renewed(self, points: Field) -> Objective:
        """The objective as it is seen from these points; itself if that makes no difference."""
        terms = tuple(term.renewed(points) for term in self.terms)
        same = all(one is other for one, other in zip(terms, self.terms, strict=True))
        return self if same else Objective(terms)

    @staticmethod
    def _product(fields: list[Field]) -> Field:
        total = fields[0]
        for field in fields[1:]:
            total += field
        return total
