"""Regularize a hexahedral mesh: the main job, from whatever the user has to a better mesh and a report."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .assembly import Distortion
from .checks import as_mask, require_sound
from .constraint import Constraint, boundary_constraint
from .elements import EDGES
from .errors import MeshError, OptionError, first_ids
from .mesh import HexMesh, as_hex_mesh
from .options import Options, Record
from .preconditioner import Metric
from .quality import corner_scaled_jacobian, quality
from .report import Report
from .solver import SOLVERS, Iterate, Problem, inner, start
from .target import cell_volumes, inverse_targets
from .topology import boundary_quads
from .validity import all_valid, is_valid, minimum_jacobian

__all__ = ["Regularization", "Result", "regularize"]

Field = NDArray[np.float64]

_HANDOVER = 60  # iterations of L-BFGS after which Newton takes over
_TIGHT = 1e-6  # relative gradient below which Newton is the better choice
_FLOOR = 1e-13  # gradient per node that is rounding, edges being 1
_THIN = 0.05  # smallest volume, relative to the cube of the edges, that the metric believes in


@dataclass(frozen=True)
class Result:
    """What came out.

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
    """

    mesh: Any
    points: Field
    report: Report
    history: tuple[Record, ...]

    @property
    def converged(self) -> bool:
        """Whether the tolerance was reached."""
        return self.report.converged


class Regularization:
    """A run that can be watched: iterate over its records, stop whenever you like, then take the result.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_hex_mesh` takes.
    options
        What to do; the defaults suit an unknown mesh.

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

    def __init__(self, mesh: Any, options: Options | None = None) -> None:
        self._began = time.perf_counter()
        self.options = Options() if options is None else options
        self.mesh: HexMesh = as_hex_mesh(mesh)
        self.history: list[Record] = []
        self._notes = [finding.message for finding in require_sound(self.mesh)] + list(self.mesh.notes)
        self._reason, self._converged = "interrupted before it began", False
        # The work is done in a frame of its own: centred, with edges of unit length on average.
        self._cells = np.array(self.mesh.cells)
        self._used = np.zeros(len(self.mesh.points), dtype=bool)
        self._used[self._cells] = True
        corner = self.mesh.points[self._used].min(axis=0)
        self._start = np.array(self.mesh.points - corner)
        self._unit = float(np.linalg.norm(np.diff(self._start[self._cells[:, EDGES]], axis=2), axis=-1).mean())
        self._start /= self._unit
        self._points = self._start
        self._valid = is_valid(self._start, self._cells)
        self._refuse_mirrored()
        self._constraint = self._constrained()
        self._energy = self._distortion()

    @property
    def points(self) -> Field:
        """The best points so far, in the user's frame; what did not move is bit-identical to the input."""
        return self.mesh.points + self._unit * (self._points - self._start)

    def __iter__(self) -> Iterator[Record]:
        """Run; every record's mesh is acceptable, so the run may be left at any of them."""
        problem = Problem(self._energy, self._constraint.project, self._metric(), self._acceptable)
        at = start(problem, self._start)
        first = self._record("input", at, None)
        self._reason = "interrupted"
        yield self.history[-1]
        phases = ("lbfgs", "newton") if self.options.method == "auto" else (self.options.method,)
        for phase in phases:
            for taken, following in enumerate(SOLVERS[phase](problem, at), 1):
                if self._stops(at, first):
                    return
                if following.step == 0.0:
                    break
                at = following
                self._points = at.points
                self._record(phase, at, first)
                yield self.history[-1]
                if phase != phases[-1] and (taken == _HANDOVER or self.history[-1].gradient <= _TIGHT):
                    break
        self._reason = "no step lowers the energy further without spoiling a cell"
        self._stops(at, first)

    def result(self) -> Result:
        """The result so far; call it after the loop, or after an interruption."""
        points = self.points
        before, after = quality(self.mesh), quality(self.mesh.replaced(points=points))
        moved = np.linalg.norm(points - self.mesh.points, axis=1)
        surface = np.unique(boundary_quads(self._cells)[0])
        report = Report(
            before=before.summary(),
            after=after.summary(),
            energy_before=self.history[0].energy if self.history else float("nan"),
            energy_after=self.history[-1].energy if self.history else float("nan"),
            boundary_moved=int((moved[surface] > 0).sum()),
            largest_displacement=float(moved.max(initial=0.0)),
            diagonal=float(np.linalg.norm(np.ptp(self.mesh.points[self._used], axis=0))),
            iterations=max(len(self.history) - 1, 0),
            seconds=time.perf_counter() - self._began,
            reason=self._reason,
            converged=self._converged,
            options=self.options.described(),
            notes=tuple(self._notes),
        )
        better = self.mesh.replaced(
            points=points,
            cell_data={
                "scaled_jacobian": after.scaled_jacobian,
                "scaled_jacobian_change": after.scaled_jacobian - before.scaled_jacobian,
            },
        )
        return Result(better.restored(), points, report, tuple(self.history))

    def _refuse_mirrored(self) -> None:
        volumes = cell_volumes(self._start, self._cells)
        if (volumes < 0).mean() > 0.5:
            bad = np.flatnonzero(volumes < 0)
            raise MeshError(
                f"cells with negative volume: {first_ids(bad)} of {len(self._cells)}; the mesh is mirrored or its nodes "
                "are in a foreign order: hexconformal.orient(mesh) puts them right"
            )

    def _constrained(self) -> Constraint:
        options, count = self.options, len(self._start)
        fixed = self.mesh.held[:, None] | np.zeros((1, 3), dtype=bool)
        if options.fixed is not None:
            given = options.fixed
            if isinstance(given, str):
                if given not in self.mesh.point_data:
                    known = ", ".join(map(repr, self.mesh.point_data)) or "none"
                    raise OptionError(f"fixed={given!r} names no point array; there are: {known}")
                given = np.asarray(self.mesh.point_data[given]) != 0
            mask = as_mask(given, count, "fixed")
            fixed |= mask if mask.ndim == 2 else mask[:, None]
        constraint = boundary_constraint(self._start, self._cells, options.boundary, fixed)
        if options.energy == "quaternionic" and len(constraint.nodes) < 2:
            raise OptionError(
                "with a free boundary the plain energy shrinks the mesh to a point: fix two nodes or more, or use "
                "energy='barrier'"
            )
        return constraint

    def _distortion(self) -> Distortion:
        options = self.options
        target = options.target
        if not isinstance(target, str) and np.shape(target) == self.mesh.points.shape:
            target = np.asarray(target, dtype=np.float64) / self._unit
        scales = None
        if options.weight == "volume":
            volumes = np.abs(cell_volumes(self._start, self._cells))
            scales = volumes / volumes.mean()
        eps = None if options.energy == "quaternionic" else self._eps()
        quadrature = options.quadrature
        if quadrature == "auto":
            quadrature = "gauss" if options.energy == "quaternionic" else "corners"
        inverses = inverse_targets(target, self._start, self._cells, quadrature)
        return Distortion(self._cells, len(self._start), scales, inverses, eps, quadrature)

    def _eps(self) -> float:
        # No eps where nothing is folded; else enough to see over the fold.
        smallest = float(minimum_jacobian(self._start, self._cells)[1].min())
        return 0.0 if self._valid.all() else float(np.sqrt(1e-8 + 0.04 * smallest**2))

    def _metric(self) -> Metric:
        scales = None
        if self.options.energy == "barrier":
            # The Hessian of E / det^(2/3) goes with det^(-2/3); an inverted cell counts as a thin one.
            edges = np.diff(self._start[self._cells[:, EDGES]], axis=2)
            size = (edges**2).sum(axis=-1).mean(axis=(1, 2)) ** 1.5
            scales = np.maximum(cell_volumes(self._start, self._cells), _THIN * size) ** (-2.0 / 3.0)
        return Metric(self._energy.laplacian(scales), self._constraint, self._used)

    def _acceptable(self, points: Field) -> bool:
        """Valid cells stay valid."""
        return all_valid(points, self._cells, None if self._valid.all() else np.flatnonzero(self._valid))

    def _record(self, phase: str, at: Iterate, first: float | None) -> float:
        norm = float(np.sqrt(inner(at.gradient, at.gradient)))
        sj = corner_scaled_jacobian(at.points, self._cells)
        scale = self._unit**2 if self.options.energy == "quaternionic" else 1.0
        self.history.append(
            Record(
                iteration=len(self.history),
                phase=phase,
                energy=scale * at.energy,
                gradient=1.0 if first is None else norm / first if first else 0.0,
                step=at.step,
                min_scaled_jacobian=float(sj.min()),
                mean_scaled_jacobian=float(sj.mean()),
                inverted=int((sj <= 0).sum()),
                seconds=time.perf_counter() - self._began,
            )
        )
        return norm if first is None else first

    def _stops(self, at: Iterate, first: float) -> bool:
        norm = float(np.sqrt(inner(at.gradient, at.gradient)))
        if norm <= self.options.tolerance * first:
            self._reason, self._converged = f"gradient fell below {self.options.tolerance:g} of its start", True
        elif norm <= _FLOOR * np.sqrt(len(at.points)):
            self._reason, self._converged = "gradient is at the level of rounding", True
        elif len(self.history) > self.options.max_iterations:
            self._reason, self._converged = f"reached max_iterations = {self.options.max_iterations}", False
        else:
            return False
        return True


def regularize(mesh: Any, *, callback: Callable[[Record], None] | None = None, **options: Any) -> Result:
    """Make the cells of a hexahedral mesh regular by minimizing their quaternionic conformal distortion.

    The distortion of the planes (e1, e2), (e1, e3), (e2, e3) of every cell is summed and minimized over the node
    positions (Gruber & Aulisa, volumetric remeshing). A cell that is valid stays valid in every iteration.

    Parameters
    ----------
    mesh
        A path, a pyvista grid, a meshio.Mesh, a :class:`hexconformal.HexMesh` or a tuple ``(points, cells)``.
        It is not changed.
    callback
        Called with the record of every iteration.
    **options
        Fields of :class:`hexconformal.Options`: boundary, fixed, target, weight, energy, quadrature, method,
        tolerance, max_iterations.

    Returns
    -------
    Result
        With the mesh in the type that came in, a report, and the history. Not to converge is no error: the
        report gives the reason.

    Raises
    ------
    MeshError
        If the mesh cannot be worked on.
    ReadError
        If a file cannot be read.
    OptionError
        If an option is unknown or makes no sense.

    Examples
    --------
    >>> from hexconformal.generate import sheared_cube
    >>> result = regularize(sheared_cube(6))
    >>> result.converged, bool(result.report.after.scaled_jacobian.min > 0.9999)
    (True, True)
    """
    known = {field.name for field in fields(Options)}
    unknown = sorted(set(options) - known)
    if unknown:
        raise OptionError(f"unknown option {unknown[0]!r}; there are: {', '.join(sorted(known))}")
    run = Regularization(mesh, Options(**options))
    for record in run:
        if callback is not None:
            callback(record)
    return run.result()
