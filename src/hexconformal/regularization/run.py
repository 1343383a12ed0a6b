"""Regularize a mesh: the main job, from whatever the user has to a better mesh and a report."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError
from ..elements import corner_scaled_jacobian, corner_shape
from ..formulation import Iteration, Schedules
from ..geometry import sharp_length
from ..io import as_volume_mesh
from ..mesh import HexMesh, MixedMesh, NormalizedMesh, collapsed_mesh, region_arrays
from ..quality import quality, require_linear, require_sound
from ..ranks import require_alike
from .acceptance import (
    Outcome,
    auto_target_notes,
    distances,
    keeps_worst,
    limit_notes,
    mean_boundary_distance,
    no_worse_than,
    size_ratios,
    swells,
    with_volume_restored,
)
from .boundary import Boundary, boundary_of
from .on_ranks import MeshOnRanks
from .options import Options, Record
from .region_rows import interface_rows, region_rows
from .report import Report, Result
from .resuming import Start, begun_at
from .setting import Setting
from .stages import Stages

__all__ = ["Regularization"]

Field = NDArray[np.float64]


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
    start
        Where to begin: what an earlier run of the same mesh has :meth:`reached`, its (n, 3) points, or a mesh with
        the same nodes. Surface, features, sizes and targets, and what the report calls before, are those of `mesh`.

    Attributes
    ----------
    options, mesh
        Options and mesh of the run, the mesh as a :class:`hexconformal.HexMesh` or MixedMesh.
    history
        The records so far.

    Raises
    ------
    MeshError
        If the mesh cannot be worked on, or the start: it inverts valid cells, moves nodes that are held, or leaves the
        bound.
    OptionError
        If options make no sense, alone or together, or the start is no point for each node.

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
        self,
        mesh: Any,
        options: Options | None = None,
        schedules: Schedules | None = None,
        comm: Any = None,
        start: Any = None,
    ) -> None:
        self._began = time.perf_counter()
        self.options = Options() if options is None else options
        self.history: list[Record] = []
        schedules = Schedules() if schedules is None else schedules
        self.mesh: HexMesh | MixedMesh
        self._normalized: NormalizedMesh
        self._boundary: Boundary
        require_alike(comm, start=None if start is None else ())
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
        if start is not None:
            begun = begun_at(start, self._setting, self._boundary, self._on_ranks)
            self._setting, self._boundary, self._may_end_at_start = begun
            self._notes = (*self._notes, "begun where an earlier run had come to")
        if self._on_ranks is not None:
            self._on_ranks.require_stages(self._setting)
        self._stages = Stages(self._setting, self._boundary)
        self._points, self._energy, self._lowered = self._normalized.points, float("nan"), False
        self._least: Record | None = None
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
            if self._acceptable(record) and (self._least is None or keeps_worst(record, self._least)):
                self._points, self._energy = iteration.points, record.energy
                self._lowered = self._stages.state.lowered or self._setting.lowered
                if iteration.phase == "start" and self._may_end_at_start:
                    self._least = record
            yield record

    def reached(self, result: Result | None = None) -> Start | None:
        """What another run of the same mesh goes on from: the best points so far, or those of a result of this run.

        On ranks, all of which must call it, each has its own nodes. None where there is nothing better than the input.

        Examples
        --------
        >>> from itertools import islice
        >>> from hexconformal.generate import sheared_cube
        >>> mesh = sheared_cube(6)
        >>> run = Regularization(mesh)
        >>> for record in islice(run, 5):
        ...     pass
        >>> again = Regularization(mesh, start=run.reached())
        >>> [record.phase for record in islice(again, 2)]
        ['input', 'start']
        """
        if result is None and self._points is self._normalized.points:
            return None
        whole, points = self._on_ranks, self._normalized.to_user(self._points)
        if result is not None:
            points = result.points if whole is None else result.mesh.points
        if whole is None:
            return Start(points, self._lowered, result is None)
        own = self._normalized.space.own
        return Start(own(points), self._lowered, result is None, own(whole.mesh.node_ids))

    def result(self) -> Result:
        """The result so far; call it after the loop, or after an interruption."""
        if self._on_ranks is not None:
            outcome = self._outcome()
            told = self._stages.state, self.history, self._all_notes(outcome), time.perf_counter() - self._began
            piece, report = self._on_ranks.result(outcome, *told)
            return Result(piece, self._on_ranks.to_given_nodes(piece.points), report, tuple(self.history), self.mesh)
        outcome = self._outcome()
        points = outcome.points
        before, after = quality(self.mesh), quality(self.mesh.replaced(points=points))
        shift = points - self.mesh.points
        moved = np.linalg.norm(shift, axis=1)
        mesh, diagonal = self._normalized.mesh, self._normalized.diagonal * self._normalized.unit
        regions = self._setting.regions
        interfaces, notes = ((), []) if regions is None else interface_rows(regions, mesh, points, diagonal)
        report = Report(
            before=before.summary(),
            after=after.summary(),
            energy_before=self.history[0].energy if self.history else float("nan"),
            energy_after=outcome.energy,
            boundary_moved=int((moved[np.unique(self._normalized.node_ids[self._normalized.quads])] > 0).sum()),
            largest_displacement=float(moved.max(initial=0.0)),
            diagonal=diagonal,
            iterations=max(len(self.history) - 1, 0),
            seconds=time.perf_counter() - self._began,
            reason=outcome.reason,
            converged=self._stages.state.converged and not outcome.goes_back,
            options=self.options.described(),
            notes=(*self._all_notes(outcome), *notes),
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
        """The points the run comes to; those it began with where no better mesh keeps what is promised."""
        normalized, boundary, options = self._normalized, self._stages.state.boundary, self.options
        (points, notes), reason = self._final_points(), self._stages.state.reason
        first, begun, energy = self._safe
        if points is first and len(self.history) > 1:
            reason += f"; nothing better than the {begun} was found"
        far = distances(points, normalized, boundary, options)
        beyond = far.beyond(options)
        if beyond is not None:
            what, much = beyond
            reason = f"{what} would move by {much:.4g}: the {begun} is returned; allow more (hausdorff)"
            points, notes = first, []
            far = distances(points, normalized, boundary, options)
        elif options.boundary == "slide" and far.surface > options.hausdorff:
            notes.append(
                f"the surface is not followed within the bound of {options.hausdorff:g} diagonals, the largest "
                f"distance is {far.surface:.4g}: allow more than that, or take smaller cells where it bends"
            )
        mean = mean_boundary_distance(points, normalized, boundary) if far.surface > 0.0 else 0.0
        energy = energy if points is first else self._energy
        return Outcome(normalized.to_user(points), energy, reason, far.surface, mean, tuple(notes), beyond is not None)

    @property
    def _safe(self) -> tuple[Field, str, float]:
        """The points that there are in any case, what they are, and their energy: the start, if a run may end there."""
        if self._least is None:
            return self._normalized.points, "input", self.history[0].energy if self.history else float("nan")
        return self._setting.first, "start", self._least.energy

    def _brought_back(self, points: Field) -> Field:
        """The points, with the boundary within its bound where the run was left before it was, and that can be."""
        back = self._stages.brought_back(points)
        acceptable = back is not points and self._setting.keeps_valid(back)
        return back if acceptable and self._acceptable(self._record(Iteration("return", back))) else points

    def _all_notes(self, outcome: Outcome) -> tuple[str, ...]:
        notes = [*self._notes, *self._stages.state.boundary.notes, *self._stages.state.notes]
        if isinstance(self.options.target, str) and self.options.target == "auto":
            notes += auto_target_notes(self._normalized)
        held = np.asarray(~self._stages.state.boundary.admissible.all_projectors(len(self._points)).any(axis=(1, 2)))
        start = self._stages.state.boundary.start
        start = self._normalized.points if start is None else start
        notes += limit_notes(self._normalized, start, held, outcome.points[self._normalized.node_ids])
        return (*notes, *outcome.notes)

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
