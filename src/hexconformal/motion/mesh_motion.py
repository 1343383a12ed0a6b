"""Move a mesh with its boundary, step after step, for simulations whose domain moves (ALE, fluid-structure)."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import (
    MeshError,
    OptionError,
    array_of_numbers,
    as_mask,
    first_ids,
    is_number,
    require_choice,
    require_number,
)
from ..elements import all_valid, corner_scaled_jacobian, is_valid
from ..energy import Distortion, inverse_targets
from ..io import as_hex_mesh
from ..mesh import NormalizedMesh
from ..quality import require_sound
from ..solver import (
    AdmissibleDirections,
    Iterate,
    Problem,
    fixed_components,
    initial_iterate,
    lbfgs,
    planar_normal_sums,
)
from .extension import EXTENSIONS

__all__ = ["MeshMotion", "MotionReport", "MotionStep"]

Field = NDArray[np.float64]

_SMALLEST = 2.0**-10  # share of a step below which it is given up
_LOOSE = 1e-3  # tolerance where the way only passes through
_ITERATIONS = 500
_EXACT, _PREDICTION = 1e-9, 1e-3  # tolerances of a linear operator, and of a first guess

OPERATORS = ("conformal", *EXTENSIONS)


@dataclass(frozen=True)
class MotionReport:
    """How a step went.

    Attributes
    ----------
    reached
        Share of the step that was made, 1 unless it was refused.
    substeps, iterations
        What it took.
    min_scaled_jacobian, mean_scaled_jacobian
        Of the corners of the cells, after the step.
    blocked
        Cells that would be inverted by going on; empty unless the step was refused.
    reason
        Why it was refused, in words; "" otherwise.
    seconds
        Wall time.
    """

    reached: float
    substeps: int
    iterations: int
    min_scaled_jacobian: float
    mean_scaled_jacobian: float
    blocked: NDArray[np.int64]
    reason: str
    seconds: float

    @property
    def refused(self) -> bool:
        """Whether the boundary could not go all the way."""
        return self.reached < 1.0


@dataclass(frozen=True)
class MotionStep:
    """A mesh that has moved.

    Attributes
    ----------
    points
        (n, 3) all of them, in their old order.
    velocity
        (n, 3) the way of this step over its time, equation (28); None where no time was given.
    report
        How it went.
    """

    points: Field
    velocity: Field | None
    report: MotionReport


class MeshMotion:
    """Keeps a mesh valid and good while its boundary moves.

    What belongs to the topology is set up once; each step starts from the last position. Nodes keep their numbers.
    Every mesh that is returned is valid (det J > 0 everywhere), or the step is refused before it would not be.

    Parameters
    ----------
    mesh
        A valid mesh, anything :func:`hexconformal.as_hex_mesh` takes.
    moving
        Nodes whose displacement will be given: ids, in the order of the displacements, or (n,) booleans.
    fixed
        Nodes that stay: ids, booleans (n,) or per component (n, 3), or the name of a point array. Other nodes of
        the boundary slide on its flat faces and along its straight edges, and stay where it is curved.
    reference
        What the cells shall look like: "initial", as they came, so that nothing adds up over a run and the way back
        leads to the initial mesh; or "current", as at the last step.
    operator
        "conformal" minimizes the quaternionic conformal distortion against the reference; "harmonic" and
        "elastic" extend the displacement by a linear problem, as is usual, and may end early.
    tolerance
        An iteration that lowers the energy by less than this, relatively, is the last.

    Attributes
    ----------
    mesh, moving, held
        The mesh as it came, ids (k,) of the moving nodes, and components (n, 3) that are given or stay.
    notes
        What is doubtful about the mesh, in words.

    Raises
    ------
    MeshError
        If the mesh cannot be worked on, or is not valid.
    OptionError
        If an option makes no sense.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> points, cells = box((4, 4, 4), (4.0, 4.0, 4.0))
    >>> lid = np.flatnonzero(points[:, 2] == 4)
    >>> motion = MeshMotion((points, cells), moving=lid)
    >>> step = motion.step(np.tile([1.0, 0.0, 0.5], (len(lid), 1)), dt=0.1)
    >>> step.report.reached, step.points[lid].max(axis=0).tolist(), step.velocity.max().round(6)
    (1.0, [5.0, 4.0, 4.5], np.float64(10.0))
    """

    def __init__(
        self,
        mesh: Any,
        moving: Any,
        fixed: Any = None,
        reference: str = "initial",
        operator: str = "conformal",
        tolerance: float = 1e-6,
    ) -> None:
        require_choice("reference", reference, ("initial", "current"))
        require_choice("operator", operator, OPERATORS)
        require_number("tolerance", tolerance)
        if not 0.0 < tolerance < 1.0:
            raise OptionError(f"tolerance lies in (0, 1), not {tolerance!r}")
        self.mesh = as_hex_mesh(mesh)
        self.notes = tuple(finding.message for finding in require_sound(self.mesh))
        self._frame = frame = NormalizedMesh(self.mesh)
        if not frame.valid.all():
            raise MeshError(
                f"a mesh that moves is valid at the start: {first_ids(np.flatnonzero(~frame.valid))} are not"
            )
        self.moving = _ids(moving, len(frame.points))
        self._reference, self._operator, self._tolerance = reference, operator, tolerance
        driven = np.zeros((len(frame.points), 1), dtype=bool)
        driven[self.moving] = True
        self.held = fixed_components(self.mesh, fixed) | driven
        sums = planar_normal_sums(frame.points, frame.quads)
        self._admissible = AdmissibleDirections.from_normal_sums(sums, self.held)
        linear = operator != "conformal"
        self._extension = EXTENSIONS[operator if linear else "harmonic"](
            frame, self._admissible, _EXACT if linear else _PREDICTION
        )
        self._energy = self._distortion(frame.points)
        self._points = frame.points
        self._driven = np.zeros((len(self.moving), 3))

    @property
    def options(self) -> str:
        """Operator, reference and tolerance, in words."""
        return f"{self._operator}, {self._reference}, {self._tolerance:g}"

    @property
    def points(self) -> Field:
        """(n, 3) where the nodes are."""
        return self._frame.to_user(self._points)

    def step(self, displacement: ArrayLike, dt: float | None = None) -> MotionStep:
        """Move the boundary, and the mesh with it.

        Parameters
        ----------
        displacement
            (k, 3) displacement of the moving nodes from their initial place, in the order they were given in.
        dt
            Time the step takes, for the velocity.

        Returns
        -------
        MotionStep
            The mesh where it is now: at the end of the step, or, if that was refused, as far as it went.

        Raises
        ------
        OptionError
            If the displacement has another shape or is not finite, or `dt` is not positive and finite.
        """
        began = time.perf_counter()
        goal = array_of_numbers("displacement", displacement)
        if goal.shape != self._driven.shape or not np.isfinite(goal).all():
            raise OptionError(f"the displacement is a finite array {self._driven.shape}, not {goal.shape}")
        if dt is not None and not (is_number(dt) and 0 < dt < np.inf):
            raise OptionError(f"dt is positive and finite, not {dt!r}")
        before, origin = self.points, self._driven
        goal = goal / self._frame.unit
        if self._reference == "current":
            self._energy = self._distortion(self._points)
        reached, share, substeps, iterations = 0.0, 1.0, 0, 0
        blocked = np.empty(0, dtype=np.int64)
        while reached < 1.0 and share >= _SMALLEST:
            share = min(share, 1.0 - reached)
            last = reached + share >= 1.0
            part = goal if last else origin + (reached + share) * (goal - origin)
            found = self._moved(part, self._tolerance if last else _LOOSE)
            if isinstance(found, tuple):
                self._points, taken = found
                self._driven, reached = part, 1.0 if last else reached + share
                substeps, iterations = substeps + 1, iterations + taken
                share *= 2
            else:
                blocked = found
                share /= 2
        good = corner_scaled_jacobian(self._points, self._frame.cells)
        points = self.points
        report = MotionReport(
            reached=reached,
            substeps=substeps,
            iterations=iterations,
            min_scaled_jacobian=float(good.min()),
            mean_scaled_jacobian=float(good.mean()),
            blocked=blocked if reached < 1.0 else np.empty(0, dtype=np.int64),
            reason="" if reached == 1.0 else self._why(reached, blocked),
            seconds=time.perf_counter() - began,
        )
        return MotionStep(points, None if dt is None else (points - before) / dt, report)

    def state(self) -> dict[str, Field]:
        """Where the mesh stands, for a restart with :meth:`resume`."""
        return {"points": self._points.copy(), "driven": self._driven.copy()}

    def resume(self, state: Mapping[str, ArrayLike]) -> None:
        """Go on from where another run, of the same mesh and options, stood.

        Parameters
        ----------
        state
            What :meth:`state` gave.

        Raises
        ------
        OptionError
            If it belongs to another mesh.
        """
        points, driven = (np.asarray(state[name], dtype=np.float64) for name in ("points", "driven"))
        if points.shape != self._points.shape or driven.shape != self._driven.shape:
            raise OptionError("this belongs to another mesh, or to other moving nodes")
        self._points, self._driven = points.copy(), driven.copy()

    def _distortion(self, points: Field) -> Distortion:
        frame = self._frame
        inverses = inverse_targets("input", points, frame.cells, "corners")
        return Distortion(frame.cells, len(points), None, inverses, 0.0, "corners")

    def _moved(self, driven: Field, tolerance: float) -> tuple[Field, int] | NDArray[np.int64]:
        """The mesh with its boundary there and the iterations that took; or the cells that stand in the way."""
        frame = self._frame
        if self._reference == "initial" and not driven.any():
            return frame.points, 0
        if self._operator == "harmonic":
            guess = self._guess(frame.points, driven)
        else:
            guess = self._guess(self._points, driven - self._driven)
        bad = ~is_valid(guess, frame.cells)
        if bad.any():
            return np.flatnonzero(bad)
        return self._minimized(guess, tolerance) if self._operator == "conformal" else (guess, 1)

    def _guess(self, points: Field, change: Field) -> Field:
        """The points moved by a linear extension of the change of the boundary."""
        field = np.zeros_like(points)
        field[self.moving] = change
        return points + self._extension(field, points)

    def _minimized(self, points: Field, tolerance: float) -> tuple[Field, int]:
        cells = self._frame.cells
        project, preconditioner = self._admissible.project, self._extension.preconditioner
        problem = Problem(self._energy, project, preconditioner, lambda points: all_valid(points, cells))
        at: Iterate = initial_iterate(problem, points)
        taken = 0
        for taken, following in enumerate(lbfgs(problem, at), 1):
            decrease, at = at.energy - following.energy, following
            if decrease <= tolerance * at.energy or taken == _ITERATIONS:
                break
        return at.points, taken

    def _why(self, reached: float, blocked: NDArray[np.int64]) -> str:
        return (
            f"the boundary stopped after {reached:.0%} of the step: going on would invert cells {first_ids(blocked)}; "
            "take shorter steps, free more of the boundary, or remesh"
        )


def _ids(moving: Any, count: int) -> NDArray[np.int64]:
    """The moving nodes in the order given."""
    mask = as_mask(moving, count, "moving")
    if mask.ndim != 1:
        raise OptionError("moving holds whole nodes: ids, or one boolean per point")
    given = np.asarray([] if moving is None else moving)
    ids = np.flatnonzero(mask) if given.dtype == bool else given.astype(np.int64).ravel()
    if len(np.unique(ids)) < len(ids):
        raise OptionError("moving names a node twice")
    if len(ids) == 0:
        raise OptionError("nothing moves: moving is empty")
    return ids
