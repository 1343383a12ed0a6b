"""Histograms of measures over all cells of a mesh, and their figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .contents import Measure
from .schedule import PageSchedule

__all__ = ["histogram_of"]

Floats = NDArray[np.float64]


def histogram_of(measure: Measure, groups: Sequence[Floats], schedule: PageSchedule) -> dict[str, Any] | None:
    """The histogram of a measure before and after (once if there is one group), None where it has no finite value.

    Values that are not finite count in the last bin, those that are NaN in none.

    Examples
    --------
    >>> found = histogram_of(Measure("shape", "shape", "high"), [np.array([0.5, 1.0, 1.0])], PageSchedule(bins=2))
    >>> found["edges"], found["after"], found["figures"]["after"]
    ([0.5, 0.75, 1.0], [1, 2], {'min': 0.5, 'mean': 0.8333333333333334, 'max': 1.0})
    """
    present = [np.asarray(values)[~np.isnan(values)] for values in (groups[0], groups[-1])]
    together = np.concatenate(present)
    finite = together[np.isfinite(together)]
    if len(finite) == 0:
        return None
    low, high = float(finite.min()), float(finite.max())
    if high - low <= 1e-12 * max(abs(low), abs(high)):
        low, high = low - max(abs(low), 1.0) * 0.05, high + max(abs(high), 1.0) * 0.05
    logarithmic = measure.is_ratio and low > 0.0 and high / low >= schedule.logarithmic_from
    edges = (np.geomspace if logarithmic else np.linspace)(low, high, schedule.bins + 1)
    counts = [np.histogram(np.clip(values, edges[0], edges[-1]), edges)[0].tolist() for values in present]
    figures = [{"min": float(v.min()), "mean": float(v.mean()), "max": float(v.max())} for v in present if len(v)]
    return {
        "name": measure.name,
        "title": measure.title,
        "best": measure.best,
        "range": list(measure.range),
        "folded_at_zero": measure.folded_at_zero,
        "scale": "log" if logarithmic else "linear",
        "edges": edges.tolist(),
        "before": counts[0],
        "after": counts[1],
        "figures": {"before": figures[0], "after": figures[-1]},
    }
