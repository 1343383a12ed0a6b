"""What comes of a step of a moving mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["MotionReport", "MotionStep"]

Field = NDArray[np.float64]


@dataclass(frozen=True)
class MotionReport:
    """Report of a step.

    Attributes
    ----------
    reached
        Share of the step that was made, 1 unless it was refused.
    substeps, iterations
        Work done.
    min_scaled_jacobian, mean_scaled_jacobian
        Of the corners of the cells, after the step.
    types
        Smallest scaled Jacobian of each type of cells, by its name.
    blocked
        Cells that would be inverted by going on; empty unless the step was refused.
    reason
        Reason of a refusal, in words; "" otherwise.
    seconds
        Wall time.
    """

    reached: float
    substeps: int
    iterations: int
    min_scaled_jacobian: float
    mean_scaled_jacobian: float
    types: dict[str, float]
    blocked: NDArray[np.int64]
    reason: str
    seconds: float

    @property
    def refused(self) -> bool:
        """True where the boundary could not go all the way."""
        return self.reached < 1.0


@dataclass(frozen=True)
class MotionStep:
    """A mesh that has moved.

    Attributes
    ----------
    points
        (n, 3) all of them, in their old order.
    velocity
        (n, 3) displacement of this step over its time, equation (28); None where no time was given.
    report
        Share of the step that was made, quality, and why it was refused.
    """

    points: Field
    velocity: Field | None
    report: MotionReport
