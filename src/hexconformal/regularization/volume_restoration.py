"""Keep the volume that a boundary encloses, for the boundary as a whole.

The constraint of Gruber & Aulisa makes the displacement v of a surface orthogonal to a normal N~, weakly. With the
Simpson mean of the area vectors before, half-way and after, <v, N~> summed over the surface is the change of volume
itself, which a bilinear surface encloses as a cubic of its nodes. So one multiplier, a pressure on the boundary, is
enough: the change that costs least energy per volume is H^-1 N, with H the Hessian of the energy.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..elements import is_valid
from ..energy import CornerWeights
from ..formulation import Formulation
from ..geometry import enclosed_volume, nodal_area_vectors, simpson_mean
from ..solver import solve_blocks

__all__ = ["restore_volume"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


def restore_volume(formulation: Formulation, points: Field, quads: Ints, volume: float) -> Field:
    """Points that enclose the given volume, changed as the energy resists least; as near as can be otherwise.

    Every step is valid, admissible, and within the limits of the surface.

    Parameters
    ----------
    formulation
        Energies that resist; none of its cells may be folded.
    points
        (n, 3) where to begin.
    quads
        (k, 4) boundary quads.
    volume
        Volume to enclose.
    """
    schedule, valid = formulation.schedules.volume, is_valid(points, formulation.cells)
    for _ in range(schedule.steps):
        gap = volume - enclosed_volume(points, quads)
        if abs(gap) <= schedule.exact * abs(volume):
            return points
        worst = max(float(formulation.measures(points).angle.max(initial=0.0)), 1e-3)
        weights = CornerWeights(angle=1.0, stiffness=schedule.stiffness / worst)
        assembly, volume_weight = formulation.equation.assembly, formulation.schedules.minimization.volume_weight
        objective = formulation.objective(weights, volume_weight).convex(points, assembly)[2]
        normals = nodal_area_vectors(points, quads)
        limits = schedule.tolerance, schedule.iterations, schedule.shift
        coupled = formulation.admissible.coupled
        direction = solve_blocks(assembly.matrix, normals, formulation.projectors, *limits, coupled=coupled)
        if not np.einsum("ij,ij->", direction, normals) > 0.0:
            return points
        for halving in range(schedule.halvings):
            trial = _move_by_volume(points, direction, quads, gap * 0.5**halving)
            if np.isfinite(objective.value(trial)) and is_valid(trial, formulation.cells)[valid].all():
                points = trial
                break
        else:
            return points
    return points


def _move_by_volume(points: Field, direction: Field, quads: Ints, gap: float) -> Field:
    """The points moved so far along the direction that the volume grows by the gap, by iterating on N~."""
    area_vectors = partial(nodal_area_vectors, faces=quads)
    length = 0.0
    for _ in range(30):
        moved = points + length * direction
        growth = float(np.einsum("ij,ij->", simpson_mean(area_vectors, points, moved), direction))
        if growth == 0.0:
            break
        longer = gap / growth
        if abs(longer - length) <= 1e-15 * abs(longer):
            break
        length = longer
    return points + length * direction
