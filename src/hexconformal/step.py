"""What every stage of a run yields."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Step"]


@dataclass(frozen=True)
class Step:
    """An accepted mesh: points in the run's frame, energy of the phase, relative gradient, length of the step.

    Where the energy of a phase has no gradient worth telling, it is NaN.
    """

    phase: str
    points: NDArray[np.float64]
    energy: float = float("nan")
    gradient: float = float("nan")
    length: float = 1.0
