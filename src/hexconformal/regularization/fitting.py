"""Put the skin of a mesh where it belongs on another surface, and unfold what that folds."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..elements import is_valid
from ..formulation import Formulation, Iteration, UntanglingSchedule
from ..mesh import node_rings
from ..untangling import folded_cells, harmonic, untangle, untangle_interior
from .boundary import Boundary, boundary_of
from .setting import Setting
from .unfolding import Unfolded, unfold

__all__ = ["fit"]

Field = NDArray[np.float64]


def fit(setting: Setting, boundary: Boundary) -> Generator[Iteration, None, Unfolded]:
    """Unfold a mesh whose skin has been put where it belongs; yields iterations, and returns what it came to.

    Where some cells resist, the mesh is unfolded without that, too, and what leaves fewer of them folded is taken.
    """
    normalized, options = setting.normalized, setting.options
    formulation = setting.formulation(boundary)
    best, fewest = normalized.points, np.inf
    for start, schedule in _starts(formulation, normalized.points if boundary.start is None else boundary.start):
        points = start
        otherwise = replace(formulation, schedules=replace(setting.schedules, untangling=schedule))
        for iteration in untangle(
            otherwise.within(setting.schedules.work.unfolding), points, setting.schedules.fitting.patience
        ):
            points = iteration.points
            yield iteration
        points = untangle_interior(formulation, points)
        yield Iteration("fit to the surface", points)
        bad = ~is_valid(points, normalized.cells)
        if bad.sum() < fewest:
            best, fewest = points, float(bad.sum())
        if fewest == 0:
            return Unfolded(boundary, formulation, best, bad)
    what = f"with the features of the surface {fewest:.0f} cells stay folded"
    other = boundary_of(normalized, options, setting.schedules, matches=False)
    none = np.zeros(len(normalized.cells), dtype=bool)
    alone = Unfolded(other, setting.formulation(other), normalized.points, none)
    if options.energy == "barrier" and setting.is_tangled:
        alone = yield from unfold(setting, other)
    if alone.bad.sum() < fewest:
        return replace(alone, notes=(*alone.notes, f"{what}: the skin is drawn to the surface alone"))
    return Unfolded(boundary, formulation, best, folded_cells(formulation, best), (what,))


def _starts(formulation: Formulation, points: Field) -> Iterator[tuple[Field, UntanglingSchedule]]:
    """Where to begin, and how: in patches, first from where the points are if few cells are folded; all at once."""
    whole = formulation.schedules.untangling
    in_patches = replace(whole, many_folded=1.0)
    share = float(folded_cells(formulation, points).mean())
    if share <= formulation.schedules.fitting.few_folded:
        yield points, in_patches
    if share > 0.0:
        points = _least_folded(formulation, points)
        yield points, in_patches
        yield points, whole


def _least_folded(formulation: Formulation, points: Field) -> Field:
    """The points, with inner nodes around what is folded, or everywhere, at the mean of their neighbours if that helps.

    The skin is where it belongs: what is inside has to follow it, wherever it was.
    """
    best, bad, everywhere = points, folded_cells(formulation, points), np.ones(len(points), dtype=bool)
    if bad.any():
        smooth = harmonic(formulation, points, everywhere)
        for points in (points, smooth):
            folded = folded_cells(formulation, points)
            for _ in range(formulation.schedules.untangling.rounds):
                if folded.sum() < bad.sum():
                    best, bad = points, folded
                points = harmonic(formulation, points, node_rings(formulation.cells, len(points), folded, 0))
                folded = folded_cells(formulation, points)
    return best
