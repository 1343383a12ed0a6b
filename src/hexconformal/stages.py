"""The stages of a run: minimize the distortion, then raise the worst cells; each yields steps as it goes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .assembly import Distortion
from .constraint import Constraint
from .elements import EDGES
from .frame import Frame
from .lift import lift, lift_patches
from .options import Options
from .preconditioner import Metric
from .quality import corner_scaled_jacobian
from .shaping import Shaping
from .solver import SOLVERS, Iterate, Problem, inner, start
from .target import cell_volumes, inverse_targets
from .validity import all_valid, minimum_jacobian

__all__ = ["Stages", "Step"]

Field = NDArray[np.float64]

_HANDOVER = 60  # iterations of L-BFGS after which Newton takes over
_TIGHT = 1e-6  # relative gradient below which Newton is the better choice
_FLOOR = 1e-13  # gradient per node that is rounding, edges being 1
_STALL = 3e-3  # relative decrease of the energy; two iterations below it hand over to the worst cells
_GOOD = 0.98  # smallest scaled Jacobian that needs no lifting
_WHOLE = 200_000  # cells up to which the whole mesh is lifted; beyond, patches around the worst cells
_THIN = 0.05  # smallest volume, relative to the cube of the edges, that the metric believes in


@dataclass(frozen=True)
class Step:
    """An accepted mesh: points in the run's frame, energy of the phase, relative gradient, length of the step."""

    phase: str
    points: Field
    energy: float
    gradient: float
    length: float


class Stages:
    """What a run does, in order; iterate to do it.

    Attributes
    ----------
    reason
        Why it stopped, in words.
    converged
        Whether that was a stopping criterion, not a limit.
    """

    def __init__(self, frame: Frame, constraint: Constraint, options: Options) -> None:
        self.reason, self.converged = "interrupted", False
        self._frame, self._constraint, self._options = frame, constraint, options
        self._quadrature = options.quadrature
        if options.quadrature == "auto":
            self._quadrature = "gauss" if options.energy == "quaternionic" else "corners"
        target: Any = options.target
        if not isinstance(target, str) and np.shape(target) == frame.start.shape:
            target = frame.from_user(np.asarray(target, dtype=np.float64))
        self._target = target
        self._taken = 0

    def __iter__(self) -> Iterator[Step]:
        points = self._frame.start
        for step in self._minimize():
            points = step.points
            yield step
            if self._limit():
                return
        if self._options.lifts and corner_scaled_jacobian(points, self._frame.cells).min() < _GOOD:
            yield from self._lift(points)

    def _limit(self) -> bool:
        """Whether the step just taken was the last one allowed."""
        self._taken += 1
        if self._taken > self._options.max_iterations and not self.converged:
            self.reason, self.converged = f"reached max_iterations = {self._options.max_iterations}", False
            return True
        return False

    # ------------------------------------------------------------------------------------- minimize
    def _minimize(self) -> Iterator[Step]:
        energy = self._distortion()
        problem = Problem(energy, self._constraint.project, self._metric(energy), self._acceptable)
        at = start(problem, self._frame.start)
        first = self._norm(at)
        slow = 0
        yield Step("input", at.points, at.energy, 1.0 if first else 0.0, 0.0)
        phases = ("lbfgs", "newton") if self._options.method == "auto" else (self._options.method,)
        for phase in phases:
            for taken, following in enumerate(SOLVERS[phase](problem, at), 1):
                if self._small(at, first):
                    return
                if following.step == 0.0:
                    break
                slow = slow + 1 if at.energy - following.energy < _STALL * at.energy else 0
                at = following
                yield Step(phase, at.points, at.energy, self._norm(at) / first, at.step)
                if self._options.lifts and slow == 2:
                    self.reason = "the energy stalls"
                    return
                if phase != phases[-1] and (taken == _HANDOVER or self._norm(at) <= _TIGHT * first):
                    break
        self.reason = "no step lowers the energy further without spoiling a cell"
        self._small(at, first)

    def _norm(self, at: Iterate) -> float:
        return float(np.sqrt(inner(at.gradient, at.gradient)))

    def _small(self, at: Iterate, first: float) -> bool:
        """Whether the gradient is small enough."""
        norm, tolerance = self._norm(at), self._options.tolerance
        if norm <= tolerance * first:
            self.reason = f"gradient fell below {tolerance:g} of its start"
        elif norm <= _FLOOR * np.sqrt(len(at.points)):
            self.reason = "gradient is at the level of rounding"
        else:
            return False
        self.converged = True
        return True

    def _distortion(self) -> Distortion:
        frame, scales = self._frame, None
        if self._options.weight == "volume":
            volumes = np.abs(cell_volumes(frame.start, frame.cells))
            scales = volumes / volumes.mean()
        eps = None if self._options.energy == "quaternionic" else self._eps()
        inverses = inverse_targets(self._target, frame.start, frame.cells, self._quadrature)
        return Distortion(frame.cells, len(frame.start), scales, inverses, eps, self._quadrature)

    def _eps(self) -> float:
        # No eps where nothing is folded; else enough to see over the fold.
        smallest = float(minimum_jacobian(self._frame.start, self._frame.cells)[1].min())
        return 0.0 if self._frame.valid.all() else float(np.sqrt(1e-8 + 0.04 * smallest**2))

    def _metric(self, energy: Distortion) -> Metric:
        frame, scales = self._frame, None
        if self._options.energy == "barrier":
            # The Hessian of E / det^(2/3) goes with det^(-2/3); an inverted cell counts as a thin one.
            edges = np.diff(frame.start[frame.cells[:, EDGES]], axis=2)
            size = (edges**2).sum(axis=-1).mean(axis=(1, 2)) ** 1.5
            scales = np.maximum(cell_volumes(frame.start, frame.cells), _THIN * size) ** (-2.0 / 3.0)
        return Metric(energy.laplacian(scales), self._constraint, frame.used)

    def _acceptable(self, points: Field) -> bool:
        """Valid cells stay valid."""
        valid = self._frame.valid
        return all_valid(points, self._frame.cells, None if valid.all() else np.flatnonzero(valid))

    # ------------------------------------------------------------------------------------------ lift
    def _lift(self, points: Field) -> Iterator[Step]:
        frame = self._frame
        shaping = self._shaping()
        if not shaping.free.any() or not np.isfinite(shaping.measures(points).angle).all():
            return
        stages = lift if len(frame.cells) <= _WHOLE else lift_patches
        for phase, points, energy in stages(shaping, points):
            yield Step(phase, points, energy, float("nan"), 1.0)
            if self._limit():
                return
        self.reason, self.converged = "the worst cell stalls", True

    def _shaping(self) -> Shaping:
        frame = self._frame
        inverses = inverse_targets(self._target, frame.start, frame.cells, "corners")
        return Shaping(
            frame.cells,
            np.empty((0, 1, 3, 3)) if inverses is None else inverses,
            self._constraint.projections(len(frame.start)),
        )
