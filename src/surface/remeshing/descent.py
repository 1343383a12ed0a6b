"""Descent on a surface: the loop, free of files and reports, in units of the mean edge length."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..constraint import ConstrainedSystem, constrained_system, held_projectors
from ..energy import Barrier
from ..mesh import Floats, Ints
from .problem import RemeshingProblem

__all__ = ["Iterate", "Outcome", "descend"]

_TOGETHER = 3  # steps that all nodes try first, of full length, a half and a quarter
_TRIES = 24
_BLAMES = 3  # times that cells are blamed for a rise of the energy, before everybody is
_SOFT, _STIFF = 0.125, 64.0  # damping of a node that is free, and beyond which it is held
_RAISE, _RELAXED = 8.0, 0.25  # factors of the damping of nodes in trouble, and from one iteration to the next
_MANY = 0.5  # of the nodes in trouble: the step is too long for all
_CAP, _WIDE = 10.0, 100.0  # of the density, at first and at last: raised whenever the decrease is below _SETTLED
_EASE = 64.0  # the energy's at first; lowered likewise, to 1
_SETTLED = 0.05
_STALL = 5  # iterations in a row that gain little
_LATE = 0.01  # decrease from which on new normals may not raise the energy for long
_BACK = 0.5  # of the last decrease, that new normals may take back from then on
_VAIN = 10  # iterations from then on, in which against their own normals cells gain little
_TINY = 1e-300
_SLACK = 1e-4  # beyond that range


@dataclass(frozen=True)
class Iterate:
    """One accepted surface, and how it was reached."""

    points: Floats
    decrease: float
    step: float
    held: int


@dataclass(frozen=True)
class _Way:
    """How nodes go: the damping of each, and whether all try to go together first."""

    damping: Floats
    together: bool


@dataclass(frozen=True)
class _Step:
    """A step that was found: the new surface and the points of the input it stands on, who stays, and how to go on."""

    points: Floats
    base: Floats
    places: Ints | None
    energy: float
    held: NDArray[np.bool_]
    way: _Way


@dataclass
class Outcome:
    """Why the descent ended."""

    reason: str = "interrupted"
    converged: bool = False


def descend(
    surface: RemeshingProblem, tolerance: float, outcome: Outcome, waiting: NDArray[np.bool_]
) -> Iterator[Iterate]:
    """Lower the energy until a step would gain less than `tolerance` of it; yields every surface that is accepted.

    Newton steps along the surface, put back onto it. Where a cell would be spoiled, or leave the input, its nodes are
    damped, so that the others' steps follow from how far these can go; the damping fades. First all try to go together.
    The barrier is measured against the normals of the input, which are taken anew in every iteration: late in a run
    only as far as that takes back no more than half of what the last step gained, so that the energy falls for good.
    On the way cells may turn over; once the energy is the final one none does. Some nodes are waiting for that.
    """
    energy, target = surface.energy, surface.target
    x = base = surface.start
    way = _Way(np.where(waiting, np.inf, 1.0), True)
    cap, ease, slow = _CAP, _EASE, 0
    late, lowest, own, vain, value = False, np.inf, np.inf, 0, np.inf
    surface.shape.forbid_turning = False
    decrease = step = 0.0
    held = 0
    while True:
        normals = None if target is None else target.foot_points(base)[1]
        if isinstance(energy, Barrier):
            energy.cap, energy.continuation = cap, ease
            energy.update_normals(x, surface.frame_normals(x, normals), _BACK * decrease * value if late else np.inf)
            energy.adapt(x)
        value = energy.value(x)
        yield Iterate(x, decrease, step, held)
        surface.damp(np.minimum(way.damping, _STIFF))
        gradient, linear = _system(surface, x, normals)
        v = linear.solve_iteratively(-gradient, surface.precision, way.damping <= _STIFF)
        downhill = -(gradient * v).sum() > tolerance * value
        if not downhill and isinstance(energy, Barrier) and ease > 1:
            ease, decrease, step = 1.0, 0.0, 0.0
            continue
        found = _search(surface, x, base, v, normals, way) if downhill else None
        if found is None and waiting.any():
            # Nobody else is on the way any more.
            way, waiting = _Way(np.minimum(way.damping, _STIFF), True), np.zeros_like(waiting)
            cap, ease, decrease, step, surface.shape.forbid_turning = _WIDE, 1.0, 0.0, 0.0, True
            continue
        if found is None:
            # Where steps hardly gained any more, nothing is lost.
            outcome.reason, outcome.converged = "no step lowers the energy further", True
            if downhill:
                outcome.reason, outcome.converged = "every step that lowers the energy spoils a cell or the shape", late
            return
        decrease = (value - found.energy) / value
        step = float(np.linalg.norm(found.points - x, axis=1).max())
        x, base = found.points, found.base
        held = int(found.held[surface.moving].sum())
        way = _Way(np.clip(_RELAXED * found.way.damping, _SOFT, _STIFF), found.way.together)
        if decrease < _SETTLED:
            cap, ease = min(2 * cap, _WIDE), max(ease / 4, 1.0)
        surface.shape.accept()
        if target is not None and found.places is not None:
            target.node_facets = found.places
        improve_folded = cap == _WIDE and ease == 1
        surface.shape.forbid_turning = improve_folded
        waiting = waiting & (not improve_folded)
        way.damping[waiting] = np.inf
        late = late or (improve_folded and decrease < _LATE)
        fell = decrease
        if late and isinstance(energy, Barrier):
            energy.cap = cap
            reached = energy.value_at_own_normals(x)
            fell = max(fell, 1 - reached / max(own, _TINY))
            own = reached
            vain += 1
            if reached < (1 - 0.5 * _VAIN * tolerance) * lowest:
                lowest, vain = reached, 0
        slow = slow + 1 if fell < tolerance and improve_folded else 0
        if slow == _STALL or vain == _VAIN:
            outcome.reason, outcome.converged = "iterations hardly lower the energy any more", True
            if held:
                outcome.reason += f"; {held} nodes are held at the limits of the shape"
            return


def _system(surface: RemeshingProblem, x: Floats, normals: Floats | None) -> tuple[Floats, ConstrainedSystem]:
    """The derivative of the energy, and the linear system of a Newton step along the surface."""
    energy = surface.energy
    hessian = energy.hessian(x)
    if normals is not None:
        # Nodes are put back onto the surface: the limit eps = 0, and the normal is that of where they are.
        return surface.slope(x), ConstrainedSystem(
            hessian, held_projectors(normals, x, surface.features), None, surface.moving
        )
    gradient = energy.gradient(x)

    def along(v: Floats) -> ConstrainedSystem:
        return constrained_system(
            hessian, x, v, surface.cells, surface.features, surface.eps, surface.normal, surface.moving
        )

    linear = along(np.zeros_like(x))
    for _ in range(0 if surface.normal == "linear" else 3):
        linear = along(linear.solve_iteratively(-gradient, surface.precision))
    return gradient, linear


def _search(
    surface: RemeshingProblem, x: Floats, base: Floats, v: Floats, normals: Floats | None, way: _Way
) -> _Step | None:
    """A step that lowers the energy: nodes whose cells are in trouble are damped, and held at last.

    Where most are in trouble, or nobody is to blame, the step is too long for all.
    """
    energy = surface.energy
    before = energy.densities(x)
    value = float(before.sum())
    damping, part, together, rises = way.damping.copy(), 1.0, way.together, 0
    frozen = np.isinf(damping)
    for tries in range(_TRIES):
        held = damping > _STIFF
        y, moved, places = surface.retracted(x, base, (part * ~held)[:, None] * v, frozen)
        after = energy.densities(y)
        new = float(after.sum())
        trouble = surface.in_trouble(y, before, after, held)
        if not trouble.any():
            if new < value and abs(surface.area_excess(y)) <= _SLACK:
                return _Step(y, moved, places, new, held, _Way(damping, together or tries == 0))
            rises += 1
            if not new < value and rises <= _BLAMES:
                # The fewest cells without whose rise the energy would fall: where the surface is too rough to follow.
                rise = after - before
                order = np.argsort(-rise)
                trouble = surface.nodes_of(order[np.cumsum(rise[order]) - rise[order] < new - value])
        if together:
            part, together = (0.5 * part, True) if tries + 1 < _TOGETHER else (1.0, False)
            rises = 0
            continue
        # Who is held already is not to blame: the neighbours are in the way, or that all moves a little with the rest.
        frozen |= trouble & held & surface.shape.forbid_sheet_change
        blamed = (trouble | surface.around(trouble & held)) & ~held
        if not 0 < blamed.sum() <= _MANY * (~held).sum():
            part *= 0.5
            continue
        damping[blamed] *= _RAISE
        surface.damp(np.minimum(damping, _STIFF))
        gradient, linear = _system(surface, x, normals)
        v = linear.solve_iteratively(-gradient, surface.precision, damping <= _STIFF)
    return None
