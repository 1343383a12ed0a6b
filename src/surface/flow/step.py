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
from numpy.typing import NDArray
from scipy import sparse

from ..mesh import Floats, enclosed_volume, nodal_area_vectors
from .discrete import State, factorized
from .energy import curvature_at_points, energy_gradient
from .terms import Term

__all__ = ["CONSERVED", "Conserved", "implicit_step", "restored"]

CONSERVED = ("area", "volume")
_EXACT = 1e-13
_ROUNDS = 30
_SMOOTHED = 10.0  # cells over which what restores area and volume is spread


class Conserved:
    """What stays constant along a flow.

    Parameters
    ----------
    names
        "area", "volume", both, or none.
    start
        The state that has the values to keep.
    """

    def __init__(self, names: Sequence[str], start: State) -> None:
        self.names = tuple(name for name in CONSERVED if name in names)
        self.values = self.measured(start)

    def measured(self, state: State) -> Floats:
        """(k,) the conserved quantities of a state."""
        found = {"area": lambda: state.area, "volume": lambda: enclosed_volume(state.points, state.elements.cells)}
        return np.array([found[name]() for name in self.names])

    def gradients(self, state: State) -> list[Floats]:
        """k gradients (n, 3)."""
        found = {
            "area": lambda: state.area_gradient,
            "volume": lambda: nodal_area_vectors(state.points, state.elements.cells),
        }
        return [found[name]() for name in self.names]

    def error(self, state: State) -> float:
        """Largest relative deviation."""
        if not self.names:
            return 0.0
        return float(np.abs(self.measured(state) / self.values - 1).max())


def implicit_step(
    state: State, terms: Sequence[Term], conserved: Conserved, tau: float, fixed: NDArray[np.bool_]
) -> tuple[State, Floats] | None:
    """The state after a time step, and the multipliers; None if no multipliers meet the constraints.

    Parameters
    ----------
    state
        The old one.
    terms
        The energy.
    conserved
        What to keep.
    tau
        Time step.
    fixed
        (n,) nodes that stay.
    """
    solve = _solver(state, terms, tau, fixed)
    free = solve(-energy_gradient(state, terms))
    return _constrained(state, conserved, free, [solve(-gradient) for gradient in conserved.gradients(state)])


def restored(state: State, conserved: Conserved, fixed: NDArray[np.bool_]) -> State | None:
    """A state close by that has the values to keep; None if there is none.

    It is reached along the gradients of what is kept, smoothed over some cells, (M + s K)^-1: those of a rough surface
    are rough, and would raise a bending energy more than remeshing lowers it.
    """
    if not conserved.names:
        return state
    hold = sparse.diags_array((~fixed).astype(np.float64))
    smoothing = _SMOOTHED**2 * state.area / len(state.elements.cells)
    matrix = hold @ (state.mass_matrix + smoothing * state.stiffness) @ hold + sparse.diags_array(fixed * 1.0)
    factors = factorized(sparse.csr_matrix(matrix))
    ways = [factors.solve(np.where(fixed[:, None], 0.0, -gradient)) for gradient in conserved.gradients(state)]
    found = _constrained(state, conserved, np.zeros_like(state.points), ways)
    return None if found is None else found[0]


def _constrained(state: State, conserved: Conserved, step: Floats, ways: list[Floats]) -> tuple[State, Floats] | None:
    """Newton's method for the multipliers of x + step + sum multiplier_i way_i."""
    multipliers = np.zeros(len(ways))
    for _ in range(_ROUNDS):
        moved = state.points + step
        for multiplier, way in zip(multipliers, ways, strict=True):
            moved = moved + multiplier * way
        new = State(state.elements, moved)
        if not ways:
            return new, multipliers
        residual = conserved.measured(new) - conserved.values
        if (np.abs(residual) <= _EXACT * np.abs(conserved.values)).all():
            return new, multipliers
        slopes = np.array([[(g * way).sum() for way in ways] for g in conserved.gradients(new)])
        # On a sphere both constraints say the same, and the smallest multipliers are as good as any.
        change = np.linalg.lstsq(slopes, residual, rcond=1e-9)[0]
        if not np.isfinite(change).all():
            return None
        multipliers = multipliers - change
    return (new, multipliers) if conserved.error(new) <= 1e-11 else None


def _solver(state: State, terms: Sequence[Term], tau: float, fixed: NDArray[np.bool_]) -> Callable[[Floats], Floats]:
    """Loads (n, 3) -> displacements (n, 3)."""
    count = len(state.points)
    free = ~fixed
    parts = [term.stiffness(curvature_at_points(state, terms)) for term in terms]
    bending, tension = sum(part[0] for part in parts), sum(part[1] for part in parts)
    hold = sparse.diags_array(free.astype(np.float64))
    # Rows of nodes that stay are those of the identity.
    identity = sparse.diags_array(fixed.astype(np.float64))
    matrix: Any = hold @ (state.mass_matrix / tau + tension * state.stiffness) @ hold + identity
    curved = bool(np.any(np.asarray(bending) > 0))
    if curved:
        coupling = hold @ state.stiffness
        inner = state.mass(1.0 / np.broadcast_to(bending, state.elements.weights.shape))
        matrix = sparse.bmat([[matrix, coupling], [coupling.T, -inner]])
    factors = factorized(sparse.csr_matrix(matrix))

    def solve(loads: Floats) -> Floats:
        loads = loads * free[:, None]
        if curved:
            loads = np.concatenate([loads, np.zeros_like(loads)])
        return np.asarray(factors.solve(np.ascontiguousarray(loads))[:count])

    return solve
