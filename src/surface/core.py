"""Descent on a surface: the loop, free of files and reports, in units of the mean edge length."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from .barrier import Barrier
from .features import holding
from .geometry import Floats, nodal_areas, nodal_vectors, transport_vectors, unit_vectors
from .problem import Surface
from .step import Linear

__all__ = ["Iterate", "Outcome", "descend"]

_LONGEST = 0.5  # step of a node, in lengths of its edges
_TOGETHER = (1.0, 0.5, 0.25)  # of their steps that all nodes try first, whatever that is in lengths of their edges
_TRIES = 16
_FEW = 30  # nodes
_BLAMES = 4  # times that cells are blamed for a rise of the energy, before everybody is
_SHORTER = 0.25  # factor of the step of nodes in trouble
_HELD = 0.1  # share of its step below which a node stays
_CAP, _WIDE = 10.0, 100.0  # of the density, at first and at last: raised whenever the decrease is below _SETTLED
_EASE = 64.0  # the energy's at first; lowered likewise, to 1
_SETTLED = 0.05
_STALL = 5  # iterations in a row that gain little
_LATE = 0.01  # decrease from which on new normals may not raise the energy for long
_BACK = 0.5  # of the last decrease, that new normals may take back from then on
_VAIN = 10  # iterations from then on, in which against their own normals cells gain little
_SLACK = 1e-4  # beyond that range
_AGAIN = 5  # descents at the most, each after cells turned over at the end of the last have been turned back
_FEW_TURNED = 5  # cells for which that is tried
_PARTS = (0.05, 0.1, 0.2, 0.4)  # of the edges at a node, by which it moves for that,
_ROUND = np.arange(8) * np.pi / 4  # and in which directions


@dataclass(frozen=True)
class Iterate:
    """One accepted surface, and the points of the input it stands on."""

    points: Floats
    base: Floats
    energy: float
    decrease: float
    step: float
    held: int


@dataclass
class Outcome:
    """Why the descent ended."""

    reason: str = "interrupted"
    converged: bool = False


def descend(surface: Surface, tolerance: float, outcome: Outcome) -> Iterator[Iterate]:
    """Lower the energy as far as it goes, then turn back the few cells that may have turned over on the way.

    Yields every accepted surface; see :func:`_descend`.
    """
    at = Iterate(surface.start, surface.start, 0.0, 0.0, 0.0, 0)
    for _ in range(_AGAIN):
        for at in _descend(surface, tolerance, outcome, at):
            yield at
        mended = [] if surface.target is None else list(_turned_back(surface, at))
        yield from mended
        if not mended or outcome.converged:
            return
        # What stood in the way may have been those.
        at = mended[-1]


def _descend(surface: Surface, tolerance: float, outcome: Outcome, at: Iterate) -> Iterator[Iterate]:
    """Lower the energy from a surface until a step would gain less than `tolerance` of it; yields what is accepted.

    Newton steps along the surface, put back onto it. A node goes as far as the cells around it allow: each has a
    share of its step, which shrinks where a cell would be spoiled, turn over, or leave the input, and recovers.
    First all try to go together.
    The barrier is measured against the normals of the input, which are taken anew in every iteration: late in a run
    only as far as that takes back no more than half of what the last step gained, so that the energy falls for good.
    """
    energy, target = surface.energy, surface.target
    x, base = at.points, at.base
    share = np.ones(len(x))
    damping, cap, ease, slow, together = 1.0, _CAP, _EASE, 0, True
    late, lowest, vain, value = False, np.inf, 0, np.inf
    decrease = step = 0.0
    held = 0
    while True:
        normals = None if target is None else target.project(base)[2]
        if isinstance(energy, Barrier):
            energy.damping, energy.cap, energy.ease = damping, cap, ease
            energy.renew(x, surface.frame_normals(x, normals), _BACK * decrease * value if late else np.inf)
            energy.settle(x)
        value = energy.value(x)
        yield Iterate(x, base, value, decrease, step, held)
        gradient, linear = _system(surface, x, normals)
        v = linear.solve(-gradient, surface.precision)
        if not -(gradient * v).sum() > tolerance * value:
            if isinstance(energy, Barrier) and ease > 1:
                ease, decrease, step = 1.0, 0.0, 0.0
                continue
            outcome.reason, outcome.converged = "no step lowers the energy further", True
            return
        tries = (*_TOGETHER, None) if together else (None,)
        searches = (_search(surface, x, base, linear, -gradient, v, share, part) for part in tries)
        found = next((result for result in searches if result is not None), None)
        cautious = False
        while found is None and damping < 64.0 and isinstance(energy, Barrier):
            damping = energy.damping = 8 * damping
            gradient, linear = _system(surface, x, normals)
            v = linear.solve(-gradient, surface.precision)
            found = _search(surface, x, base, linear, -gradient, v, np.ones(len(x)))
            cautious = True
        if found is None:
            outcome.reason = "every step that lowers the energy spoils a cell or the shape"
            # Where the last steps hardly gained, nothing is lost.
            outcome.converged = slow > 0
            return
        x_before = x
        x, base, places, new, s, failures, together = found
        decrease = (value - new) / value
        step = float(np.linalg.norm(x - x_before, axis=1).max())
        held = int((s[surface.moving] == 0).sum())
        damping = min(damping * 2, 16.0) if failures else max(damping * (0.9 if cautious else 0.5), 1 / 8)
        share = np.minimum(1.0, np.maximum(s / s.max(), _HELD / 2) / _SHORTER)
        if decrease < _SETTLED:
            cap, ease = min(2 * cap, _WIDE), max(ease / 4, 1.0)
        surface.shape.accept()
        if target is not None and places is not None:
            target.places = places
        eased = cap == _WIDE and ease == 1
        late = late or (eased and decrease < _LATE)
        slow = slow + 1 if decrease < tolerance and eased else 0
        if late and isinstance(energy, Barrier):
            reached = energy.own(x)
            vain += 1
            if reached < (1 - 0.5 * _VAIN * tolerance) * lowest:
                lowest, vain = reached, 0
        if slow == _STALL or vain == _VAIN:
            outcome.reason, outcome.converged = "iterations hardly lower the energy any more", True
            if held:
                outcome.reason += f"; {held} nodes are held at the limits of the shape"
            return


def _turned_back(surface: Surface, at: Iterate) -> Iterator[Iterate]:
    """Move single nodes of cells that are turned over, a little along the surface, where that turns them back."""
    energy, target, shape = surface.energy, surface.target, surface.shape
    assert target is not None
    assert surface.bound is not None
    turned = shape.turned_over(at.points)
    nobody = np.zeros(len(surface.cells), dtype=bool)
    worst = energy.densities(at.points).max()
    while 0 < turned.sum() <= _FEW_TURNED:
        normals = unit_vectors(target.project(at.base)[2])
        lengths = surface.edge_lengths(at.points)
        for part, turn, node in product(_PARTS, _ROUND, np.unique(surface.cells.corners_of(turned))):
            if not surface.moving[node]:
                continue
            step = np.zeros_like(at.points)
            across = np.cross(normals[node], np.eye(3)[np.abs(normals[node]).argmin()])
            across /= max(float(np.linalg.norm(across)), 1e-300)
            step[node] = part * lengths[node] * (np.cos(turn) * across + np.sin(turn) * np.cross(normals[node], across))
            y, moved, places = surface.retracted(at.base, step)
            fewer = shape.turned_over(y)
            better = fewer.sum() < turned.sum() and energy.densities(y).max() <= worst
            if better and not shape.strays(y, surface.bound, nobody).any():
                break
        else:
            return
        shape.accept()
        if places is not None:
            target.places = places
        turned = fewer
        at = Iterate(y, moved, energy.value(y), 0.0, float(part * lengths[node]), at.held)
        yield at


def _system(surface: Surface, x: Floats, normals: Floats | None) -> tuple[Floats, Linear]:
    """The derivative of the energy, and the linear system of a Newton step along the surface."""
    energy = surface.energy
    hessian = energy.hessian(x)
    if normals is not None:
        # Nodes are put back onto the surface: the limit eps = 0, and the normal is that of where they are.
        return surface.slope(x), Linear(hessian, holding(normals, x, surface.features), None, surface.moving)
    stiffness = nodal_areas(x, surface.cells) / surface.eps
    gradient = energy.gradient(x)
    vectors = nodal_vectors(x, surface.cells)
    linear = Linear(hessian, holding(vectors, x, surface.features), stiffness, surface.moving)
    for _ in range(0 if surface.normal == "linear" else 3):
        v = linear.solve(-gradient, surface.precision)
        vectors = transport_vectors(x, x + v, surface.cells, surface.normal)
        linear = Linear(hessian, holding(vectors, x, surface.features), stiffness, surface.moving)
    return gradient, linear


def _search(  # type: ignore[no-untyped-def]
    surface: Surface,
    x: Floats,
    base: Floats,
    linear: Linear,
    force: Floats,
    v: Floats,
    share: Floats,
    part: float | None = None,
):
    """Shorten or hold the steps of nodes whose cells are in trouble; where the energy does not fall, all of them.

    With `part` all go that part of their step, or none does: small cells among larger ones travel as a whole.
    """
    energy = surface.energy
    before = energy.densities(x)
    value = float(before.sum())
    longest = _LONGEST * surface.edge_lengths(x)
    free = share > _HELD
    failures, shortened = 0, not free.all()
    if shortened:
        v = linear.solve(force, surface.precision, free)
    within = np.minimum(share, longest / np.maximum(np.linalg.norm(v, axis=1), 1e-300))
    s = (within if part is None else part * share) * free
    counts: list[int] = []
    for tries in range(_TRIES):
        y, moved, places = surface.retracted(base, s[:, None] * v)
        after = energy.densities(y)
        trouble = surface.in_trouble(y, before, after, s)
        if part is not None and (trouble.any() or not float(after.sum()) < value):
            return None
        if trouble.any():
            counts.append(int(trouble.sum()))
            if len(counts) > 3 and counts[-1] > max(2 * counts[0], _FEW):
                return None  # what is held brings the next into trouble: the step is too long for all
            # Who is held already is not to blame: the neighbours are in the way, or else everybody.
            blamed = (trouble | surface.around(trouble & (s == 0))) & (s > 0)
            shortened = True
            s[blamed] *= _SHORTER if tries < 2 else 0.0
            if not blamed.any():
                failures += 1
                s *= 0.5
            continue
        new = float(after.sum())
        if new < value and abs(surface.area_excess(y)) <= _SLACK:
            return y, moved, places, new, s, failures, tries == 0
        if shortened and (s < _HELD).any():
            # Steps of unequal length need not descend: those of the others follow from who is held.
            shortened = False
            free = s >= _HELD
            v = linear.solve(force, surface.precision, free)
            s = np.minimum(s, longest / np.maximum(np.linalg.norm(v, axis=1), 1e-300)) * free
            continue
        failures += 1
        rise = after - before
        if failures <= _BLAMES and not new < value:
            # Mostly a few cells raise it, where the surface is too rough to follow.
            s[surface.nodes_of(rise > 0.3 * rise.max())] *= 0.0 if failures > 1 else _SHORTER
            shortened = True
        else:
            s *= 0.5
    return None
