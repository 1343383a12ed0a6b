"""Work on a patch of a mesh that is shared out: rank 0 gets the patch and does it, all get what comes of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh import SERIAL
from ..ranks import GatheredCells, RankSpace, agreed
from ..solver import AdmissibleDirections
from .formulation import Formulation
from .work import Work

__all__ = ["on_one_rank"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]


def on_one_rank(
    formulation: Formulation,
    space: RankSpace,
    points: Field,
    region: Mask,
    work: Callable[[Formulation, Field, Mask], Field],
) -> Field:
    """Points (n, 3) after work on the nodes (n,) of a region; themselves where there are none.

    Parameters
    ----------
    formulation, space, points
        Of all cells, on each rank its own.
    region
        Nodes that move, the same for owners and copies.
    work
        What makes new points of a formulation, points and nodes that move, in one process.
    """
    near = np.asarray(region[formulation.cells].any(axis=1))
    if not space.anywhere(bool(near.any())):
        return points
    cells, comm = GatheredCells.of(space, formulation.cells, near), space.halo.comm
    at_nodes = [cells.of_nodes(field) for field in (points, region, formulation.projectors)]
    known = _values_of_cells(formulation)
    of_cells = {name: cells.of_cells(values) for name, values in known.items() if _is_there(values, space)}
    moved = None
    with agreed(comm, named=False):
        if cells.is_here:
            whole = _gathered(formulation, cells, of_cells, at_nodes[2])
            moved = work(whole, at_nodes[0], at_nodes[1])
    _tell_work(formulation.work, comm)
    changed = comm.bcast(moved is not None and moved is not at_nodes[0])
    return cells.spread(moved, points) if changed else points


def _values_of_cells(formulation: Formulation) -> dict[str, Field]:
    """What a formulation has for each cell, or has not, or has for all of them."""
    names = ("inverses", "target_volumes", "scales", "slender", "least")
    return {name: getattr(formulation, name) for name in names}


def _is_there(values: Field, space: RankSpace) -> bool:
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
