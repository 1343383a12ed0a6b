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
from ..energy import VOLUME_WEIGHT, CornerEnergy, Weights
from ..geometry import enclosed_volume, nodal_area_vectors, simpson_mean

__all__ = ["restore_volume"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_EXACT = 1e-14  # relative difference of volumes that counts as none
_STEPS, _HALVINGS = 40, 10
_STIFFNESS = 0.95  # stiffness times the worst density: no cell gets worse than that one is
_SOLVE, _SOLVE_ITERATIONS, _SHIFT = 1e-2, 50, 1e-5


def restore_volume(corner_energy: CornerEnergy, points: Field, quads: Ints, volume: float) -> Field:
    """Points that enclose the given volume, changed as the energy resists least; as near as can be otherwise.

    Every step is valid, admissible, and within the limits of the surface.

    Parameters
    ----------
    corner_energy
        Energy that resists; none of its cells may be folded.
    points
        (n, 3) where to begin.
    quads
        (k, 4) boundary quads.
    volume
        Volume to enclose.
    """
    valid = is_valid(points, corner_energy.cells)
    for _ in range(_STEPS):
        gap = volume - enclosed_volume(points, quads)
        if abs(gap) <= _EXACT * abs(volume):
            return points
        worst = max(float(corner_energy.measures(points).angle.max(initial=0.0)), 1e-3)
        weights = Weights(angle=1.0, stiffness=_STIFFNESS / worst, volume=VOLUME_WEIGHT)
        matrix = corner_energy.value_gradient_hessian(points, weights)[2]
        normals = nodal_area_vectors(points, quads)
        direction, _ = matrix.solve(normals, corner_energy.projectors, _SOLVE, _SOLVE_ITERATIONS, _SHIFT)
        if not np.einsum("ij,ij->", direction, normals) > 0.0:
            return points
        for halving in range(_HALVINGS):
            trial = _move_by_volume(points, direction, quads, gap * 0.5**halving)
            if np.isfinite(corner_energy.value(trial, weights)) and is_valid(trial, corner_energy.cells)[valid].all():
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
