"""A run for meshes of quadratic hexahedra, watched and stopped as that for linear ones is."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import MeshError, OptionError, first_names
from ...elements import QUADRATIC_TYPES
from ...io import as_volume_mesh
from ...mesh import HexMesh, MixedMesh, blocks_of, counts_by_type
from ...quality import Quality, quality, require_sound
from ..options import Options, Record
from ..report import Report
from ..run import Result
from .stages import QuadraticSchedule, QuadraticSetting, unfold_and_minimize

__all__ = ["QuadraticRegularization"]

Field = NDArray[np.float64]

_OPTIONS = ("boundary", "gradient_tolerance", "max_iterations")  # those that have an effect here


class QuadraticRegularization:
    """A run on hexahedra of 20 or 27 nodes whose boundary stays, used as a :class:`hexconformal.Regularization`.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_volume_mesh` takes, of these cells alone.
    options
        `boundary` must be "fixed"; `gradient_tolerance` and `max_iterations` count, others must have their defaults.
    schedule
        Other tuned numbers.

    Raises
    ------
    MeshError
        If the mesh cannot be worked on, or its boundary would have to slide.
    OptionError
        If an option has no effect here.

    Examples
    --------
    >>> from hexconformal import elevated
    >>> from hexconformal.generate import sheared_cube
    >>> run = QuadraticRegularization(elevated(sheared_cube(3), 27), Options(boundary="fixed"))
    >>> for record in run:
    ...     pass
    >>> run.result().report.converged
    True
    """

    def __init__(self, mesh: Any, options: Options, schedule: QuadraticSchedule | None = None) -> None:
        self._began = time.perf_counter()
        self.options = options
        taken, self._from_our_mesh = as_volume_mesh(mesh), isinstance(mesh, HexMesh | MixedMesh)
        names = [block.cell_type.name for block in blocks_of(taken)]
        counts = counts_by_type(blocks_of(taken))
        if not isinstance(taken, MixedMesh) or not set(names) <= set(QUADRATIC_TYPES):
            raise MeshError(f"a mesh must be of quadratic hexahedra alone here, and has {counts}")
        if options.boundary != "fixed":
            raise MeshError(
                f"cells of higher order: {counts}; they are worked on where the boundary stays, boundary='fixed' "
                "(--boundary fixed), or by their corners, linearize=True (--linearize)"
            )
        others = [one.name for one in fields(Options) if one.name not in _OPTIONS]
        meant = [name for name in others if not _is_default(name, getattr(options, name))]
        if meant:
            raise OptionError(f"for hexahedra of 20 or 27 nodes there is no {first_names(meant)}: leave the default")
        self.mesh: MixedMesh = taken
        self.history: list[Record] = []
        found = [finding.message for finding in require_sound(taken) if finding.kind != "higher order"]
        self._notes = (*found, *taken.notes)
        self._setting = QuadraticSetting(taken, QuadraticSchedule() if schedule is None else schedule)
        self._points = self._setting.start
        self._valid = self._setting.valid(self._points)
        self._invalid = int((~self._valid).sum())
        self._records = self._run()

    @property
    def points(self) -> Field:
        """The best points so far; what did not move is bit-identical to the input."""
        return self._setting.to_user(self._points)

    def __iter__(self) -> Iterator[Record]:
        """Run, or go on where it was left."""
        return self._records

    def _run(self) -> Iterator[Record]:
        setting, options = self._setting, self.options
        # Where a cell is invalid at first the smallest scaled Jacobian may fall as long as there are fewer of them.
        floor = float(setting.scaled_jacobians(setting.start).min()) if self._valid.all() else -np.inf
        for iteration in unfold_and_minimize(setting, options.max_iterations, options.gradient_tolerance):
            scaled, valid = setting.scaled_jacobians(iteration.points), setting.valid(iteration.points)
            invalid = int((~valid).sum())
            if not (self._valid & ~valid).any() and invalid <= self._invalid and scaled.min() >= floor:
                better = invalid < self._invalid or iteration.phase == "lbfgs"
                self._points = iteration.points if better else self._points
                self._invalid = invalid
            self.history.append(
                Record(
                    iteration=len(self.history),
                    phase=iteration.phase,
                    energy=iteration.energy,
                    gradient=iteration.gradient,
                    step=iteration.step,
                    min_scaled_jacobian=float(scaled.min()),
                    mean_scaled_jacobian=float(scaled.mean()),
                    inverted=int((scaled <= 0.0).sum()),
                    seconds=time.perf_counter() - self._began,
                )
            )
            yield self.history[-1]

    def result(self) -> Result:
        """The result so far; call it after the loop, or after an interruption."""
        before, after = quality(self.mesh), quality(self.mesh.replaced(self.points))
        points = self.points
        if before.valid.all() and after.scaled_jacobian.min() < before.scaled_jacobian.min():
            points, after = np.array(self.mesh.points), before
        shift = points - self.mesh.points
        moved, (reason, converged) = np.linalg.norm(shift, axis=1), self._ending(after, bool(shift.any()))
        report = Report(
            before=before.summary(),
            after=after.summary(),
            energy_before=self._energies()[0],
            energy_after=self._energies()[-1],
            boundary_moved=int((moved[self._setting.boundary] > 0).sum()),
            largest_displacement=float(moved.max(initial=0.0)),
            diagonal=float(np.linalg.norm(np.ptp(self.mesh.points, axis=0))),
            iterations=max(len(self.history) - 1, 0),
            seconds=time.perf_counter() - self._began,
            reason=reason,
            converged=converged,
            options=self.options.described(),
            notes=self._notes,
        )
        better = self.mesh.replaced(
            points=points,
            point_data={"moved_by": shift},
            cell_data={
                "scaled_jacobian": after.scaled_jacobian,
                "scaled_jacobian_change": after.scaled_jacobian - before.scaled_jacobian,
            },
        )
        return Result(better if self._from_our_mesh else better.to_source_type(), points, report, tuple(self.history))

    def _energies(self) -> list[float]:
        found = [record.energy for record in self.history if not np.isnan(record.energy)]
        return found or [float("nan")]

    def _ending(self, after: Quality, moved: bool) -> tuple[str, bool]:
        """Why the run is over, and whether that is by a criterion."""
        if not self._setting.free.any():
            return "every node is on the boundary, which stays", True
        bad = int((~after.valid).sum())
        last = self.history[-1] if self.history else None
        if bad:
            return f"cells that cannot be unfolded as the boundary stays: {bad}", False
        if not moved:
            return "nothing better than the input was found", True
        if last is None or len([one for one in self.history if one.phase == "lbfgs"]) >= self.options.max_iterations:
            return "limit of iterations", False
        if last.gradient <= self.options.gradient_tolerance:
            return "the gradient is small enough", True
        return "the energy falls no more", True


def _is_default(name: str, value: Any) -> bool:
    default = getattr(Options, name)
    return value is default or (isinstance(value, str | int | float) and value == default)
