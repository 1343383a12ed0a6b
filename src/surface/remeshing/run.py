"""Remeshing of a surface, from what the user has to a better mesh and a report."""

from __future__ import annotations

import time
from collections.abc import Iterator
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexconformal.common import first_ids
from hexconformal.geometry import edge_table, enclosed_volume, face_areas, mean_edge_length

from ..constraint import find_features, find_interfaces
from ..energy import Barrier, Quaternionic, SurfaceEnergy, target_shapes
from ..io import as_surface_mesh
from ..mesh import Floats, SurfaceMesh
from ..quality import held_nodes, quality, require_sound, smallest_angles
from .acceptance import Acceptance
from .approach import approach
from .descent import Iterate, Termination, descend
from .options import Options, Record
from .problem import RemeshingProblem
from .pull_back import pull_back
from .report import Report
from .result import Result
from .schedules import Schedules

__all__ = ["Remeshing"]


class Remeshing:
    """An iterable run: iterate over its records, stop at any of them, then take the result.

    Parameters
    ----------
    mesh
        Anything :func:`surface.as_surface_mesh` takes.
    options
        The options; the defaults suit a surface that stays where it is.
    schedules
        Other tuned numbers than those the benchmarks were made with.

    Attributes
    ----------
    options, mesh
        The arguments, the mesh as a :class:`surface.SurfaceMesh`.
    history
        The records so far.

    Raises
    ------
    MeshError
        If the surface cannot be worked on.
    OptionError
        If options make no sense.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.3, 0.8, 0]])
    >>> run = Remeshing((corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]))
    >>> for record in run:
    ...     pass
    >>> bool(np.allclose(run.points[4], [0.5, 0.5, 0], atol=1e-2))
    True
    """

    def __init__(self, mesh: Any, options: Options | None = None, schedules: Schedules | None = None) -> None:
        self._began = time.perf_counter()
        self.options = Options() if options is None else options
        self._schedules = Schedules() if schedules is None else schedules
        self.mesh: SurfaceMesh = as_surface_mesh(mesh)
        self.history: list[Record] = []
        sound, self._interfaces = require_sound(self.mesh), find_interfaces(self.mesh, self.options.interfaces)
        self._notes = [*sound, *self._interfaces.notes("are kept: nodes slide along them, corners and junctions stay")]
        self._reason, self._converged = "interrupted before it began", False
        cells = self.mesh.cells
        # Coordinates of the run have their origin near the mesh, and edges of unit length on average.
        self._edge_length = mean_edge_length(self.mesh.points, cells)
        nodes = cells.nodes()
        self._start = (self.mesh.points - self.mesh.points[nodes].min(axis=0)) / self._edge_length
        self._best_points, self._best_iteration, self._last_points = self._start, 0, self._start
        self._diagonal = float(np.linalg.norm(np.ptp(self._start[nodes], axis=0)))
        self._held, self._postponed = np.zeros((2, len(self._start)), dtype=bool)
        self._held_for_best, self._out_of_iterations = np.flatnonzero(self._held), False
        self._spoiled_cells = np.zeros(len(self.mesh.cells), dtype=bool)
        self._closed = len(edge_table(cells).nonmanifold) == 0
        self._problem = self._best_problem = self._make_problem()
        self._best_facets = self._problem.node_facets

    def _make_problem(self) -> RemeshingProblem:
        options, cells, x, schedule = self.options, self.mesh.cells, self._start, self._schedules.problem
        angle = options.feature_angle if options.feature_edges is None else None
        fixed, lines = held_nodes(self.mesh, options.fixed) | self._held, self._interfaces
        features = find_features(x, cells, angle, options.feature_edges, fixed, options.boundary, lines.edges)
        shapes = target_shapes(options.target, x, cells)
        energy: SurfaceEnergy
        if options.energy == "barrier":
            worst = options.emphasis == "worst"
            m, c = (np.inf, schedule.worst_c) if worst else (schedule.mean_m, schedule.mean_c)
            energy = Barrier(cells, shapes, len(x), m, c)
            energy.emphasize_worst = worst
        else:
            energy = Quaternionic(cells, shapes, len(x))
        # A copy for the records, since the run adapts its own in every iteration.
        self._recorded_energy = copy(energy)
        bound = schedule.bound_margin * options.hausdorff * self._diagonal if options.project else None
        return RemeshingProblem(x, cells, features, energy, options.eps, options.normal, bound, lines, schedule)

    @property
    def points(self) -> Floats:
        """The best points so far, in the coordinates of the input; nodes that did not move are bit-identical to it."""
        return self._in_input_coordinates(self._best_points)

    @property
    def last_points(self) -> Floats:
        """The points of the last record of the best descent so far, whether or not they are the best points."""
        return self._in_input_coordinates(self._last_points)

    @property
    def converged(self) -> bool:
        """True if the run ended because there was nothing left to gain."""
        return self._converged

    def _in_input_coordinates(self, points: Floats) -> Floats:
        return np.asarray(self.mesh.points + self._edge_length * (points - self._start))

    def __iter__(self) -> Iterator[Record]:
        """Run; every record's surface keeps the shape, so the run may be left at any of them.

        :attr:`points` and the result hold the last surface of a descent that is no worse than the input: no
        smaller angles, neither the smallest (by more than a thousandth) nor in the mean, and no more cells turned over.
        After a descent that ends worse, or stuck, another begins that forbids cells to change to another sheet of the
        input; then further ones that hold the nodes of spoiled cells, at first until no cell turns over any more, then
        for good. The best descent counts.
        """
        patiences = self._schedules.restart.patiences
        for number, patience in enumerate(patiences):
            yield from self._descend(patience if self.options.project else np.inf)
            # The second descent only forbids a change of sheet, which needs an input surface to stay on.
            first = number == 0 and self.options.project
            done = not (self._stuck or (first and not self._converged)) or number == len(patiences) - 1
            if self._out_of_iterations or done or not (first or self._hold_spoiled_cells()):
                break
            self._problem = self._make_problem()
            self._problem.input_surface.forbid_sheet_change = True
        if len(self.history) > 1 and not self._acceptance.is_worthwhile(self.history[self._best_iteration]):
            no_gain = "the input is about as good already"
            if self._stuck or (self._postponed | self._held).any():
                no_gain = "nothing better was found without spoiling a cell"
            elif self._out_of_iterations:
                no_gain = "too little was gained to move nodes for it"
            self._reason += f"; {no_gain}"
            self._best_points, self._best_iteration, self._held_for_best = self._start, 0, self._held_for_best[:0]
        elif self._best_iteration < len(self.history) - 1:
            self._reason += f"; iteration {self._best_iteration} is the best that is nowhere worse than the input"
        if self._best_iteration and not (self._out_of_iterations or self._acceptance.by_energy):
            yield from self._draw_near()
        if len(self._held_for_best):
            nodes = first_ids(self._held_for_best, self.mesh.node_labels)
            self._notes.append(f"nodes held, whose cells would be spoiled: {nodes}")

    def _hold_spoiled_cells(self) -> bool:
        """Hold the nodes of spoiled cells in the next descent, at first for its beginning; False if all are held."""
        nodes = self.mesh.cells.corners_of(self._spoiled_cells)
        postpone = self.options.project and self.history[-1].turned > self.history[0].turned
        if postpone and not self._postponed[nodes].all():
            self._postponed[nodes] = True
            return True
        any_free = not self._held[nodes].all()
        self._held[nodes] = True
        return any_free

    @property
    def _acceptance(self) -> Acceptance:
        largest_distance = max(record.distance for record in self.history)
        return Acceptance(
            self.options,
            self.mesh.cells,
            self.history[0],
            self._energy_scale,
            largest_distance,
            self._schedules.acceptance,
        )

    @property
    def _stuck(self) -> bool:
        """True if the last descent ended worse than the input, though there was something to gain."""
        first, last, acceptance = self.history[0], self.history[-1], self._acceptance
        gain = last.turned > first.turned or acceptance.is_low(min(record.energy for record in self.history))
        return bool(self._spoiled_cells.any()) and not acceptance.no_worse(last) and gain

    @property
    def _energy_scale(self) -> float:
        return 1.0 if self.options.energy == "barrier" else self._edge_length**2

    def _descend(self, patience: float) -> Iterator[Record]:
        """Descend from the input, and note which cells end turned over, or with a smaller angle than any of the input.

        The descent ends after `patience` iterations with cells turned over, counted from where no more can turn over:
        a few turn back by themselves.
        """
        self._reason, self._converged = "interrupted", False
        termination, turned_iterations, first = Termination(), 0, not self.history
        before = self.history[self._best_iteration] if self._best_iteration else None
        for number, at in enumerate(
            descend(
                self._problem,
                self.options.energy_tolerance,
                termination,
                self._postponed,
                self._schedules.step,
                self._schedules.continuation,
            )
        ):
            if self.history and number == 0:
                continue  # the first iterate is the input, which is recorded already
            angles = smallest_angles(at.points, self.mesh.cells)
            turned = self._problem.input_surface.turned_over(at.points)
            self.history.append(self._record(at, angles, turned))
            now, acceptance = self.history[-1], self._acceptance
            better = acceptance.no_worse(now) and (before is None or acceptance.is_better(now, before))
            if first or better:
                self._last_points = at.points
            if better:
                self._best_points, self._best_iteration = at.points, now.iteration
                self._best_problem, self._best_facets = self._problem, self._problem.node_facets
                self._held_for_best = np.flatnonzero(self._held)
            self._spoiled_cells = turned | acceptance.too_thin(angles)
            yield now
            most = self.options.max_iterations
            if now.iteration >= most:
                self._reason, self._out_of_iterations = f"reached max_iterations = {most}", True
                return
            turned_iterations += self._problem.input_surface.forbid_turning and now.turned > self.history[0].turned
            if turned_iterations == patience:
                termination.reason = "cells turned over"
                break
        self._reason, self._converged = termination.reason, termination.converged

    def _draw_near(self) -> Iterator[Record]:
        """Bring the best surface nearer to the input, for a few tenths of a degree."""
        problem = self._problem = self._best_problem
        problem.node_facets = self._best_facets
        cells, acceptance = self.mesh.cells, self._acceptance
        limits = acceptance.angle_limits(self.history[self._best_iteration], self._schedules.approach)
        bound = self.options.hausdorff * self._diagonal
        farthest: float | None = None
        for at in approach(problem, self._best_points, limits, self._schedules):
            # Measured only once there is something to compare: a fine surface is near enough as it is.
            if farthest is None:
                farthest = min(bound, problem.input_surface.hausdorff(self._best_points))
            now = self._record(at, smallest_angles(at.points, cells), problem.input_surface.turned_over(at.points))
            # In between the places that the steps look at it may have gone farther away.
            nearer = problem.input_surface.hausdorff(at.points) <= farthest
            if nearer and acceptance.no_worse(now) and acceptance.is_worthwhile(now):
                self.history.append(now)
                self._best_points, self._last_points, self._best_iteration = at.points, at.points, now.iteration
                yield now
            if len(self.history) > self.options.max_iterations:
                return

    def _record(self, at: Iterate, angles: Floats, turned: NDArray[np.bool_]) -> Record:
        return Record(
            iteration=len(self.history),
            energy=self._energy_scale * self._recorded_energy.value(at.points) / len(self.mesh.cells),
            decrease=at.decrease,
            step=at.step,
            min_angle=float(angles.min()),
            mean_angle=float(angles.mean()),
            turned=int(turned.sum()),
            held=at.held,
            seconds=time.perf_counter() - self._began,
            distance=self._problem.input_surface.largest_distance / self._diagonal,
        )

    def result(self) -> Result:
        """The best surface so far, with its report."""
        mesh = self.mesh
        best, distance, notes = self._within_bound()
        points = self._in_input_coordinates(best)
        before, after = quality(mesh), quality(mesh.replaced(points))
        input_surface = self._problem.input_surface
        areas = [float(face_areas(x, mesh.cells).sum()) for x in (self._start, best)]
        volumes = [enclosed_volume(x, mesh.cells) for x in (self._start, best)]
        report = Report(
            before=before.summary(),
            after=after.summary(),
            energy_before=self.history[0].energy if self.history else float("nan"),
            energy_after=self.history[self._best_iteration].energy if self.history else float("nan"),
            area_change=areas[1] / areas[0] - 1,
            volume_change=volumes[1] / volumes[0] - 1 if self._closed and volumes[0] else None,
            hausdorff=distance / self._diagonal,
            mean_distance=input_surface.mean_distance(best) / self._diagonal,
            turned=int(input_surface.turned_over(best).sum()),
            largest_displacement=float(np.linalg.norm(points - mesh.points, axis=1).max()),
            iterations=max(len(self.history) - 1, 0),
            seconds=time.perf_counter() - self._began,
            reason=self._reason,
            converged=self._converged,
            options=self.options.described(),
            notes=(*self._notes, *notes),
        )
        data = {"min_angle": after.min_angle, "min_angle_change": after.min_angle - before.min_angle}
        better = mesh.replaced(points, cell_data=data).to_source_type()
        return Result(better, points, report, tuple(self.history), mesh, self.options.interfaces)

    def _within_bound(self) -> tuple[Floats, float, list[str]]:
        """The best points within the bound, their distance from the input, and notes about them.

        They are pulled back towards the input where they are beyond the bound after all: while the run goes on, the
        distance is measured at fewer points.
        """
        start, input_surface, cells = self._start, self._problem.input_surface, self.mesh.cells
        bound, distance = self.options.hausdorff * self._diagonal, input_surface.hausdorff(self._best_points)
        if not self.history or distance <= bound:
            return self._best_points, distance, []
        if not self.options.project:
            return self._best_points, distance, ["without projection the surface went farther than hausdorff"]
        for trial, distance in pull_back(self._problem, self._best_points, bound, self._schedules.pull_back):
            at = Iterate(trial, np.nan, np.nan, 0)
            record = self._record(at, smallest_angles(trial, cells), input_surface.turned_over(trial))
            if self._acceptance.no_worse(record):
                share = np.linalg.norm(trial - start) / np.linalg.norm(self._best_points - start)
                return trial, distance, [f"hausdorff left room for {share:.1%} of the way nodes would have gone"]
        return start, 0.0, ["hausdorff left no room: the input comes back"]
