"""Unfold a tangled mesh: the barrier with a regularized determinant, eps driven to zero.

chi_eps(det) is positive however negative det is, so E / chi_eps^(2/3) can be minimized from a folded mesh, and
the smaller eps, the more folded corners cost. eps follows the smallest determinant and the progress made
(Garanzha et al. 2021), equation (9) of docs/mathematics.md. Whole meshes are unfolded only where many cells are
folded; what remains is unfolded patch by patch, from several starts.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..elements import edge_lengths, is_valid
from ..energy import CornerMeasures, CornerWeights
from ..formulation import Formulation, Iteration
from ..mesh import connected_regions, node_rings
from ..solver import Equation, newton_step
from .harmonic import harmonic

__all__ = ["folded_cells", "untangle"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_OPEN = (0, 0, 0.0)  # tangledness of a mesh with no cell that is folded or flat


def folded_cells(formulation: Formulation, points: Field) -> Mask:
    """(m,) cells with a corner whose determinant is not positive."""
    return np.asarray(formulation.measures(points).determinant <= 0.0)


def _tangled(formulation: Formulation, measures: CornerMeasures) -> Mask:
    """(m,) cells with a corner that is folded, or as good as flat: to open it takes the same."""
    return formulation.schedules.untangling.are_flat(measures.fullness)


def untangle(
    formulation: Formulation, points: Field, patience: int | None = None, first: Field | None = None
) -> Iterator[Iteration]:
    """Unfold the corners of all cells as far as possible, and open those that are flat.

    Ends when there is none, when so many rounds of patches in a row have left as many as before (default: as many
    as the schedule has), or when the formulation's work is done. Where the mesh was at first (default: where it is) is
    another place to start from.
    """
    schedule = formulation.schedules.untangling
    measures, stalled = formulation.measures(points), 0
    bad, first = _tangled(formulation, measures), points if first is None else first
    if bad.mean() > schedule.many_folded:
        # What is hardly folded opens where it is: harmonic positions may fold it.
        if measures.fullness.min() < -schedule.hardly_folded:
            points = harmonic(formulation, points, node_rings(formulation.cells, len(points), bad, 0))
            yield Iteration("harmonic start", points)
        for points in _unfold(formulation, points, 1.0, schedule.whole_steps):
            yield Iteration("untangle", points)
    # Patches let the surface go, as far as its bound: the way out may lead away from it.
    if formulation.barrier is not None:
        formulation = formulation.with_barrier(formulation.barrier.loosened(schedule.attraction))
    left = 0
    # The folded cells alone first: larger patches reach the same only past more ways to go wrong.
    for width in range(schedule.rounds):
        before = _tangledness(formulation, points)
        if before == _OPEN or stalled == patience or formulation.work.is_done:
            return
        bad = _tangled(formulation, formulation.measures(points))
        # What cannot all be valid is tried as long as that leaves fewer; rounding tells which of the flat are folded.
        if formulation.impossible[bad].all() and bad.sum() == left:
            return
        left = bad.sum()
        regions = connected_regions(formulation.cells, node_rings(formulation.cells, len(points), bad, width))
        points = _as_large(formulation, _unfold_patches(formulation.seen_from(points), points, first, regions), points)
        yield Iteration("untangle patches", points)
        stalled = 0 if _tangledness(formulation, points)[:2] < before[:2] else stalled + 1


def _unfold(formulation: Formulation, points: Field, first_eps: float, steps: int) -> Iterator[Field]:
    """Newton steps at a falling eps until no corner is folded or flat, it is stuck, or the steps are used up."""
    schedule, eps, last = formulation.schedules.untangling, 0.0, (1.0, 1.0)
    equation: Equation = formulation.equation
    for count in range(steps):
        measures = formulation.measures(points)
        if not _tangled(formulation, measures).any():
            return
        smallest = float(measures.determinant.min())
        if not formulation.work.take(len(formulation.cells)):
            return
        if count:
            eps = _next_eps(eps, smallest, last, schedule.least_sigma)
        else:
            eps = max(_least_eps(smallest), -first_eps * smallest)
        if count > 8 and eps < -schedule.stuck * smallest:
            return
        problem = formulation.problem(formulation.objective(CornerWeights(eps=eps)))
        after, equation = newton_step(problem.start(points), equation)
        if after.step == 0.0:
            return
        last = after.energy + after.decrease, after.energy
        points = _as_large(formulation, after.points, points)
        yield points


def _as_large(formulation: Formulation, points: Field, before: Field) -> Field:
    """The points, where at most one node is held scaled about it, or their middle, to the edges there were before.

    Where determinants are below eps the energy falls with the size alone: the mesh would shrink to a point.
    """
    held = formulation.admissible.nodes
    if formulation.barrier is not None or len(held) > 1 or len(formulation.admissible.coupled.nodes):
        return points
    cells, nodes = formulation.cells, np.unique(formulation.cells)
    now, middle = edge_lengths(points, cells).mean(), points[held if len(held) else nodes].mean(axis=0)
    scaled = points.copy()
    scaled[nodes] = middle + edge_lengths(before, cells).mean() / now * (points[nodes] - middle)
    return scaled


def _least_eps(smallest: float) -> float:
    return float(np.sqrt(1e-8 + 0.04 * smallest**2))


def _next_eps(eps: float, smallest: float, last: tuple[float, float], least_sigma: float) -> float:
    """Equation (9), Garanzha et al. (2021): as much closer to zero as the last step has lowered the energy."""
    # Perfect cells have no energy to lose, and mirrored they are as perfect.
    sigma = max(least_sigma, 1.0 - last[1] / last[0] if last[0] > 0.0 else 0.0)
    m = (1.0 - sigma) * 0.5 * (smallest + np.sqrt(eps**2 + smallest**2))
    return float(2.0 * np.sqrt(m * (m - smallest))) if smallest < m else 1e-9


def _unfold_patches(formulation: Formulation, points: Field, first: Field, regions: list[Mask]) -> Field:
    """The points with one patch after the other unfolded, without those that leave the surface."""
    trial, work = points, formulation.work
    for number, region in enumerate(regions):
        # What resists leaves enough for the others.
        part = formulation.with_work(work.share(min(1.0, 2.0 / (len(regions) - number))))
        trial = _unfold_patch(part, trial, first, region)
    limit = max(1.0, formulation.relative_distance(points))
    if formulation.relative_distance(trial) <= limit:
        return trial
    # A patch watches the surface around itself only; one of them came to where others are.
    for region in regions:
        trial = _unfold_patch(formulation, points, first, region)
        points = trial if formulation.relative_distance(trial) <= limit else points
    return points


def _unfold_patch(formulation: Formulation, points: Field, first: Field, region: Mask) -> Field:
    """The best of several attempts on one patch; the points unchanged where none improves it.

    Attempts begin where the patch is now, where it was at first (before anything ran into its limits), and with
    the inner nodes of both at their harmonic positions.
    """
    patch, nodes = formulation.restricted(region, points)
    if not patch.free.any():
        return points
    start = points[nodes]
    best, amount = start, _tangledness(patch, start)
    enough = patch.schedules.untangling.enough * amount[1]
    # What is valid in the input and has not been given up on the way stays unfolded.
    protected = is_valid(first[nodes], patch.cells) & ~folded_cells(patch, start)
    everywhere = np.ones(len(nodes), dtype=bool)
    starts = [start, harmonic(patch, start, everywhere)]
    moving = patch.free
    if not np.array_equal(first[nodes][moving], start[moving]):
        again = np.where(moving[:, None], first[nodes], start)
        starts += [again, harmonic(patch, again, everywhere)]
    schedule = patch.schedules.untangling
    attempts = list(product(starts[: schedule.starts], schedule.first_eps))
    if patch.impossible[_tangled(patch, patch.measures(start))].all():
        attempts = attempts[:1]
    for local, first_eps in attempts:
        steps = list(_unfold(patch, local, first_eps, schedule.patch_steps))
        attempt = steps[-1] if steps else local
        tangled = _tangledness(patch, attempt)
        if tangled < amount and not folded_cells(patch, attempt)[protected].any():
            best, amount = attempt, tangled
        # What is left then is another, smaller patch.
        if amount[1] <= enough:
            break
    points = points.copy()
    points[nodes] = best
    return points


def _tangledness(formulation: Formulation, points: Field) -> tuple[int, int, float]:
    """Number of folded cells, of those that are flat or folded, and how far they are below flat."""
    measures, flat = formulation.measures(points), formulation.schedules.untangling.flat
    tangled = _tangled(formulation, measures)
    below = np.maximum(flat - np.minimum(measures.fullness[tangled], flat), 0.0)
    return int((measures.determinant <= 0.0).sum()), int(tangled.sum()), float(below.sum())
