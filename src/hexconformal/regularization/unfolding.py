"""Unfold what is folded: as the boundary is kept, with more room for a while, or with other features; hold the rest."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..common import first_ids
from ..elements import is_valid, rows_by_type
from ..formulation import Formulation, Iteration
from ..geometry import DistanceBarrier
from ..quality import inside_out, nodes_without_room
from ..untangling import folded_cells, pull_back, untangle, untangle_interior
from .acceptance import boundary_distance, room_notes
from .boundary import Boundary, boundary_of
from .return_to_surface import return_to_surface
from .setting import Setting

__all__ = ["Unfolded", "hold_folded", "unfold", "within_bound"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Unfolded:
    """What unfolding comes to.

    Attributes
    ----------
    boundary, formulation
        The boundary it was done with, and the formulation.
    points
        (n, 3) points.
    bad
        (m,) cells that stay folded.
    notes
        Decisions, in words.
    sufficient
        Distance of the boundary, as `hausdorff`, with which all were unfolded; infinite if there was none.
    back
        (n, 3) the points with what has become worse, or left the bound, taken back; None where that is not known yet.
    """

    boundary: Boundary
    formulation: Formulation
    points: Field
    bad: Mask
    notes: tuple[str, ...] = ()
    sufficient: float = np.inf
    back: Field | None = None

    def at(self, points: Field) -> Unfolded:
        """The same at other points."""
        return replace(self, points=points, bad=folded_cells(self.formulation, points), back=None)


Steps = Generator[Iteration, None, Unfolded]


def unfold(setting: Setting, boundary: Boundary) -> Steps:
    """Unfold what is folded; yields iterations, and returns what it came to."""
    normalized, formulation = setting.normalized, setting.formulation(boundary)
    slides = setting.options.boundary == "slide" and setting.options.hausdorff > 0.0 and boundary.reference is None
    others = ("keep", "soft") if slides and setting.options.features == "auto" else ()
    points, work = setting.first, setting.schedules.work
    patience = setting.schedules.unfolding.patience if others and boundary.barrier is not None else None
    for iteration in untangle(formulation.within(work.unfolding), points, patience):
        points = iteration.points
        yield iteration
    found = Unfolded(boundary, formulation, points, folded_cells(formulation, points))
    if boundary.barrier is not None and boundary.barrier.reference is None:
        for bound in (share * normalized.diagonal for share in setting.schedules.unfolding.wider_bounds):
            # Where all could be unfolded, and not brought back, still more room is of no use, nor where they never can.
            may_do = found.bad.any() and not formulation.impossible.any()
            if may_do and boundary.barrier.bound < bound and found.sufficient == np.inf:
                found = yield from _with_wider_bound(setting, found, boundary.barrier, bound)
    left = _left_folded(setting, found) if others else 0
    for features in others[: setting.schedules.unfolding.other_features]:
        if left == 0 or (found.bad.any() and formulation.impossible[found.bad].all()):
            break
        # What stands in the way may be a feature that is none, or a crease that was not taken for one.
        other = boundary_of(normalized, replace(setting.options, features=features), setting.schedules)
        formulation = setting.formulation(other)
        for iteration in untangle(formulation.within(work.again), setting.first, patience):
            points = iteration.points
            yield iteration
        notes = (*found.notes, f"features={features!r} instead, which left fewer cells folded")
        bad = folded_cells(formulation, points)
        instead = Unfolded(other, formulation, points, bad, notes, found.sufficient)
        if (fewer := _left_folded(setting, instead)) < left:
            found, left = instead, fewer
    found = found.at(untangle_interior(found.formulation, found.points))
    yield Iteration("untangle interior", found.points)
    if slides and found.bad.any():
        found = yield from _or_with_boundary_held(setting, found)
    lost = setting.valid & ~is_valid(found.points, normalized.cells)
    if lost.any() and not found.bad.any():
        found = found.at(_pulled_back(setting, found))
    return found


def _left_folded(setting: Setting, found: Unfolded) -> int:
    """How many cells stay folded: all that were, if nodes that slide in planes alone leave the outline too far behind.

    A barrier brings the boundary back later.
    """
    normalized, options, boundary = setting.normalized, setting.options, found.boundary
    if boundary.barrier is None and boundary_distance(found.points, normalized, boundary, "slide") > options.hausdorff:
        return int((~setting.valid).sum())
    return int(found.bad.sum())


def _with_wider_bound(setting: Setting, found: Unfolded, barrier: DistanceBarrier, bound: float) -> Steps:
    """Unfold with more room for the boundary, then bring it back while every cell stays unfolded."""
    wide = setting.formulation(replace(found.boundary, barrier=replace(barrier, bound=bound)))
    afar, first, patience = found.points, setting.first, setting.schedules.unfolding.patience
    for iteration in untangle(wide.within(setting.schedules.work.again), afar, patience, first):
        afar = iteration.points
        yield Iteration("untangle with more room", found.points)
    if folded_cells(wide, afar).any():
        return found
    closer = wide.with_barrier(replace(barrier, steepness=setting.schedules.unfolding.return_steepness))
    for back in return_to_surface(closer, afar, keeps_worst=False):
        afar, closer = back
        yield Iteration("return to the surface", found.points)
    if closer.barrier is not None and closer.barrier.farthest(afar) <= 1.0:
        boundary = replace(found.boundary, barrier=closer.barrier)
        return replace(found, boundary=boundary, formulation=closer).at(afar)
    needed = barrier.farthest(afar) * setting.options.hausdorff
    return replace(found, sufficient=min(found.sufficient, needed))


def _or_with_boundary_held(setting: Setting, found: Unfolded) -> Steps:
    """The same, or with the boundary held where that leaves less folded in the end.

    A boundary that has to be brought back folds again what is behind it.
    """
    normalized, formulation = setting.normalized, found.formulation
    back = _pulled_back(setting, found)
    found, left = replace(found, back=back), int(folded_cells(formulation, back).sum())
    if left == found.bad.sum():
        return found
    held = setting.formulation(boundary_of(normalized, replace(setting.options, boundary="fixed"), setting.schedules))
    points = setting.first
    for iteration in untangle(held.within(setting.schedules.work.again), points):
        points = iteration.points
        yield Iteration("untangle with boundary held", found.points)
    instead = found.at(untangle_interior(held, points))
    back = _pulled_back(setting, instead)
    return replace(instead, back=back) if folded_cells(formulation, back).sum() < left else found


def hold_folded(setting: Setting, found: Unfolded) -> Unfolded:
    """What is left without the cells that stay folded: these are held, the worst no worse than it was."""
    normalized, formulation, mesh = setting.normalized, found.formulation, setting.normalized.mesh
    cells = np.flatnonzero(found.bad)
    held = ~formulation.free[formulation.cells[cells]]
    why = "all their nodes are held" if held.all() else "no way was found to unfold them as the boundary is kept"
    if formulation.impossible[cells].all():
        why = "cells that are connected as they are cannot all be valid"
    notes = [
        *found.notes,
        f"cells that stay folded: {first_ids(setting.ids(found.bad), mesh.cell_labels)}; {why}",
    ]
    quads = normalized.quads
    near = np.flatnonzero(np.isin(quads, formulation.cells[cells]).any(axis=1))
    turned = inside_out(found.points, quads, near)
    if len(turned):
        nodes = np.unique(normalized.node_ids[quads[turned]])
        ids = first_ids(nodes, mesh.node_labels)
        notes.append(f"the surface is turned inside out at nodes {ids}: no valid mesh has it")
    blocks = ((one.cell_type, one.own_nodes(normalized.cells)) for one in rows_by_type(normalized.cells))
    turned_over = nodes_without_room(found.points, blocks, ~formulation.free)
    notes += room_notes(np.sort(normalized.node_ids[turned_over]), mesh.node_labels)
    inner = found.boundary.inner
    if inner is not None and (touching := np.isin(formulation.cells[cells], inner.quads).any(axis=1)).any():
        notes.append(f"{touching.sum()} of them are at faces inside that are kept: interfaces='ignore' lets these go")
    if np.isfinite(found.sufficient):
        away = f"up to {found.sufficient:.2g} diagonals away"
        notes.append(f"with the boundary {away} all cells were unfolded: allow more (hausdorff)")
    points = _pulled_back(setting, found) if found.back is None else found.back
    bad = folded_cells(formulation, points)
    others = bad & ~found.bad
    if others.any():
        ids = first_ids(setting.ids(others), mesh.cell_labels)
        notes.append(
            f"others around them stay inverted, so that no valid cell is lost and the worst is no worse: {ids}"
        )
    return replace(found, formulation=formulation.without(bad), points=points, bad=bad, notes=tuple(notes))


def _pulled_back(setting: Setting, found: Unfolded) -> Field:
    normalized, barrier = setting.normalized, found.boundary.barrier

    def beyond(points: Field) -> Mask:
        if barrier is None or barrier.reference is not None:
            return np.zeros(len(points), dtype=bool)
        return barrier.nodes_beyond(points)

    coupled = found.boundary.admissible.coupled
    return pull_back(found.points, setting.first, normalized.cells, beyond, setting.schedules.untangling, coupled)


def within_bound(barrier: DistanceBarrier | None, points: Field) -> bool:
    """True where the boundary is within its bound; with another surface to slide on that is told, not required."""
    return barrier is None or barrier.reference is not None or not barrier.exceeded(points)
