"""Minimize the distortion of a valid mesh, or the quaternionic energy of any: L-BFGS, Newton, or majorization."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..elements import all_valid, cell_volumes, edge_lengths, is_valid
from ..energy import Distortion, inverse_targets, normalized_target
from ..mesh import NormalizedMesh
from ..solver import MINIMIZERS, AdmissibleDirections, Iterate, LaplacePreconditioner, Problem, initial_iterate
from .iteration import Iteration
from .options import Options

__all__ = ["Minimization"]

Field = NDArray[np.float64]

_HANDOVER = 60  # iterations of L-BFGS after which Newton takes over
_NEWTON_GRADIENT = 1e-6  # relative gradient below which Newton is the better choice
_ROUNDING = 1e-13  # gradient per node that is rounding, edges being 1
_STALL = 3e-3  # relative decrease of the energy; two iterations below it are a stall
_LEAST_VOLUME = 0.05  # smallest volume, relative to the cube of the edges, that the stiffness takes as it is


class Minimization:
    """Minimization of the summed distortion in admissible directions; iterate to do it.

    Parameters
    ----------
    normalized
        The mesh.
    admissible
        Directions nodes may go in.
    options
        Energy, target, weights, quadrature, method, tolerance.
    points
        (n, 3) where to start from; valid cells stay valid.

    Attributes
    ----------
    reason
        Reason of its end, in words.
    converged
        True where the tolerance was reached.
    """

    def __init__(
        self, normalized: NormalizedMesh, admissible: AdmissibleDirections, options: Options, points: Field
    ) -> None:
        self.reason, self.converged = "interrupted", False
        self._normalized, self._admissible, self._options = normalized, admissible, options
        self._start = points
        self._valid = is_valid(points, normalized.cells)
        self._energy = self._distortion()

    def energy(self, points: Field) -> float:
        """The energy at some points; infinite where a corner is folded and the energy is a barrier."""
        return float(self._energy.cell_energies(points).sum())

    def __iter__(self) -> Iterator[Iteration]:
        laplacian, used = self._energy.laplacian(self._stiffness()), self._normalized.referenced
        preconditioner = LaplacePreconditioner(laplacian, self._admissible, used)
        problem = Problem(self._energy, self._admissible.project, preconditioner, self._acceptable)
        at = initial_iterate(problem, self._start)
        first, slow = at.gradient_norm, 0
        if self._is_stationary(at, first):
            return
        phases = ("lbfgs", "newton") if self._options.method == "auto" else (self._options.method,)
        for phase in phases:
            for taken, following in enumerate(MINIMIZERS[phase](problem, at), 1):
                if following.step == 0.0:
                    break
                slow = slow + 1 if at.energy - following.energy < _STALL * at.energy else 0
                at = following
                yield Iteration(phase, at.points, at.energy, at.gradient_norm / first, at.step)
                if self._is_stationary(at, first):
                    return
                if self._options.raises_worst and slow == 2:
                    self.reason = "the energy stalls"
                    return
                if phase != phases[-1] and (taken == _HANDOVER or at.gradient_norm <= _NEWTON_GRADIENT * first):
                    break
        self.reason = "no step lowers the energy further without spoiling a cell"

    def _is_stationary(self, at: Iterate, first: float) -> bool:
        """True where the gradient is small enough."""
        norm, tolerance = at.gradient_norm, self._options.gradient_tolerance
        if norm <= tolerance * first:
            self.reason = f"gradient fell below {tolerance:g} of its start"
        elif norm <= _ROUNDING * np.sqrt(len(at.points)):
            self.reason = "gradient is at the level of rounding"
        else:
            return False
        self.converged = True
        return True

    def _distortion(self) -> Distortion:
        normalized, options, scales = self._normalized, self._options, None
        if options.weight == "volume":
            volumes = np.abs(cell_volumes(normalized.points, normalized.cells))
            scales = volumes / volumes.mean() if volumes.any() else None
        target, rule = normalized_target(options.target, normalized), options.quadrature_rule
        inverses = inverse_targets(target, normalized.points, normalized.cells, rule, normalized.cell_labels)
        eps = None if options.energy == "quaternionic" else 0.0
        return Distortion(normalized.cells, len(normalized.points), scales, inverses, eps, rule)

    def _stiffness(self) -> Field | None:
        """Stiffness of each cell: the Hessian of E / det^(2/3) goes with det^(-2/3)."""
        if self._options.energy == "quaternionic":
            return None
        cells = self._normalized.cells
        size = (edge_lengths(self._start, cells) ** 2).mean(axis=1) ** 1.5
        return np.maximum(cell_volumes(self._start, cells), _LEAST_VOLUME * size) ** (-2.0 / 3.0)

    def _acceptable(self, points: Field) -> bool:
        """True where the valid cells are valid still."""
        return all_valid(points, self._normalized.cells, None if self._valid.all() else np.flatnonzero(self._valid))
