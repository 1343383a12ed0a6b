"""Whether a remeshed surface is no worse than the input, and so much better that nodes are moved for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mesh import Cells, Floats
from .options import Options, Record

__all__ = ["Acceptance"]

_ROUNDING = 1e-9  # degrees, or of the energy
_SLIGHTLY = 1e-3  # of the smallest angle: corners of a plane grid have the best one there is, and hold all others
_VAIN = (1.02, 0.1)  # factor of the smallest and gain of the mean angle from which on anything was gained at all
_TENTH = 0.1  # of the energy; and of the smallest angle, or of what the mean one misses: that nodes are moved for
_FAR, _DEAR = 0.5, 0.15  # of the distance that is allowed, beyond which so much of what an angle misses must be gained
_ENERGY = 0.02  # relative decrease, where the cells shall have other shapes than regular ones


@dataclass(frozen=True)
class Acceptance:
    """Compares surfaces with the input: by their angles, or by the energy where regular cells are not what is wanted.

    Attributes
    ----------
    options
        What was asked.
    cells
        Of the surface.
    first
        Record of the input.
    scale
        An energy of one cell that is all wrong, in the unit of the records.
    farthest
        The largest distance from the input of any surface so far, relative to the diagonal.
    """

    options: Options
    cells: Cells
    first: Record
    scale: float = 1.0
    farthest: float = 0.0

    @property
    def _by_energy(self) -> bool:
        return not isinstance(self.options.target, str) or self.options.target == "input"

    @property
    def _smallest(self) -> float:
        return (1 - _SLIGHTLY) * self.first.min_angle

    def no_worse(self, now: Record) -> bool:
        """Whether no more cells are turned over, and neither the smallest (but slightly) nor the mean angle smaller."""
        if self._by_energy:
            better = now.energy < self.first.energy - _ROUNDING * self.scale
        else:
            better = now.min_angle >= self._smallest and now.mean_angle >= self.first.mean_angle - _ROUNDING
        return better and now.turned <= self.first.turned

    def beats(self, now: Record, other: Record) -> bool:
        """Whether of two surfaces that are no worse than the input the first is better."""
        return self._merit(now) > self._merit(other)

    def _merit(self, record: Record) -> tuple[float, ...]:
        angles = (record.mean_angle, record.min_angle)
        if self.options.emphasis == "worst":
            angles = angles[::-1]
        return (self.worthwhile(record), -record.turned, *((-record.energy,) if self._by_energy else angles))

    def thinner(self, angles: Floats) -> NDArray[np.bool_]:
        """(m,) cells, of whose smallest angles are given, that are thinner than any of the input."""
        return np.asarray(angles < self._smallest)

    def in_vain(self, best: Record) -> bool:
        """Whether hardly anything was gained."""
        if self._by_energy:
            return best.energy > (1 - _ENERGY) * self.first.energy
        gained = best.mean_angle - self.first.mean_angle
        return best.min_angle < _VAIN[0] * self.first.min_angle and gained < _VAIN[1]

    def promising(self, energy: float) -> bool:
        """Whether an energy is so much lower that nodes were moved for it, if no cell stood in the way."""
        plain = self._by_energy or self.options.emphasis == "worst"
        return energy <= (1 - (_ENERGY if plain else _TENTH)) * self.first.energy

    def worthwhile(self, best: Record) -> bool:
        """Whether so much was gained that nodes are moved for it; what is as good as it gets stays where it is."""
        if self._by_energy or self.options.emphasis == "worst" or best.turned < self.first.turned:
            return not self.in_vain(best)
        smallest, mean = best.min_angle - self.first.min_angle, best.mean_angle - self.first.mean_angle
        share = _DEAR if self.farthest > _FAR * self.options.hausdorff else 0.0
        enough = smallest >= max(_TENTH * self.first.min_angle, share * self._missing(self.first.min_angle))
        enough = enough or mean >= max(_TENTH, share) * self._missing(self.first.mean_angle)
        return enough and self.promising(best.energy)

    def _missing(self, angle: float) -> float:
        """Degrees that an angle misses of what a regular cell has, on average over the cells."""
        t, q = len(self.cells.triangles), len(self.cells.quads)
        return (60.0 * t + 90.0 * q) / (t + q) - angle
