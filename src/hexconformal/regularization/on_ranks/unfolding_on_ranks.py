"""Unfold a mesh that is shared out: rank 0 gets what is folded with what is around it, and does what one process does.

That is all of a small mesh. Of a larger one it gets the cells at kept faces, which features are found on, and some
rings of cells around folded ones; nodes that have cells elsewhere are held.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...common import OptionError, agreed
from ...formulation import Iteration
from ...mesh import node_rings
from ...ranks import GatheredFaces, NormalizedPiece
from ...solver import AdmissibleDirections, fixed_components
from ..boundary import Boundary, boundary_of
from ..setting import Setting
from ..unfolding import Unfolded, hold_folded, unfold
from .boundary_on_ranks import BoundaryOnRanks

__all__ = ["require_room", "unfold_on_ranks"]

Mask = NDArray[np.bool_]
Steps = Generator[Iteration, None, tuple[Unfolded, Unfolded]]


def require_room(setting: Setting, normalized: NormalizedPiece) -> None:
    """Raise an OptionError where one rank would get more cells than it may."""
    schedule, space = setting.schedules.unfolding, normalized.space
    some = _around_folded(setting, normalized) | normalized.cells_at_faces()
    count = int(space.total(some.sum()))
    with agreed(space.halo.comm):
        if space.total(len(normalized.cells)) > schedule.whole and count > schedule.gathered:
            raise OptionError(
                f"runs on ranks unfold cells on one of them, which may get {schedule.gathered} cells, not the {count} "
                "at kept faces and around folded ones: run without comm, or take energy='quaternionic', which "
                "leaves them as they are"
            )


def unfold_on_ranks(setting: Setting, normalized: NormalizedPiece, boundary: Boundary) -> Steps:
    """Unfold what is folded, and hold what stays so; yields iterations.

    Returns what it came to, with all cells, and without those that stay folded.
    """
    space, comm = normalized.space, normalized.space.halo.comm
    chosen = np.ones(len(normalized.cells), dtype=bool)
    if space.total(len(chosen)) > setting.schedules.unfolding.whole:
        chosen = _around_folded(setting, normalized)
    gathered = GatheredFaces.of(normalized, chosen)
    cells, layer = gathered.cells, gathered.layer
    elsewhere = np.zeros(len(normalized.points), dtype=bool)
    elsewhere[normalized.cells[~cells.chosen]] = True
    beyond = cells.of_nodes(space.joined(elsewhere))
    fixed = cells.of_nodes(fixed_components(normalized.mesh, setting.options.fixed))
    first, last, steps = cells.of_nodes(setting.first), None, _nothing()
    with agreed(comm, named=False):
        if layer is not None:
            options = replace(setting.options, fixed=fixed | beyond[:, None])
            one = Setting(layer, options, setting.schedules, None if setting.start is None else first)
            last, steps = one.first, _unfolded(one, boundary_of(layer, options, setting.schedules))
    points, outcome = setting.first, None
    while True:
        iteration = None
        with agreed(comm, named=False):
            try:
                iteration = next(steps)
            except StopIteration as end:
                outcome = end.value
        moved = None if iteration is None else iteration.points
        phase, changed = comm.bcast((None if iteration is None else iteration.phase, moved is not last))
        if phase is None:
            break
        points, last = (cells.spread(moved, points) if changed else points), moved
        yield Iteration(phase, points)
    found, other = (None, False) if outcome is None else outcome
    if comm.bcast(other):
        whole = None if found is None else found.boundary
        boundary = _spread(whole, gathered, beyond, boundary, normalized)
    points = cells.spread(None if found is None else found.points, points)
    bad = cells.spread_to_cells(None if found is None else found.bad, np.zeros(len(chosen), dtype=bool))
    notes = comm.bcast(None if found is None else found.notes)
    formulation = setting.formulation(boundary)
    every = Unfolded(boundary, formulation, points, bad, notes)
    return every, replace(
        every, formulation=formulation.without(bad) if space.anywhere(bool(bad.any())) else formulation
    )


_OnOneRank = Generator[Iteration, None, tuple[Unfolded, bool] | None]


def _nothing() -> _OnOneRank:
    yield from ()
    return None


def _unfolded(setting: Setting, boundary: Boundary) -> _OnOneRank:
    """Unfold in one process, and hold what stays folded; True where that took another boundary."""
    found = yield from unfold(setting, boundary)
    if found.bad.any():
        found = hold_folded(setting, found)
        yield Iteration("hold what stays inverted", found.points)
    return found, found.boundary is not boundary


def _around_folded(setting: Setting, normalized: NormalizedPiece) -> Mask:
    """(m,) cells that one rank needs to unfold what is folded: as many rings as are tried, and one that stays."""
    bad = ~setting.valid | setting.flat(setting.first)
    width = setting.schedules.untangling.rounds + 1
    nodes = node_rings(normalized.cells, len(normalized.points), bad, width, normalized.space)
    return np.asarray(nodes[normalized.cells].any(axis=1))


def _spread(
    whole: Boundary | None, gathered: GatheredFaces, beyond: Mask, before: Boundary, normalized: NormalizedPiece
) -> Boundary:
    """What each rank has of a boundary of cells that came to rank 0, where some nodes were held by the way."""
    cells, count = gathered.cells, len(normalized.points)
    projectors = before.admissible.all_projectors(count)
    rows = cells.of_nodes(projectors)
    if whole is not None:
        rows = np.where(beyond[:, None, None], rows, whole.admissible.all_projectors(len(rows)))
    projectors = cells.spread(rows if cells.is_here else None, projectors)
    nodes = np.flatnonzero((projectors != np.eye(3)).any(axis=(1, 2)))
    return BoundaryOnRanks.spread(whole, AdmissibleDirections(nodes, projectors[nodes]), gathered, normalized)
