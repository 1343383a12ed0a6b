"""Remesh a surface: the main job, from whatever the user has to a better mesh and a report."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexconformal.common import first_ids, options_from

from ..constraint import detect_features
from ..energy import Barrier, Distortion, Quaternionic, reference_shapes
from ..io import as_surface_mesh
from ..mesh import Floats, SurfaceMesh, cell_areas, edge_table, enclosed_volume, mean_edge_length
from ..quality import held_nodes, quality, require_sound, smallest_angles
from .acceptance import Acceptance
from .descent import Iterate, Outcome, descend
from .options import Options, Record
from .problem import RemeshingProblem
from .pull_back import nearer
from .report import Report
from .result import Result

__all__ = ["Remeshing", "remesh"]

_COUNTED = {"mean": (0.02, 0.1), "worst": (np.inf, 0.5)}  # mildness and severity of the barrier
_PATIENCE = (10, *8 * (1,), np.inf)  # iterations with cells turned over when no more can, descent by descent
_MARGIN = 0.9  # of the Hausdorff bound that is measured at nodes and centres while the run goes on


class Remeshing:
    """A run that can be watched: iterate over its records, stop whenever you like, then take the result.

    Parameters
    ----------
    mesh
        Anything :func:`surface.as_surface_mesh` takes.
    options
        What to do; the defaults suit a surface that stays where it is.

    Attributes
    ----------
    options, mesh
        What was given, the mesh as a :class:`surface.SurfaceMesh`.
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

    def __init__(self, mesh: Any, options: Options | None = None) -> None:
        self._began = time.perf_counter()
        self.options = Options() if options is None else options
        self.mesh: SurfaceMesh = as_surface_mesh(mesh)
        self.history: list[Record] = []
        self._notes = list(require_sound(self.mesh))
        self._reason, self._converged = "interrupted before it began", False
        cells = self.mesh.cells
        # The work is done in a frame of its own: edges of unit length on average, near the origin.
        self._unit = mean_edge_length(self.mesh.points, cells)
        nodes = cells.nodes()
        self._start = (self.mesh.points - self.mesh.points[nodes].min(axis=0)) / self._unit
        self._points, self._best, self._last = self._start, 0, self._start
        self._diagonal = float(np.linalg.norm(np.ptp(self._start[nodes], axis=0)))
        self._held, self._waiting = np.zeros((2, len(self._start)), dtype=bool)
        self._stayed, self._limited = np.flatnonzero(self._held), False
        self._spoiled = np.zeros(len(self.mesh.cells), dtype=bool)
        self._closed = bool((edge_table(cells).uses == 2).all())
        self._core = self._surface()

    def _surface(self) -> RemeshingProblem:
        options, cells, x = self.options, self.mesh.cells, self._start
        angle = options.feature_angle if options.feature_edges is None else None
        fixed = held_nodes(self.mesh, options.fixed)
        features = detect_features(x, cells, angle, options.feature_edges, fixed | self._held, options.boundary)
        shapes = reference_shapes(options.target, x, cells)
        energy: Distortion
        if options.energy == "barrier":
            energy = Barrier(cells, shapes, len(x), *_COUNTED[options.emphasis])
            energy.lift = options.emphasis == "worst"
        else:
            energy = Quaternionic(cells, shapes, len(x))
        # The energy itself, while the run adapts its own to where it is.
        self._measure = copy(energy)
        bound = _MARGIN * options.hausdorff * self._diagonal if options.project else None
        return RemeshingProblem(x, cells, features, energy, options.eps, options.normal, bound)

    @property
    def points(self) -> Floats:
        """The best points so far, in the user's frame; what did not move is bit-identical to the input."""
        return self._in_users_frame(self._points)

    @property
    def latest(self) -> Floats:
        """The points of the last record, whether they are the best or not: a surface that moves on needs no more."""
        return self._in_users_frame(self._last)

    @property
    def converged(self) -> bool:
        """Whether the run ended because there was nothing left to gain."""
        return self._converged

    def _in_users_frame(self, points: Floats) -> Floats:
        return np.asarray(self.mesh.points + self._unit * (points - self._start))

    def __iter__(self) -> Iterator[Record]:
        """Run; every record's surface keeps the shape, so the run may be left at any of them.

        What :attr:`points` and the result hold is the last surface of a descent that is no worse than the input: no
        smaller angles, neither the smallest (by more than a thousandth) nor in the mean, and no more cells turned over.
        A descent that ends worse, or stuck, begins again with care; then the nodes of the cells in the way wait until
        no cell turns over any more, or stay. The best descent counts.
        """
        for number, patience in enumerate(_PATIENCE):
            yield from self._descent(patience if self.options.project else np.inf)
            # With care alone first, which needs a surface to stay on.
            alone = number == 0 and self.options.project
            done = not (self._stopped or (alone and not self._converged)) or number == len(_PATIENCE) - 1
            if self._limited or done or not (alone or self._set_aside()):
                break
            self._core = self._surface()
            self._core.shape.careful = True
        if len(self.history) > 1 and not self._worth.worthwhile(self.history[self._best]):
            no_gain = "the input is about as good already"
            if self._stopped or (self._waiting | self._held).any():
                no_gain = "nothing better was found without spoiling a cell"
            elif self._limited:
                no_gain = "too little was gained to move nodes for it"
            self._reason += f"; {no_gain}"
            self._points, self._best, self._stayed = self._start, 0, self._stayed[:0]
        elif self._best < len(self.history) - 1:
            self._reason += f"; iteration {self._best} is the best that is nowhere worse than the input"
        if len(self._stayed):
            self._notes.append(f"nodes held, whose cells would be spoiled: {first_ids(self._stayed)}")

    def _set_aside(self) -> bool:
        """Let nodes of the few cells wait, or stay, that stand in the way of all others; whether any is left to."""
        nodes = self.mesh.cells.corners_of(self._spoiled)
        waits = self.options.project and self.history[-1].turned > self.history[0].turned
        if waits and not self._waiting[nodes].all():
            self._waiting[nodes] = True
            return True
        left = not self._held[nodes].all()
        self._held[nodes] = True
        return left

    @property
    def _worth(self) -> Acceptance:
        farthest = max(record.distance for record in self.history)
        return Acceptance(self.options, self.mesh.cells, self.history[0], self._scale, farthest)

    @property
    def _stopped(self) -> bool:
        """Whether the last descent ended worse than the input, though there was something to gain."""
        first, last, worth = self.history[0], self.history[-1], self._worth
        promising = last.turned > first.turned or worth.promising(min(record.energy for record in self.history))
        return bool(self._spoiled.any()) and not worth.no_worse(last) and promising

    @property
    def _scale(self) -> float:
        return 1.0 if self.options.energy == "barrier" else self._unit**2

    def _descent(self, patience: float) -> Iterator[Record]:
        """Descend from the input; tells which cells end turned over, or thinner than the thinnest of the input.

        Ends where some were turned over for so many iterations, since no more can: a few turn back by themselves.
        """
        self._reason, self._converged = "interrupted", False
        outcome, over, first = Outcome(), 0, not self.history
        before = self.history[self._best] if self._best else None
        for number, at in enumerate(descend(self._core, self.options.energy_tolerance, outcome, self._waiting)):
            if self.history and number == 0:
                continue  # the input again
            angles = smallest_angles(at.points, self.mesh.cells)
            turned = self._core.shape.turned_over(at.points)
            self.history.append(self._record(at, angles, turned))
            now, worth = self.history[-1], self._worth
            better = worth.no_worse(now) and (before is None or worth.beats(now, before))
            if first or better:
                self._last = at.points
            if better:
                self._points, self._best, self._stayed = at.points, now.iteration, np.flatnonzero(self._held)
            self._spoiled = turned | worth.thinner(angles)
            yield now
            if now.iteration >= self.options.max_iterations:
                most = self.options.max_iterations
                self._reason, self._limited = f"reached max_iterations = {most}", True
                return
            over += self._core.shape.strict and now.turned > self.history[0].turned
            if over == patience:
                outcome.reason = "cells turned over"
                break
        self._reason, self._converged = outcome.reason, outcome.converged

    def _record(self, at: Iterate, angles: Floats, turned: NDArray[np.bool_]) -> Record:
        return Record(
            iteration=len(self.history),
            energy=self._scale * self._measure.value(at.points) / len(self.mesh.cells),
            decrease=at.decrease,
            step=at.step,
            min_angle=float(angles.min()),
            mean_angle=float(angles.mean()),
            turned=int(turned.sum()),
            held=at.held,
            seconds=time.perf_counter() - self._began,
            distance=self._core.shape.reached / self._diagonal,
        )

    def result(self) -> Result:
        """The surface reached, with its report."""
        mesh = self.mesh
        best, distance, notes = self._within()
        points = self._in_users_frame(best)
        before, after = quality(mesh), quality(mesh.replaced(points))
        shape = self._core.shape
        areas = [float(cell_areas(x, mesh.cells).sum()) for x in (self._start, best)]
        volumes = [enclosed_volume(x, mesh.cells) for x in (self._start, best)]
        report = Report(
            before=before.summary(),
            after=after.summary(),
            energy_before=self.history[0].energy if self.history else float("nan"),
            energy_after=self.history[self._best].energy if self.history else float("nan"),
            area_change=areas[1] / areas[0] - 1,
            volume_change=volumes[1] / volumes[0] - 1 if self._closed and volumes[0] else None,
            hausdorff=distance / self._diagonal,
            turned=int(shape.turned_over(best).sum()),
            largest_displacement=float(np.linalg.norm(points - mesh.points, axis=1).max()),
            iterations=max(len(self.history) - 1, 0),
            seconds=time.perf_counter() - self._began,
            reason=self._reason,
            converged=self._converged,
            options=self.options.described(),
            notes=(*self._notes, *notes),
        )
        data = {"min_angle": after.min_angle, "min_angle_change": after.min_angle - before.min_angle}
        return Result(mesh.replaced(points, cell_data=data).restored(), points, report, tuple(self.history))

    def _within(self) -> tuple[Floats, float, list[str]]:
        """The best points, their distance, and what to say.

        They are taken back towards the input where they are beyond the bound after all: while the run goes on, the
        distance is measured at fewer places.
        """
        start, shape, cells = self._start, self._core.shape, self.mesh.cells
        bound, distance = self.options.hausdorff * self._diagonal, shape.hausdorff(self._points)
        if not self.history or distance <= bound:
            return self._points, distance, []
        if not self.options.project:
            return self._points, distance, ["without projection the surface went farther than hausdorff"]
        for trial, distance in nearer(self._core, self._points, bound):
            at = Iterate(trial, np.nan, np.nan, 0)
            if self._worth.no_worse(self._record(at, smallest_angles(trial, cells), shape.turned_over(trial))):
                share = np.linalg.norm(trial - start) / np.linalg.norm(self._points - start)
                return trial, distance, [f"hausdorff left room for {share:.1%} of the way nodes would have gone"]
        return start, 0.0, ["hausdorff left no room: the input comes back"]


