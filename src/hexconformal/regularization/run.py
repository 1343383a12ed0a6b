"""Regularize a mesh: the main job, from whatever the user has to a better mesh and a report."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError
from ..elements import corner_scaled_jacobian, corner_shape
from ..formulation import Iteration, Schedules
from ..geometry import sharp_length
from ..io import as_volume_mesh
from ..mesh import HexMesh, MixedMesh, NormalizedMesh, collapsed_mesh, region_arrays
from ..page import Curve, Frame, HasPage, Page, columns_of, curves_of, volume_page
from ..quality import attainable_scaled_jacobian, quality, require_linear, require_sound
from .acceptance import (
    Outcome,
    auto_target_notes,
    boundary_distance,
    mean_boundary_distance,
    no_worse_than,
    sheets_distance,
    size_ratios,
    swells,
    with_volume_restored,
)
from .boundary import Boundary, boundary_of
from .on_ranks import MeshOnRanks
from .options import Options, Record
from .region_rows import interface_rows, region_rows
from .report import Report
from .setting import Setting
from .stages import Stages

__all__ = ["Regularization", "Result"]

Field = NDArray[np.float64]

_CURVES = (
    Curve("energy", ("energy",), logarithmic=True),
    Curve("scaled Jacobian", ("mean_scaled_jacobian", "min_scaled_jacobian")),
    Curve("smallest shape", ("min_shape",)),
    Curve("inverted cells", ("inverted",)),
)
_NOTED_BELOW = 0.95  # a bound of the smallest scaled Jacobian above this says little


@dataclass(frozen=True, repr=False)
class Result(HasPage):
    """The mesh that a run comes to, its report and history; in a notebook it is shown to look at.

    Attributes
    ----------
    mesh
        The better mesh, in the type that came in, with everything it carried.
    points
        (n, 3) its points.
    report
        Before and after, what moved, and why it stopped.
    history
        One record per iteration.
    before
        The mesh that went in, as a :class:`hexconformal.HexMesh` or MixedMesh.
    interfaces
        What tells its regions apart, as in :class:`hexconformal.Options`.
    """

    mesh: Any
    points: Field
    report: Report
    history: tuple[Record, ...]
    before: HexMesh | MixedMesh
    interfaces: Any = "auto"

    def __repr__(self) -> str:
        return f"Result({len(self.points)} points, {self.report.after.count} cells: {self.report.reason})"

    @property
    def converged(self) -> bool:
        """True where the run ended by a stopping criterion, not a limit."""
        return self.report.converged

    def page(self, frames: Sequence[Frame] = ()) -> Page:
        """The page of the result, with frames of iterations between input and result if they are there."""
        columns, last = columns_of(self.history), self.history[-1].iteration if self.history else 0
        return volume_page(
            self.before,
            self.before.replaced(self.points, point_data={"moved_by": self.points - self.before.points}),
            frames=frames,
            ends=(("before", 0.0), ("after", float(last))),
            report=self.report,
            curves=curves_of(columns, "iteration", "iterations", _CURVES),
            interfaces=self.interfaces,
        )


class Regularization:
    """A run that can be watched: iterate over its records, stop whenever you like, then take the result.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_volume_mesh` takes.
    options
        Options of the run; the defaults suit an unknown mesh.
    schedules
        Other tuned numbers than those the benchmarks were made with.
    comm
        An MPI communicator: every rank hands in its :class:`hexconformal.ranks.MeshPiece`, and iterates.

    Attributes
    ----------
    options, mesh
        Options and mesh of the run, the mesh as a :class:`hexconformal.HexMesh` or MixedMesh.
    history
        The records so far.

    Raises
    ------
    MeshError
        If the mesh cannot be worked on.
    OptionError
        If options make no sense, alone or together.

    Examples
    --------
    >>> from hexconformal.generate import sheared_cube
    >>> run = Regularization(sheared_cube(6))
    >>> for record in run:
    ...     if record.min_scaled_jacobian > 0.99:
    ...         break
    >>> bool(run.result().report.after.scaled_jacobian.min > 0.99)
    True
    """

    def __init__(
        self, mesh: Any, options: Options | None = None, schedules: Schedules | None = None, comm: Any = None
    ) -> None:
        self._began = time.perf_counter()
        self.options = Options() if options is None else options
        self.history: list[Record] = []
        schedules = Schedules() if schedules is None else schedules
        self.mesh: HexMesh | MixedMesh
        self._normalized: NormalizedMesh
        self._boundary: Boundary
        self._on_ranks = None if comm is None else MeshOnRanks(mesh, self.options, schedules, comm)
        if self._on_ranks is not None:
            whole = self._on_ranks
            self.mesh, self._normalized, self._boundary = whole.mesh, whole.normalized, whole.boundary
            self._notes, self._from_our_mesh = whole.notes, True
        else:
            self.mesh, self._from_our_mesh = as_volume_mesh(mesh), isinstance(mesh, HexMesh | MixedMesh)
            self._notes = (*(finding.message for finding in require_sound(self.mesh)), *self.mesh.notes)
            require_linear(self.mesh)
            self._normalized = NormalizedMesh(collapsed_mesh(self.mesh), ordered=True)
            self._boundary = boundary_of(self._normalized, self.options, schedules)
        if self.options.energy == "quaternionic" and self._boundary.barrier is None and self._is_free:
            raise OptionError(
                "with a free boundary the quaternionic energy shrinks the mesh to a point: fix two nodes or more, or "
                "use energy='barrier'"
            )
        self._setting = Setting(self._normalized, self.options, schedules)
        if self._on_ranks is not None:
            self._on_ranks.require_stages(self._setting)
        self._stages = Stages(self._setting, self._boundary)
        self._points, self._energy = self._normalized.points, float("nan")
        self._records = self._run()

    @property
    def _is_free(self) -> bool:
        """True where fewer nodes are constrained than hold a mesh in its place and size."""
        constrained = np.zeros(len(self._normalized.points), dtype=bool)
        constrained[self._boundary.admissible.nodes] = True
        return self._normalized.space.total(self._normalized.space.own(constrained).sum()) < 2

    @property
    def points(self) -> Field:
        """The best points so far, in the user's unit and order; what did not move is bit-identical to the input."""
        points = self._normalized.to_user(self._points)
        return points if self._on_ranks is None else self._on_ranks.to_given_nodes(points)

    def __iter__(self) -> Iterator[Record]:
        """Run, or go on where it was left; every record's mesh is acceptable, so that may be at any of them."""
        return self._records

    def _run(self) -> Iterator[Record]:
        for iteration in self._stages:
            record = self._record(iteration)
            self.history.append(record)
            if self._acceptable(record):
                self._points, self._energy = iteration.points, record.energy
            yield record

    def result(self) -> Result:
        """The result so far; call it after the loop, or after an interruption."""
        if self._on_ranks is not None:
            outcome = self._outcome()
            told = self._stages.state, self.history, self._all_notes(), time.perf_counter() - self._began
            piece, report = self._on_ranks.result(outcome, *told)
            return Result(piece, self._on_ranks.to_given_nodes(piece.points), report, tuple(self.history), self.mesh)
        outcome = self._outcome()
        points = outcome.points
        before, after = quality(self.mesh), quality(self.mesh.replaced(points=points))
        shift = points - self.mesh.points
        moved = np.linalg.norm(shift, axis=1)
        energy = self.history[0].energy if self.history else float("nan")
        mesh, diagonal = self._normalized.mesh, self._normalized.diagonal * self._normalized.unit
        regions = self._setting.regions
        interfaces, notes = ((), []) if regions is None else interface_rows(regions, mesh, points, diagonal)
        report = Report(
            before=before.summary(),
            after=after.summary(),
            energy_before=energy,
            energy_after=self._energy if shift.any() else energy,
            boundary_moved=int((moved[np.unique(self._normalized.node_ids[self._normalized.quads])] > 0).sum()),
            largest_displacement=float(moved.max(initial=0.0)),
            diagonal=diagonal,
            iterations=max(len(self.history) - 1, 0),
            seconds=time.perf_counter() - self._began,
            reason=outcome.reason,
            converged=self._stages.state.converged and not outcome.is_input,
            options=self.options.described(),
            notes=(*self._all_notes(), *outcome.notes, *notes),
            hausdorff=outcome.distance,
            mean_distance=outcome.mean_distance,
            sharp_edges=(self._sharp_length(self.mesh.points), self._sharp_length(points)),
            size_ratios=size_ratios(after.volume[self._normalized.cell_ids], self._setting.target_volumes),
            regions=() if regions is None else region_rows(regions, before, after),
            interfaces=interfaces,
        )
        better = self.mesh.replaced(
            points=points,
            point_data={"moved_by": shift},
            cell_data={
                "scaled_jacobian": after.scaled_jacobian,
                "scaled_jacobian_change": after.scaled_jacobian - before.scaled_jacobian,
                **region_arrays(mesh, regions),
            },
        )
        better = better if self._from_our_mesh else better.to_source_type()
        return Result(better, points, report, tuple(self.history), self.mesh, self.options.interfaces)

    def _sharp_length(self, points: Field) -> float:
        """Length of the sharp edges of the boundary of the user's mesh."""
        return sharp_length(points, self._normalized.node_ids[self._normalized.quads])

    def _acceptable(self, record: Record) -> bool:
        """True where this is no worse than the input; another surface to slide on, or other sizes, may cost quality."""
        first = self.history[0]
        if self.options.surface is not None or self.options.changes_sizes:
            return record.inverted <= first.inverted
        return not self.options.raises_worst or no_worse_than(record, first)

    def _final_points(self) -> tuple[Field, list[str]]:
        """The points the run comes to, brought back, with its volume given back, and what that took."""
        normalized, points, notes = self._normalized, self._points, list[str]()
        if points is not normalized.points:
            points = self._brought_back(points)
        formulation, asked = self._stages.state.formulation, self.options.conserve_volume
        by_barrier, changed = self.options.constraint == "barrier", points is not normalized.points
        if changed and (asked or (by_barrier and swells(points, normalized, formulation))):
            regions = self._setting.regions if asked else None
            same, notes = with_volume_restored(points, normalized, formulation, regions)
            if self._setting.keeps_valid(same) and self._acceptable(self._record(Iteration("volume", same))):
                points = same
            else:
                points, notes = (normalized.points if asked else points), []
        return points, notes

    def _outcome(self) -> Outcome:
        """The points the run comes to; the input where no better mesh keeps what is promised."""
        normalized, boundary, bound = self._normalized, self._stages.state.boundary, self.options.hausdorff
        (points, notes), reason = self._final_points(), self._stages.state.reason
        if points is normalized.points and len(self.history) > 1:
            reason += "; nothing better than the input was found"
        moved = boundary_distance(points, normalized, boundary, self.options.boundary)
        between = sheets_distance(points, normalized, boundary, bound)
        if between > bound:
            return Outcome.too_far(self.mesh.points, "an interface", between)
        if self.options.boundary == "slide" and moved > bound:
            if boundary.reference is None:
                return Outcome.too_far(self.mesh.points, "the surface", moved)
            notes.append(
                f"the surface is not followed within the bound of {bound:g} diagonals, the largest distance is "
                f"{moved:.4g}: allow more than that, or take smaller cells where it bends"
            )
        mean = mean_boundary_distance(points, normalized, boundary) if moved > 0.0 else 0.0
        return Outcome(normalized.to_user(points), reason, moved, mean, tuple(notes))

    def _brought_back(self, points: Field) -> Field:
        """The points, with the boundary within its bound where the run was left before it was, and that can be."""
        back = self._stages.brought_back(points)
        acceptable = back is not points and self._setting.keeps_valid(back)
        return back if acceptable and self._acceptable(self._record(Iteration("return", back))) else points

    def _all_notes(self) -> tuple[str, ...]:
        notes = [*self._notes, *self._stages.state.boundary.notes, *self._stages.state.notes]
        if isinstance(self.options.target, str) and self.options.target == "auto":
            notes += auto_target_notes(self._normalized)
        held = np.asarray(~self._stages.state.boundary.admissible.all_projectors(len(self._points)).any(axis=(1, 2)))
        start = self._stages.state.boundary.start
        start = self._normalized.points if start is None else start
        bound, cell = attainable_scaled_jacobian(start, self._normalized.cells, held)
        lowest = self._normalized.space.smallest(np.array([bound]))
        if lowest < _NOTED_BELOW:
            which = self._normalized.space.named(None if bound > lowest else self._normalized.cell_labels[cell])
            bound = lowest
            notes.append(f"the smallest scaled Jacobian cannot exceed {bound:.4g}: a corner of cell {which} is held")
        return tuple(notes)

    def _record(self, iteration: Iteration) -> Record:
        space = self._normalized.space
        scaled_jacobian = corner_scaled_jacobian(iteration.points, self._normalized.cells)
        inverted, energy = int(space.total((scaled_jacobian <= 0).sum())), iteration.energy
        if np.isnan(energy):
            energy = space.total(self._setting.distortion.value(iteration.points))
        if inverted and self.options.energy == "barrier":
            energy = float("nan")  # rounding may leave a flat corner a finite one
        return Record(
            iteration=len(self.history),
            phase=iteration.phase,
            energy=energy * (self._normalized.unit**2 if self.options.energy == "quaternionic" else 1.0),
            gradient=iteration.gradient,
            step=iteration.step,
            min_scaled_jacobian=space.smallest(scaled_jacobian),
            mean_scaled_jacobian=space.mean(scaled_jacobian),
            inverted=inverted,
            seconds=time.perf_counter() - self._began,
            flat=int(space.total(self._setting.flat(iteration.points).sum())),
            min_shape=space.smallest(corner_shape(iteration.points, self._normalized.cells)),
            worst_gain=self._setting.worst_gain(scaled_jacobian),
        )
