"""Keep the volume that a boundary encloses, for the boundary as a whole and for every region inside.

The constraint of Gruber & Aulisa makes the displacement v of a surface orthogonal to a normal N~, weakly. With the
Simpson mean of the area vectors before, half-way and after, <v, N~> summed over the surface is the change of volume
itself, which a bilinear surface encloses as a cubic of its nodes. So one multiplier, a pressure on the boundary, is
enough: the change that costs least energy per volume is H^-1 N, with H the Hessian of the energy. A mesh of k regions
has a pressure in each: the change is a combination of the k fields H^-1 N_k, and k equations say of which.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..elements import is_valid
from ..energy import CornerWeights
from ..formulation import Formulation
from ..geometry import enclosed_volume, nodal_area_vectors, simpson_mean
from ..mesh import SERIAL, Space
from ..solver import solve_blocks

__all__ = ["enclosed_volumes", "restore_volumes"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_DEPENDENT = 1e-10  # of the largest singular value: pressures in all regions of a body whose skin stays cancel out


def enclosed_volumes(points: Field, surfaces: Sequence[Ints], space: Space = SERIAL) -> Field:
    """(k,) volumes inside k closed surfaces of quads, of which every part may have some."""
    centre = space.means(space.own(points).T) if space.is_shared else None
    return space.totals(np.array([enclosed_volume(points, quads, centre) for quads in surfaces]))


def restore_volumes(formulation: Formulation, points: Field, surfaces: Sequence[Ints], volumes: Field) -> Field:
    """Points of which k surfaces enclose the given volumes, changed as the energy resists least; as near as can be.

    Every step is valid, admissible, and within the limits of the surface.

    Parameters
    ----------
    formulation
        Energies that resist; none of its cells may be folded.
    points
        (n, 3) where to begin.
    surfaces
        Quads of each closed surface, seen from outside: the boundary, or those of regions that fill it.
    volumes
        (k,) volumes to enclose.
    """
    schedule, valid = formulation.schedules.volume, is_valid(points, formulation.cells)
    space = formulation.space
    last = np.inf
    for _ in range(schedule.steps):
        gaps = volumes - enclosed_volumes(points, surfaces, space)
        if (np.abs(gaps) <= schedule.exact * np.abs(volumes)).all():
            return points
        # Of several volumes one may not be in reach, and a thin one no better than rounding lets it be.
        largest = float(np.abs(gaps / np.where(volumes == 0.0, 1.0, volumes)).max())
        if len(surfaces) > 1 and largest > schedule.stall * last:
            return points
        last = largest
        worst = max(space.largest(formulation.measures(points).angle), 1e-3)
        weights = CornerWeights(angle=1.0, stiffness=schedule.stiffness / worst)
        assembly, volume_weight = formulation.equation.assembly, formulation.schedules.minimization.volume_weight
        objective = formulation.objective(weights, volume_weight)
        limits = schedule.tolerance, schedule.iterations, schedule.shift
        able, directions, coupled = [], [], formulation.admissible.coupled
        for number, quads in enumerate(surfaces):
            composed = objective.convex(points, assembly)[2]  # a solve uses the blocks up
            normals = space.add(nodal_area_vectors(points, quads))
            where = formulation.projectors, *limits, space, coupled
            direction = space.update(solve_blocks(assembly.matrix, normals, *where))
            if space.inner(direction, normals) > 0.0:
                able.append(number)
                directions.append(direction)
        if not able:
            return points
        moving, ways = [surfaces[number] for number in able], np.stack(directions)
        for halving in range(schedule.halvings):
            trial = _move_by_volumes(points, ways, moving, gaps[able] * 0.5**halving, space)
            finite = bool(np.isfinite(composed.value(trial)))
            if space.everywhere(finite and bool(is_valid(trial, formulation.cells)[valid].all())):
                points = trial
                break
        else:
            return points
    return points


def _move_by_volumes(points: Field, directions: Field, surfaces: Sequence[Ints], gaps: Field, space: Space) -> Field:
    """The points moved so far along directions (k, n, 3) that the volumes grow by the gaps (k,), by iterating on N~."""
    area_vectors = [partial(nodal_area_vectors, faces=quads) for quads in surfaces]
    lengths = np.zeros(len(gaps))
    for _ in range(30):
        moved = points + np.einsum("k,kij->ij", lengths, directions)
        means = (simpson_mean(vectors, points, moved) for vectors in area_vectors)
        growth = space.totals(np.stack([np.einsum("kij,ij->k", directions, mean) for mean in means]))
        own = growth.diagonal()
        if (own == 0.0).any():
            break
        longer = np.linalg.lstsq(growth / own[:, None], gaps / own, rcond=_DEPENDENT)[0]
        if np.abs(longer - lengths).max() <= 1e-15 * np.abs(longer).max():
            break
        lengths = longer
    return points + np.einsum("k,kij->ij", lengths, directions)
