"""Minimize the distortion of a valid mesh, or the plain energy of any: L-BFGS, Newton, or the note's method."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..elements import all_valid, cell_volumes, edge_lengths, is_valid
from ..energy import Distortion, inverse_targets, normalized_target
from ..mesh import NormalizedMesh
from ..solver import MINIMIZERS, AdmissibleDirections, Iterate, LaplacePreconditioner, Problem, initial_iterate
from .options import Options
from .step import Step

__all__ = ["Minimization"]

Field = NDArray[np.float64]

_HANDOVER = 60  # iterations of L-BFGS after which Newton takes over
_TIGHT = 1e-6  # relative gradient below which Newton is the better choice
_FLOOR = 1e-13  # gradient per node that is rounding, edges being 1
_STALL = 3e-3  # relative decrease of the energy; two iterations below it are a stall
_THIN = 0.05  # smallest volume, relative to the cube of the edges, that the metric believes in


class Minimization:
    """Minimization of the summed distortion in admissible directions; iterate to do it.

    Parameters
    ----------
    frame
        The mesh.
    admissible
        Where nodes may go.
    options
        Energy, target, weights, quadrature, method, tolerance.
    points
        (n, 3) where to start from; valid cells stay valid.

    Attributes
    ----------
    reason
        Why it stopped, in words.
    converged
        Whether the tolerance was reached.
    """

    def __init__(
        self, frame: NormalizedMesh, admissible: AdmissibleDirections, options: Options, points: Field
    ) -> None:
        self.reason, self.converged = "interrupted", False
        self._frame, self._admissible, self._options = frame, admissible, options
        self._start = points
        self._valid = is_valid(points, frame.cells)
        self._energy = self._distortion()

    def energy(self, points: Field) -> float:
        """The energy at some points; infinite where a corner is folded and the energy is a barrier."""
        return float(self._energy.cell_energies(points).sum())

    def __iter__(self) -> Iterator[Step]:
        laplacian = self._energy.laplacian(self._stiffness())
        preconditioner = LaplacePreconditioner(laplacian, self._admissible, self._frame.referenced)
        problem = Problem(self._energy, self._admissible.project, preconditioner, self._acceptable)
        at = initial_iterate(problem, self._start)
        first, slow = at.gradient_norm, 0
        if self._small(at, first):
            return
        phases = ("lbfgs", "newton") if self._options.method == "auto" else (self._options.method,)
        for phase in phases:
            for taken, following in enumerate(MINIMIZERS[phase](problem, at), 1):
                if following.step == 0.0:
                    break
                slow = slow + 1 if at.energy - following.energy < _STALL * at.energy else 0
                at = following
                yield Step(phase, at.points, at.energy, at.gradient_norm / first, at.step)
                if self._small(at, first):
                    return
                if self._options.lifts and slow == 2:
                    self.reason = "the energy stalls"
                    return
                if phase != phases[-1] and (taken == _HANDOVER or at.gradient_norm <= _TIGHT * first):
                    break
        self.reason = "no step lowers the energy further without spoiling a cell"

    def _small(self, at: Iterate, first: float) -> bool:
        """Whether the gradient is small enough."""
        norm, tolerance = at.gradient_norm, self._options.tolerance
        if norm <= tolerance * first:
            self.reason = f"gradient fell below {tolerance:g} of its start"
        elif norm <= _FLOOR * np.sqrt(len(at.points)):
            self.reason = "gradient is at the level of rounding"
        else:
            return False
        self.converged = True
        return True

    def _distortion(self) -> Distortion:
        frame, options, scales = self._frame, self._options, None
        if options.weight == "volume":
            volumes = np.abs(cell_volumes(frame.points, frame.cells))
            scales = volumes / volumes.mean()
        inverses = inverse_targets(
            normalized_target(options.target, frame), frame.points, frame.cells, options.rule, frame.cell_labels
        )
        eps = None if options.energy == "quaternionic" else 0.0
        return Distortion(frame.cells, len(frame.points), scales, inverses, eps, options.rule)

    def _stiffness(self) -> Field | None:
        """How stiff each cell is: the Hessian of E / det^(2/3) goes with det^(-2/3)."""
        if self._options.energy == "quaternionic":
            return None
        cells = self._frame.cells
        size = (edge_lengths(self._start, cells) ** 2).mean(axis=1) ** 1.5
        return np.maximum(cell_volumes(self._start, cells), _THIN * size) ** (-2.0 / 3.0)

    def _acceptable(self, points: Field) -> bool:
        """Valid cells stay valid."""
        return all_valid(points, self._frame.cells, None if self._valid.all() else np.flatnonzero(self._valid))
