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
from ..formulation import VOLUME_WEIGHT, Formulation, Iteration, convex_newton
from ..mesh import node_rings
from ..quality import attainable_scaled_jacobian

__all__ = ["raise_worst", "raise_worst_patches", "stiffened"]

Field = NDArray[np.float64]

_DISTORTION_SHARE = 0.2  # of the whole distortion beside the angles: less makes thin cells for little better angles
_STIFFNESS = 0.95  # stiffness times the worst density
_ANGLE_STEPS, _STIFF_STEPS = 10, 3  # more of them cost more and win nothing that the patches do not
_PATCH_STEPS, _PATCH_PASSES, _PATCH_ROUNDS = 4, 3, 40
_MARGIN = 0.1  # cells this close to the worst scaled Jacobian are raised with it
_RINGS = 3  # of cells around them that move
_LEAST_GAIN = 1e-3  # of the worst scaled Jacobian, or a tenth of it; a round with less is a stall
_GOOD = 0.98  # worst scaled Jacobian at which nothing is left to do


def stiffened(formulation: Formulation, points: Field) -> CornerWeights:
    """Weights of a barrier that no corner worse than the worst of the points can pass."""
    worst = max(float(formulation.measures(points).angle.max()), 1e-3)
    return CornerWeights(_DISTORTION_SHARE, 1.0, _STIFFNESS / worst)


def raise_worst(formulation: Formulation, points: Field) -> Iterator[Iteration]:
    """Raise the worst cells of a whole valid mesh, then its worst patches, until the worst cell stalls."""
    weights = CornerWeights(_DISTORTION_SHARE, 1.0)
    angles = convex_newton(formulation, points, weights, VOLUME_WEIGHT, decrease=3e-3)
    for iterate in islice(angles, _ANGLE_STEPS):
        points = iterate.points
        yield Iteration("angles", points)
    stiff = convex_newton(formulation, points, stiffened(formulation, points), VOLUME_WEIGHT)
    for iterate in islice(stiff, _STIFF_STEPS):
        points = iterate.points
        yield Iteration("stiffen", points)
    yield from raise_worst_patches(formulation, points)


def raise_worst_patches(formulation: Formulation, points: Field) -> Iterator[Iteration]:
    """Raise the patches around the worst cells only, until the worst cell of the mesh stalls or is good enough."""
    attainable = min(
        _GOOD, (1.0 - _LEAST_GAIN) * attainable_scaled_jacobian(points, formulation.cells, ~formulation.free)[0]
    )
    quality = corner_scaled_jacobian(points, formulation.cells)
    for _ in range(_PATCH_ROUNDS):
        worst = float(quality.min())
        if worst >= attainable:
            return
        region = node_rings(formulation.cells, len(points), quality < worst + _MARGIN, _RINGS)
        patch, nodes = formulation.restricted(region, points)
        if not patch.free.any():
            return
        local = points[nodes]
        for _ in range(_PATCH_PASSES):
            steps = convex_newton(patch, local, stiffened(patch, local), VOLUME_WEIGHT)
            for iterate in islice(steps, _PATCH_STEPS):
                local = iterate.points
        trial = points.copy()
        trial[nodes] = local
        quality = corner_scaled_jacobian(trial, formulation.cells)
        # A patch watches the surface around itself only.
        if quality.min() < worst or not np.isfinite(formulation.objective(CornerWeights()).value(trial)):
            return
        points = trial
        yield Iteration("worst cells", points)
        if quality.min() < worst + min(_LEAST_GAIN, 0.1 * worst):
            return
