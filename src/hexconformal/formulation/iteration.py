"""One iteration of a run: the accepted mesh that a stage yields."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Iteration"]


@dataclass(frozen=True)
class Iteration:
    """An accepted mesh: normalized points, summed distortion, its relative gradient, length of the step.

    Distortion and gradient are NaN where a phase does not know them.
    """

    phase: str
    points: NDArray[np.float64]
    energy: float = float("nan")
    gradient: float = float("nan")
    step: float = 1.0
