"""The rules by which a remeshed surface is accepted: no worse than the input, and enough better to move nodes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hexconformal.geometry import Faces

from ..mesh import Floats
from ..quality import smallest_angles
from .options import Options, Record
from .schedules import AcceptanceSchedule, ApproachSchedule

__all__ = ["Acceptance", "AngleLimits"]

_ROUNDING = 1e-9  # of a mean angle in degrees, or of the energy


@dataclass(frozen=True, eq=False)
class AngleLimits:
    """What the angles of some cells may fall to.

    Attributes
    ----------
    cells
        The cells.
    least, mean
        The smallest of their smallest angles, and the mean, in degrees.
    """

    cells: Faces
    least: float
    mean: float

    def angles(self, points: Floats) -> Floats:
        """(m,) smallest angle of each cell."""
        return smallest_angles(points, self.cells)


@dataclass(frozen=True)
class Acceptance:
    """Compares surfaces with the input: by their angles, or by the energy where regular cells are not what is wanted.

    Attributes
    ----------
    options
        Options of the remeshing.
    cells
        Faces of the surface.
    first
        Record of the input.
    scale
        Energy of one very bad cell, in the unit of the records.
    largest_distance
        The largest distance from the input of any surface so far, relative to the diagonal.
    schedule
        What is enough.
    """

    options: Options
    cells: Faces
    first: Record
    scale: float = 1.0
    largest_distance: float = 0.0
    schedule: AcceptanceSchedule = field(default_factory=AcceptanceSchedule)

    @property
    def by_energy(self) -> bool:
        """True if surfaces are compared by their energy."""
        return not isinstance(self.options.target, str) or self.options.target == "input"

    @property
    def _least_angle(self) -> float:
        return (1 - self.schedule.angle_tolerance) * self.first.min_angle

    def no_worse(self, now: Record) -> bool:
        """True if no more cells are turned over, and neither the smallest (but slightly) nor the mean angle smaller."""
        if self.by_energy:
            better = now.energy < self.first.energy - _ROUNDING * self.scale
        else:
            better = now.min_angle >= self._least_angle and now.mean_angle >= self.first.mean_angle - _ROUNDING
        return better and now.turned <= self.first.turned

    def is_better(self, now: Record, other: Record) -> bool:
        """True if the first of two surfaces, both no worse than the input, is the better one."""
        return self._merit(now) > self._merit(other)

    def _merit(self, record: Record) -> tuple[float, ...]:
        angles = (record.mean_angle, record.min_angle)
        if self.options.emphasis == "worst":
            angles = angles[::-1]
        return (self.is_worthwhile(record), -record.turned, *((-record.energy,) if self.by_energy else angles))

    def too_thin(self, angles: Floats) -> NDArray[np.bool_]:
        """(m,) cells whose smallest angles, which are given, are smaller than any of the input."""
        return np.asarray(angles < self._least_angle)

    def angle_limits(self, best: Record, schedule: ApproachSchedule) -> AngleLimits:
        """What the angles of the best surface may fall to as it is brought nearer to the input."""
        gains = best.min_angle - self.first.min_angle, best.mean_angle - self.first.mean_angle
        least, mean = (min(schedule.degrees, schedule.share * max(gain, 0.0)) for gain in gains)
        # More would be worth moving nodes for again.
        mean = min(mean, schedule.deficit_share * self._deficit(best.mean_angle))
        return AngleLimits(self.cells, best.min_angle - least, best.mean_angle - mean)

    def gained_nothing(self, best: Record) -> bool:
        """True if hardly anything was gained."""
        if self.by_energy:
            return best.energy > (1 - self.schedule.energy_gain) * self.first.energy
        gained = best.mean_angle - self.first.mean_angle
        least = (1 + self.schedule.small_gain) * self.first.min_angle
        return best.min_angle < least and gained < self.schedule.small_degrees

    def is_low(self, energy: float) -> bool:
        """True if an energy is low enough to move nodes for it."""
        small_gain = self.by_energy or self.options.emphasis == "worst"
        gain = self.schedule.energy_gain if small_gain else self.schedule.large_gain
        return energy <= (1 - gain) * self.first.energy

    def is_worthwhile(self, best: Record) -> bool:
        """True if enough was gained to move nodes for it; a surface that is as good as it gets stays where it is."""
        if self.by_energy or self.options.emphasis == "worst" or best.turned < self.first.turned:
            return not self.gained_nothing(best)
        smallest, mean = best.min_angle - self.first.min_angle, best.mean_angle - self.first.mean_angle
        large, far = self.schedule.large_gain, self.schedule.far_share * self.options.hausdorff
        wanted = self.schedule.far_gain if self.largest_distance > far else 0.0
        enough = smallest >= max(large * self.first.min_angle, wanted * self._deficit(self.first.min_angle))
        enough = enough or mean >= max(large, wanted) * self._deficit(self.first.mean_angle)
        return enough and self.is_low(best.energy)

    def _deficit(self, angle: float) -> float:
        """Degrees by which an angle is smaller than that of a regular cell, on average over the cells."""
        t, q = len(self.cells.triangles), len(self.cells.quads)
        return (60.0 * t + 90.0 * q) / (t + q) - angle
