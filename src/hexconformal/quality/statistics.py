"""Statistics of measures over the cells of a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mesh import SERIAL, Space

__all__ = ["Statistics", "as_table", "distributions", "statistics"]

_PERCENTILES = (1, 5, 25, 50, 75, 95, 99)


@dataclass(frozen=True)
class Statistics:
    """Distribution of one measure; ``percentiles`` maps 1, 5, 25, 50, 75, 95, 99 to a value of some cell."""

    min: float
    mean: float
    max: float
    percentiles: dict[int, float]


def statistics(values: NDArray[np.float64]) -> Statistics:
    """The distribution of a measure."""
    return distributions(values[None])[0]


def distributions(measures: NDArray[np.float64], space: Space = SERIAL) -> list[Statistics]:
    """The distributions of some measures (k, m), over the cells of all parts."""
    lowest, below = measures.min(axis=1, initial=np.inf), (-measures).min(axis=1, initial=np.inf)
    smallest, largest = np.split(space.least(np.concatenate([lowest, below])), 2)
    rows = zip(smallest, space.means(measures), -largest, space.percentiles(measures, _PERCENTILES), strict=True)
    return [
        Statistics(float(low), float(mean), float(high), dict(zip(_PERCENTILES, places.tolist(), strict=True)))
        for low, mean, high, places in rows
    ]


def as_table(distributions: Mapping[str, Statistics]) -> list[str]:
    """Lines of a table, a row for each measure.

    Examples
    --------
    >>> for line in as_table({"edge_ratio": statistics(np.array([1.0, 2.0, 6.0]))}):
    ...     print(line)
                                  min        5 %     median       mean       95 %        max
    edge ratio                      1          1          2          3          6          6
    """
    lines = [f"{'':22s}{'min':>11s}{'5 %':>11s}{'median':>11s}{'mean':>11s}{'95 %':>11s}{'max':>11s}"]
    for name, s in distributions.items():
        row = (s.min, s.percentiles[5], s.percentiles[50], s.mean, s.percentiles[95], s.max)
        lines.append(f"{name.replace('_', ' '):22s}" + "".join(f"{value:11.4g}" for value in row))
    return lines
