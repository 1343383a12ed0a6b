"""The tuned numbers of mesh motion."""

from __future__ import annotations

from dataclasses import dataclass

from ..common import Schedule, tuned

__all__ = ["MotionSchedule"]


@dataclass(frozen=True)
class MotionSchedule(Schedule):
    """A step of a moving mesh.

    Attributes
    ----------
    least_share
        Of a step, below which it is given up.
    substep_tolerance
        Of the energy, in a substep that is not the last.
    iterations
        In a substep, at most.
    linear_tolerance, guess_tolerance
        Of the equation of a linear operator, and of that for a first guess.
    """

    least_share: float = tuned(2.0**-10, 0.0, 1.0)
    substep_tolerance: float = tuned(1e-3, 0.0, 1.0)
    iterations: int = tuned(500)
    linear_tolerance: float = tuned(1e-9, 0.0, 1.0)
    guess_tolerance: float = tuned(1e-3, 0.0, 1.0)
