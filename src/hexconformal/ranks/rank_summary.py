"""The quality of a mesh that is shared out, in a few numbers of all ranks."""

from __future__ import annotations

from ..quality import MEASURES, Quality, Summary, WorstCell, statistics
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
    return Summary(
        count=int(space.total(len(measured.valid))),
        inverted=int(space.total((measured.scaled_jacobian <= 0).sum())),
        invalid=int(space.total((~measured.valid).sum())),
        total_volume=space.total(measured.volume.sum()),
        **{name: statistics(getattr(measured, name), space) for name in MEASURES},
        worst=tuple(first),
    )
