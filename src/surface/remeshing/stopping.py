"""Continuation of a descent towards its final energy, and the test that it has stalled."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..energy import Barrier, SurfaceEnergy
from ..mesh import Floats
from .schedules import ContinuationSchedule

__all__ = ["Continuation", "StallTest"]

_TINY = 1e-300


@dataclass(frozen=True)
class Continuation:
    """The way from an energy that bad cells do not dominate to the final one.

    Attributes
    ----------
    schedule
        Where it begins and ends, and when it advances.
    cap
        Density from which on a cell counts less; see :class:`surface.energy.Barrier`.
    factor
        Of m in equation (16); 1 is the energy itself.
    """

    schedule: ContinuationSchedule
    cap: float
    factor: float

    @classmethod
    def of(cls, schedule: ContinuationSchedule) -> Continuation:
        """The beginning of a continuation."""
        return cls(schedule, schedule.first_cap, schedule.first_factor)

    @property
    def complete(self) -> bool:
        """True if cap and factor are the final ones."""
        return self.cap == self.schedule.final_cap and self.factor == 1

    def after(self, decrease: float) -> Continuation:
        """The continuation after a step of this relative decrease: it advances once steps gain little."""
        if decrease < self.schedule.slow_decrease:
            cap = min(2 * self.cap, self.schedule.final_cap)
            return replace(self, cap=cap, factor=max(self.factor / 4, 1.0))
        return self

    def with_final_energy(self) -> Continuation:
        """The same with the final factor."""
        return replace(self, factor=1.0)

    def completed(self) -> Continuation:
        """The end of the continuation."""
        return replace(self, cap=self.schedule.final_cap, factor=1.0)


class StallTest:
    """Notices when iterations hardly lower the energy any more.

    Late in a run not all normals are taken anew, so that the energy that is minimized may stall before the energy
    against the cells' own normals does: then the latter decides.

    Parameters
    ----------
    energy
        The energy that is minimized.
    tolerance
        Relative decrease per iteration that is worth going on for.
    schedule
        When a run is late, and how long it may stall.

    Attributes
    ----------
    late
        Whether a step with the final energy has gained little already.
    """

    def __init__(self, energy: SurfaceEnergy, tolerance: float, schedule: ContinuationSchedule) -> None:
        self._energy, self._tolerance, self._schedule = energy, tolerance, schedule
        self.late = False
        self._slow_steps = self._since_lowest = 0
        self._lowest = self._own_value = np.inf

    @property
    def stalled(self) -> bool:
        """True if it is time to end the run."""
        longest = self._schedule
        return self._slow_steps == longest.stalled_steps or self._since_lowest == longest.stalled_energy

    def update(self, points: Floats, decrease: float, continuation: Continuation) -> None:
        """Take note of a step, of its relative decrease and of the continuation from then on."""
        self.late = self.late or (continuation.complete and decrease < self._schedule.late_decrease)
        if self.late and isinstance(self._energy, Barrier):
            self._energy.cap = continuation.cap
            own_value = self._energy.value_at_own_normals(points)
            decrease = max(decrease, 1 - own_value / max(self._own_value, _TINY))
            self._own_value = own_value
            self._since_lowest += 1
            if own_value < (1 - 0.5 * self._schedule.stalled_energy * self._tolerance) * self._lowest:
                self._lowest, self._since_lowest = own_value, 0
        slow = decrease < self._tolerance and continuation.complete
        self._slow_steps = self._slow_steps + 1 if slow else 0
