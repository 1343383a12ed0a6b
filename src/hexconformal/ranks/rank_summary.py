"""The quality of a mesh that is shared out, in a few numbers of all ranks."""

from __future__ import annotations

import numpy as np

from ..quality import MEASURES, Quality, Summary, WorstCell, distributions
from .rank_space import RankSpace

__all__ = ["rank_summary"]


def rank_summary(measured: Quality, space: RankSpace, worst: int = 5) -> Summary:
    """Reduce the measures of the own cells of all ranks to a few numbers, the same on each; all must call it.

    Parameters
    ----------
    measured
        Measures of the own cells.
    space
        The space of the mesh.
    worst
        How many of the worst cells to name.
    """
    named = measured.summary(worst).worst if len(measured.valid) else ()
    every = [cell for cells in space.halo.comm.allgather(named) for cell in cells]
    first: list[WorstCell] = sorted(every, key=lambda cell: cell.scaled_jacobian)[: max(worst, 0)]
    inverted, valid = measured.scaled_jacobian <= 0, measured.valid
    own = len(valid), inverted.sum(), (~valid).sum(), measured.volume.sum()
    count, folded, invalid, volume = space.totals(np.array(own, dtype=np.float64)).tolist()
    measures = distributions(np.array([getattr(measured, name) for name in MEASURES]), space)
    return Summary(
        count=int(count),
        inverted=int(folded),
        invalid=int(invalid),
        total_volume=volume,
        **dict(zip(MEASURES, measures, strict=True)),
        worst=tuple(first),
    )
