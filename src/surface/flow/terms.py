"""The energies of the flows: integrals of a density that depends on the mean curvature vector Y and the area.

A term is a density e(Y, c) with c = f1 x f2 the area vector, homogeneous of degree one in c. Adding a flow means
adding a class with the four methods of :class:`Term`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from hexconformal.common import OptionError, require_numbers

from ..mesh import Floats

__all__ = ["Bending", "Membrane", "Tension", "Term"]


@runtime_checkable
class Term(Protocol):
    """Part of an energy, equation (23).

    Its methods take the mean curvature vector ``y``, (f, r, 3) at the r points of f frames, and the area vectors ``c``,
    (f, 3), in units of the mesh.
    """

    curved: bool  # whether Y matters

    def density(self, y: Floats, c: Floats) -> Floats:
        """(f, r) density over the reference measure."""

    def by_curvature(self, y: Floats, c: Floats) -> Floats:
        """(f, r, 3) its derivative with respect to Y."""

    def by_area(self, y: Floats, c: Floats) -> Floats:
        """(f, r, 3) its derivative with respect to c."""

    def stiffness(self, y: Floats) -> tuple[Floats | float, float]:
        """Coefficients that make a step implicit: of <Y, Y> (f, r), and of the area; both not negative."""


@dataclass(frozen=True)
class Tension:
    """Surface tension, ``tension`` times the area; its flow is mean curvature flow, u_t = Y (Dziuk)."""

    tension: float = 1.0
    curved = False

    def __post_init__(self) -> None:
        _require_finite(self, "tension")

    def density(self, y: Floats, c: Floats) -> Floats:
        return np.asarray(self.tension * _length(c)[:, None])

    def by_curvature(self, y: Floats, c: Floats) -> Floats:
        return np.zeros_like(y)

    def by_area(self, y: Floats, c: Floats) -> Floats:
        return np.asarray(self.tension * _unit(c)[:, None])

    def stiffness(self, y: Floats) -> tuple[Floats | float, float]:
        return 0.0, max(self.tension, 0.0)


@dataclass(frozen=True)
class Bending:
    """The p-Willmore energy int |Y|^p dA = 2^p int |H|^p dA, p >= 1 (Gruber & Aulisa 2020), equation (24).

    Raises
    ------
    OptionError
        If p is below 1.
    """

    p: float = 2.0
    curved = True

    def __post_init__(self) -> None:
        require_numbers(self, "p")
        if not 1.0 <= self.p < float("inf"):
            raise OptionError(f"p must be at least 1, not {self.p!r} (p = 0 is the area: MeanCurvature)")

    def density(self, y: Floats, c: Floats) -> Floats:
        return np.asarray(_length(y) ** self.p * _length(c)[:, None])

    def by_curvature(self, y: Floats, c: Floats) -> Floats:
        return np.asarray((self.p * self._power(y) * _length(c)[:, None])[:, :, None] * y)

    def by_area(self, y: Floats, c: Floats) -> Floats:
        return np.asarray((_length(y) ** self.p)[:, :, None] * _unit(c)[:, None])

    def stiffness(self, y: Floats) -> tuple[Floats | float, float]:
        # The larger eigenvalue of the density's Hessian; flat places keep a little where p is not 2.
        length = _length(y)
        floor = 1e-3 * float(np.sqrt((length**2).mean())) + 1e-300
        return self.p * max(self.p - 1.0, 1.0) * np.maximum(length, floor) ** (self.p - 2.0), 0.0

    def _power(self, y: Floats) -> Floats:
        """|Y|^(p-2), zero where Y is and p < 2: there the energy has a kink, and 0 is one of its slopes."""
        length = _length(y)
        if self.p >= 2:
            return np.asarray(length ** (self.p - 2.0))
        return np.asarray(np.where(length > 0, np.where(length > 0, length, 1.0) ** (self.p - 2.0), 0.0))


@dataclass(frozen=True)
class Membrane:
    """The bending energy of membranes, int kc/2 (2 H - c0)^2 + gamma dA (Canham, Helfrich), equation (25).

    With Y = -2 H N the square is |Y|^2 + 2 c0 <Y, N> + c0^2. H is positive on a sphere whose normal points outwards.

    Attributes
    ----------
    kc
        Bending modulus, an energy.
    c0
        Spontaneous curvature, one over a length.
    gamma
        Surface tension, an energy per area.
    """

    kc: float = 1.0
    c0: float = 0.0
    gamma: float = 0.0
    curved = True

    def __post_init__(self) -> None:
        _require_finite(self, "kc", "c0", "gamma")
        if not self.kc > 0.0:
            raise OptionError(f"kc must be positive, not {self.kc!r}")

    def density(self, y: Floats, c: Floats) -> Floats:
        flat = self.kc * self.c0**2 / 2 + self.gamma
        bending = self.kc / 2 * (y * y).sum(axis=2) + flat
        return np.asarray(bending * _length(c)[:, None] + self.kc * self.c0 * (y * c[:, None]).sum(axis=2))

    def by_curvature(self, y: Floats, c: Floats) -> Floats:
        return np.asarray(self.kc * (y * _length(c)[:, None, None] + self.c0 * c[:, None]))

    def by_area(self, y: Floats, c: Floats) -> Floats:
        flat = self.kc * self.c0**2 / 2 + self.gamma
        bending = self.kc / 2 * (y * y).sum(axis=2) + flat
        return np.asarray(bending[:, :, None] * _unit(c)[:, None] + self.kc * self.c0 * y)

    def stiffness(self, y: Floats) -> tuple[Floats | float, float]:
        return self.kc, max(self.gamma + self.kc * self.c0**2 / 2, 0.0)


def _require_finite(term: Term, *names: str) -> None:
    require_numbers(term, *names)
    for name in names:
        if not np.isfinite(getattr(term, name)):
            raise OptionError(f"{name} must be finite, not {getattr(term, name)!r}")


def _length(vectors: Floats) -> Floats:
    return np.asarray(np.linalg.norm(vectors, axis=-1))


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / _length(vectors)[..., None])
