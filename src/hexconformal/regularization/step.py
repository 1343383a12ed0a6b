"""What every stage of a run yields."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Step"]


@dataclass(frozen=True)
class Step:
    """An accepted mesh: points in the run's frame, summed distortion, its relative gradient, length of the step.

    Distortion and gradient are NaN where a phase does not know them.
    """

    phase: str
    points: NDArray[np.float64]
    energy: float = float("nan")
    gradient: float = float("nan")
    length: float = 1.0
