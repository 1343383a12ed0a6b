"""Work on a patch of a mesh that is shared out: rank 0 gets the patch and does it, all get what comes of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import agreed
from ..mesh import SERIAL, Space
from ..ranks import GatheredCells, RankSpace
from ..solver import AdmissibleDirections
from .barrier_on_ranks import BarrierOnRanks
from .formulation import Formulation
from .iteration import Iteration
from .work import Work

__all__ = ["on_one_rank", "steps_on_one_rank"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]


def on_one_rank(
    formulation: Formulation, points: Field, region: Mask, work: Callable[[Formulation, Field, Mask], Field]
) -> Field:
    """Points (n, 3) after work on the nodes (n,) of a region; themselves where nothing comes of it.

    See :func:`steps_on_one_rank`; the work makes new points.
    """

    def once(whole: Formulation, points: Field, region: Mask) -> Iterator[Iteration]:
        yield Iteration("patch", work(whole, points, region))

    for iteration in steps_on_one_rank(formulation, points, region, once):
        points = iteration.points
    return points


def steps_on_one_rank(
    formulation: Formulation,
    points: Field,
    region: Mask,
    work: Callable[[Formulation, Field, Mask], Iterator[Iteration]],
) -> Iterator[Iteration]:
    """Work on the nodes (n,) of a region in one process; all ranks get its iterations.

    Parameters
    ----------
    formulation, points
        Of all cells, on each rank its own.
    region
        Nodes that may move, the same for owners and copies.
    work
        What makes iterations of a formulation, points and nodes that may move, in one process.
    """
    space, near = formulation.space, np.asarray(region[formulation.cells].any(axis=1))
    if not space.anywhere(bool(near.any())):
        return
    cells = GatheredCells.of(_of_ranks(space), formulation.cells, near)
    comm, barrier = cells.space.halo.comm, formulation.barrier
    start, inside, projectors = (cells.of_nodes(field) for field in (points, region, formulation.projectors))
    if isinstance(barrier, BarrierOnRanks):
        barrier = barrier.on_one_rank(cells, points, region)
    known = _values_of_cells(formulation)
    of_cells = {name: cells.of_cells(values) for name, values in known.items() if _is_there(values, space)}
    steps: Iterator[Iteration] = iter(())
    if cells.is_here:
        # What is beyond the region has other cells, too.
        projectors[~inside] = 0.0
        whole = _gathered(replace(formulation, barrier=barrier), cells, of_cells, projectors)
        steps = work(whole, start, inside)
    last: Field | None = start if cells.is_here else None
    while True:
        found = None
        with agreed(comm, named=False):
            found = next(steps, None)
        _tell_work(formulation.work, comm)
        moved = None if found is None else found.points
        told, changed = comm.bcast((None if found is None else replace(found, points=start[:0]), moved is not last))
        if told is None:
            return
        points, last = (cells.spread(moved, points) if changed else points), moved
        yield replace(told, points=points)


def _of_ranks(space: Space) -> RankSpace:
    if not isinstance(space, RankSpace):
        raise TypeError("work on one rank is for meshes that are shared out")
    return space


def _values_of_cells(formulation: Formulation) -> dict[str, Field]:
    """What a formulation has for each cell, or has not, or has for all of them."""
    names = ("inverses", "target_volumes", "scales", "slender", "least", "attainable")
    return {name: getattr(formulation, name) for name in names}


def _is_there(values: Field, space: Space) -> bool:
    """True where ranks have a value for each cell, which one with a single cell or none cannot tell by itself."""
    return space.anywhere(len(values) > 1)


def _gathered(
    formulation: Formulation, cells: GatheredCells, of_cells: dict[str, Any], projectors: Field
) -> Formulation:
    constrained = np.flatnonzero((projectors != np.eye(3)).any(axis=(1, 2)))
    return replace(
        formulation,
        cells=cells.cells,
        count=cells.count,
        admissible=AdmissibleDirections(constrained, projectors[constrained]),
        space=SERIAL,
        **of_cells,
    )


def _tell_work(work: Work, comm: Any) -> None:
    """All ranks have as much work left as rank 0."""
    part: Work | None = work
    while part is not None:
        part.left = comm.bcast(part.left)
        part = part.whole