def remesh(mesh: Any, *, callback: Callable[[Record], None] | None = None, **options: Any) -> Result:
    """Make the cells of a surface regular by minimizing their quaternionic conformal distortion.

    Nodes slide along the surface, sharp edges and boundary curves (Gruber & Aulisa, eq. 2): equation (16) is minimized
    under the constraint of equation (17); connectivity stays. No cell turns over, closed pieces keep their volume, and
    neither the smallest angle (by more than a thousandth of it) nor the mean one gets worse. An input is about as good
    as it gets, and comes back as it is, if the energy would fall by less than a tenth, or if the smallest angle would
    gain less than a tenth and the mean one less than a tenth of what it misses (with `emphasis="worst"`: 2 % of the one
    and 0.1 degrees of the other). Where the run took the surface more than half as far away as it may, one of them must
    gain at least 15 % of what it misses.

    Parameters
    ----------
    mesh
        A path, a pyvista surface, a meshio.Mesh, a :class:`surface.SurfaceMesh` or a tuple ``(points, cells)`` of
        triangles or quadrilaterals. It is not changed.
    callback
        Called with the record of every iteration.
    **options
        Fields of :class:`surface.Options`: target, energy, emphasis, max_iterations, energy_tolerance, eps, normal,
        project, hausdorff, feature_angle, feature_edges, boundary, fixed.

    Returns
    -------
    Result
        With the mesh in the type that came in, a report and the history.

    Raises
    ------
    MeshError
        If the surface cannot be worked on.
    ReadError
        If a file cannot be read.
    OptionError
        If an option is unknown or makes no sense.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.3, 0.8, 0]])
    >>> result = remesh((corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]))
    >>> bool(result.report.after.min_angle > 44)
    True
    """
    run = Remeshing(mesh, options_from(Options, options))
    for record in run:
        if callback is not None:
            callback(record)
    return run.result()
