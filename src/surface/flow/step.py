"""One semi-implicit time step of a gradient flow, with area and volume kept exactly by two scalars.

    M u' + dE(u) + nu dA(u) + lambda dV(u) = 0

The gradient is taken at the old surface; what makes the step implicit is the leading part of the second derivative,

    (M / tau + t K + K M_k^-1 K) v = -dE,

equation (26) of docs/mathematics.md, with t the tension and M_k the mass matrix over the stiffness k of the bending
terms (Dziuk 2008 for k = 2). The inner inverse is an unknown of its own, so that the matrix stays sparse. It is
symmetric and quasi-definite.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from hexconformal.geometry import enclosed_volume, nodal_area_vectors

from ..mesh import Floats
from .discrete import DiscreteSurface, factorize
from .energy import curvature_at_points, energy_gradient
from .terms import Term

__all__ = ["CONSERVED", "Conserved", "implicit_step", "restore_conserved"]

CONSERVED = ("area", "volume")
_MULTIPLIER_TOLERANCE = 1e-13  # relative error of area and volume
_MAX_ITERATIONS = 30


class Conserved:
    """The quantities that stay constant along a flow.

    Parameters
    ----------
    names
        "area", "volume", both, or none.
    start
        The surface that has the values to keep.
    """

    def __init__(self, names: Sequence[str], start: DiscreteSurface) -> None:
        self.names = tuple(name for name in CONSERVED if name in names)
        self.values = self.values_of(start)

    def values_of(self, surface: DiscreteSurface) -> Floats:
        """(k,) the conserved quantities of a surface."""
        known = {
            "area": lambda: surface.area,
            "volume": lambda: enclosed_volume(surface.points, surface.elements.cells),
        }
        return np.array([known[name]() for name in self.names])

    def gradients(self, surface: DiscreteSurface) -> list[Floats]:
        """k gradients (n, 3)."""
        known = {
            "area": lambda: surface.area_gradient,
            "volume": lambda: nodal_area_vectors(surface.points, surface.elements.cells),
        }
        return [known[name]() for name in self.names]

    def error(self, surface: DiscreteSurface) -> float:
        """Largest relative deviation."""
        if not self.names:
            return 0.0
        return float(np.abs(self.values_of(surface) / self.values - 1).max())


def implicit_step(
    surface: DiscreteSurface, terms: Sequence[Term], conserved: Conserved, tau: float, fixed: NDArray[np.bool_]
) -> tuple[DiscreteSurface, Floats] | None:
    """The surface after a time step, and the multipliers; None if no multipliers meet the constraints.

    Parameters
    ----------
    surface
        The old surface.
    terms
        The energy.
    conserved
        The quantities to keep.
    tau
        Time step.
    fixed
        (n,) nodes that stay.
    """
    solve = _implicit_solver(surface, terms, tau, fixed)
    displacement = solve(-energy_gradient(surface, terms))
    return _solve_multipliers(
        surface, conserved, displacement, [solve(-gradient) for gradient in conserved.gradients(surface)]
    )


def restore_conserved(
    surface: DiscreteSurface, conserved: Conserved, fixed: NDArray[np.bool_], smoothing_length: float = 10.0
) -> DiscreteSurface | None:
    """A surface close by that has the values to keep; None if there is none.

    It is reached along the gradients of the conserved quantities, smoothed over so many cells, (M + s K)^-1: those of a
    rough surface are rough, and would raise a bending energy more than remeshing lowers it.
    """
    if not conserved.names:
        return surface
    free_nodes = scipy.sparse.diags_array((~fixed).astype(np.float64))
    smoothing = smoothing_length**2 * surface.area / len(surface.elements.cells)
    matrix = free_nodes @ (surface.mass_matrix + smoothing * surface.stiffness) @ free_nodes + scipy.sparse.diags_array(
        fixed * 1.0
    )
    factors = factorize(scipy.sparse.csr_matrix(matrix))
    directions = [factors.solve(np.where(fixed[:, None], 0.0, -gradient)) for gradient in conserved.gradients(surface)]
    found = _solve_multipliers(surface, conserved, np.zeros_like(surface.points), directions)
    return None if found is None else found[0]


def _solve_multipliers(
    surface: DiscreteSurface, conserved: Conserved, step: Floats, directions: list[Floats]
) -> tuple[DiscreteSurface, Floats] | None:
    """Newton's method for the multipliers of x + step + sum multiplier_i way_i."""
    multipliers = np.zeros(len(directions))
    for _ in range(_MAX_ITERATIONS):
        moved = surface.points + step
        for multiplier, direction in zip(multipliers, directions, strict=True):
            moved = moved + multiplier * direction
        new = DiscreteSurface(surface.elements, moved)
        if not directions:
            return new, multipliers
        residual = conserved.values_of(new) - conserved.values
        if (np.abs(residual) <= _MULTIPLIER_TOLERANCE * np.abs(conserved.values)).all():
            return new, multipliers
        slopes = np.array([[(g * direction).sum() for direction in directions] for g in conserved.gradients(new)])
        # On a sphere the gradients of both constraints are parallel, and the smallest multipliers are as good as any.
        change = np.linalg.lstsq(slopes, residual, rcond=1e-9)[0]
        if not np.isfinite(change).all():
            return None
        multipliers = multipliers - change
    return (new, multipliers) if conserved.error(new) <= 1e-11 else None


def _implicit_solver(
    surface: DiscreteSurface, terms: Sequence[Term], tau: float, fixed: NDArray[np.bool_]
) -> Callable[[Floats], Floats]:
    """Loads (n, 3) -> displacements (n, 3)."""
    count = len(surface.points)
    free = ~fixed
    parts = [term.stiffness(curvature_at_points(surface, terms)) for term in terms]
    bending, tension = sum(part[0] for part in parts), sum(part[1] for part in parts)
    free_nodes = scipy.sparse.diags_array(free.astype(np.float64))
    # Rows of nodes that stay are those of the identity.
    identity = scipy.sparse.diags_array(fixed.astype(np.float64))
    matrix: Any = free_nodes @ (surface.mass_matrix / tau + tension * surface.stiffness) @ free_nodes + identity
    curved = bool(np.any(np.asarray(bending) > 0))
    if curved:
        coupling = free_nodes @ surface.stiffness
        inner = surface.mass(1.0 / np.broadcast_to(bending, surface.elements.weights.shape))
        matrix = scipy.sparse.bmat([[matrix, coupling], [coupling.T, -inner]])
    factors = factorize(scipy.sparse.csr_matrix(matrix))

    def solve(loads: Floats) -> Floats:
        loads = loads * free[:, None]
        if curved:
            loads = np.concatenate([loads, np.zeros_like(loads)])
        return np.asarray(factors.solve(np.ascontiguousarray(loads))[:count])

    return solve
