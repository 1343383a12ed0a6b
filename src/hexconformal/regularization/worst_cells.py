"""Raise the worst cells: angles first, then a stiffening barrier that follows the worst corner.

The scaled Jacobian of a corner depends on its angles alone, so the distortion of the unit columns is what
counts, with a part of the whole distortion to keep edge lengths in order. phi(e) = e / (1 - t e) with t just
below one over the worst density forbids any corner to get worse and pushes hardest where it is needed
(quasi-isometric stiffening, Garanzha et al. 2021). Equation (12) of docs/mathematics.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..elements import corner_scaled_jacobian
from ..energy import CornerWeights
from ..formulation import Formulation, Iteration, convex_newton
from ..mesh import node_rings
from ..quality import attainable_scaled_jacobian

__all__ = ["raise_worst", "raise_worst_patches", "stiffened"]

Field = NDArray[np.float64]


def stiffened(formulation: Formulation, points: Field) -> CornerWeights:
    """Weights of a barrier that no corner worse than the worst of the points can pass."""
    schedule = formulation.schedules.worst_cells
    worst = max(float(formulation.measures(points).angle.max()), 1e-3)
    return CornerWeights(schedule.distortion_share, 1.0, schedule.stiffness / worst)


def raise_worst(formulation: Formulation, points: Field) -> Iterator[Iteration]:
    """Raise the worst cells of a whole valid mesh, then its worst patches, until the worst cell stalls."""
    schedule = formulation.schedules.worst_cells
    weights = CornerWeights(schedule.distortion_share, 1.0)
    angles = convex_newton(formulation, points, weights, decrease=schedule.angle_decrease)
    for iterate in islice(angles, schedule.angle_steps):
        points = iterate.points
        yield Iteration("angles", points)
    stiff = convex_newton(formulation, points, stiffened(formulation, points))
    for iterate in islice(stiff, schedule.stiff_steps):
        points = iterate.points
        yield Iteration("stiffen", points)
    yield from raise_worst_patches(formulation, points)


def raise_worst_patches(formulation: Formulation, points: Field) -> Iterator[Iteration]:
    """Raise the patches around the worst cells only, until the worst cell of the mesh stalls or is good enough."""
    schedule = formulation.schedules.worst_cells
    bound = attainable_scaled_jacobian(points, formulation.cells, ~formulation.free)[0]
    attainable = min(schedule.good, (1.0 - schedule.least_gain) * bound)
    quality = corner_scaled_jacobian(points, formulation.cells)
    for _ in range(schedule.patch_rounds):
        worst = float(quality.min())
        if worst >= attainable:
            return
        region = node_rings(formulation.cells, len(points), quality < worst + schedule.margin, schedule.rings)
        patch, nodes = formulation.restricted(region, points)
        if not patch.free.any():
            return
        local = points[nodes]
        for _ in range(schedule.patch_passes):
            steps = convex_newton(patch, local, stiffened(patch, local))
            for iterate in islice(steps, schedule.patch_steps):
                local = iterate.points
        trial = points.copy()
        trial[nodes] = local
        quality = corner_scaled_jacobian(trial, formulation.cells)
        # A patch watches the surface around itself only.
        if quality.min() < worst or not np.isfinite(formulation.objective(CornerWeights()).value(trial)):
            return
        points = trial
        yield Iteration("worst cells", points)
        if quality.min() < worst + min(schedule.least_gain, 0.1 * worst):
            return
