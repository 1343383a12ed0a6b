"""The projected Newton method of the corner energy: the convex part of the Hessian, truncated solves, valid steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from ..elements import is_valid
from ..energy import CornerEnergy, Weights
from .minimizers import ARMIJO
from .step_rounding import round_direction

__all__ = ["newton_step", "next_shift", "projected_newton"]

Field = NDArray[np.float64]

_HALVINGS = 25
_SOLVE_TOLERANCE, _SOLVE_ITERATIONS = 0.1, 50  # tolerance and limit of the truncated solves
_SHIFTS = (1e-5, 1e-1)  # bounds of the shift that stands in for the curvature the convex Hessian leaves out


def newton_step(
    corner_energy: CornerEnergy, points: Field, weights: Weights, shift: float, accept: Callable[[Field], bool]
) -> tuple[Field, float, float, float] | None:
    """One truncated Newton step with the convex Hessian: new points, energy before and after, length.

    None where no step lowers the energy acceptably.
    """
    energy, gradient, matrix = corner_energy.value_gradient_hessian(points, weights)
    direction, _ = matrix.solve(-gradient, corner_energy.projectors, _SOLVE_TOLERANCE, _SOLVE_ITERATIONS, shift)
    if corner_energy.rounding > 0.0:
        nearest = round_direction(direction, points, corner_energy.cells, corner_energy.rounding)
        direction = np.einsum("nij,nj->ni", corner_energy.projectors, nearest)
    slope = float(np.einsum("ij,ij->", gradient, direction))
    step = 1.0
    for _ in range(_HALVINGS):
        trial = points + step * direction
        value = corner_energy.value(trial, weights)
        if value <= energy + ARMIJO * step * slope and accept(trial):
            return trial, energy, value, step
        step *= 0.5
    return None


def next_shift(shift: float, step: float) -> float:
    """The next shift of the diagonal: more after short steps, less after long ones."""
    low, high = _SHIFTS
    return min(high, 4 * shift) if step < 0.3 else max(low, shift / 4)


def projected_newton(
    corner_energy: CornerEnergy, points: Field, weights: Weights, decrease: float = 1e-3
) -> Iterator[tuple[Field, float]]:
    """Newton's method with the convex Hessian and truncated solves; yields points and energy of every step.

    Ends where two steps in a row lower the energy by less than the given fraction, or no step lowers it. A cell
    that is valid everywhere (Bernstein) stays so.
    """
    valid = is_valid(points, corner_energy.cells)
    shift, slow = _SHIFTS[0], 0

    def keeps_valid(trial: Field) -> bool:
        return bool(is_valid(trial, corner_energy.cells)[valid].all())

    while slow < 2:
        step = newton_step(corner_energy, points, weights, shift, keeps_valid)
        if step is None:
            return
        points, before, after, length = step
        if not valid.all():
            valid |= is_valid(points, corner_energy.cells)
        yield points, after
        shift = next_shift(shift, length)
        slow = slow + 1 if before - after <= decrease * abs(before) else 0
