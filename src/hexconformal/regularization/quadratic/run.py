"""A run for meshes of quadratic cells, watched and stopped as that for linear ones is."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import MeshError, OptionError, first_ids, first_names
from ...formulation import LEVEL, Iteration
from ...io import as_volume_mesh
from ...mesh import HexMesh, MixedMesh, blocks_of, counts_by_type, region_arrays, with_wedges_upright
from ...quality import Quality, nodes_without_room, quality, require_sound
from ..acceptance import no_worse_than, room_notes
from ..options import Options, Record
from ..region_rows import region_rows
from ..report import Report, Result
from .schedule import QuadraticSchedule
from .setting import QuadraticSetting
from .stages import minimize_distortion, raise_worst
from .unfolding import pulled_back, unfold

__all__ = ["QuadraticRegularization"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Options that have an effect here.
_OPTIONS = (
    *("boundary", "hausdorff", "features", "feature_band", "interfaces", "couplings", "fixed"),
    *("emphasis", "gradient_tolerance", "max_iterations"),
)
_ROUNDING = 1e-12  # of a scaled Jacobian
_SHARES = (1.0, 0.98, 0.95, 0.9, 0.8, 0.6, 0.4, 0.2)  # of all displacements, until the surface is within its bound


class QuadraticRegularization:
    """A run on quadratic cells, used as a :class:`hexconformal.Regularization`.

    Nodes between corners move as these do; curved faces slide on the curved surface that there was. Linear cells beside
    them are measured at the same points.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_volume_mesh` takes, with quadratic cells, and linear ones where the two share no
        edge.
    options
        Those on the boundary and on what is kept count, `emphasis`, `gradient_tolerance` and `max_iterations`; others
        must have their defaults.
    schedule
        Other tuned numbers.

    Raises
    ------
    MeshError
        If the mesh cannot be worked on.
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
        curved = any(block.cell_type.straight for block in blocks_of(taken))
        if not isinstance(taken, MixedMesh) or not curved:
            raise MeshError(f"a mesh must have quadratic cells here, and has {counts_by_type(blocks_of(taken))}")
        others = [one.name for one in fields(Options) if one.name not in _OPTIONS]
        meant = [name for name in others if not _is_default(name, getattr(options, name))]
        if meant:
            raise OptionError(f"for cells of second order there is no {first_names(meant)}: leave the default")
        self.mesh: MixedMesh = taken
        self.history: list[Record] = []
        findings = require_sound(taken)
        found = [finding.message for finding in findings if finding.kind != "higher order"]
        self._notes = (*found, *taken.notes)
        self._setting = QuadraticSetting.of(
            with_wedges_upright(taken), options, QuadraticSchedule() if schedule is None else schedule
        )
        self._points = self._before_raising = self._setting.start
        self._valid = self._setting.valid(self._points)
        self._invalid = int((~self._valid).sum())
        self._worst_at_first = self._setting.worst_by_type(self._setting.scaled_jacobians(self._points))
        self._reason, self._converged = "interrupted", False
        self._records = self._run()

    @property
    def points(self) -> Field:
        """The best points so far; what did not move is bit-identical to the input."""
        return self._setting.to_user(self._points)

    def __iter__(self) -> Iterator[Record]:
        """Run, or go on where it was left."""
        return self._records

    def _run(self) -> Iterator[Record]:
        floor = -np.inf
        for iteration in self._iterations():
            record, valid = self._record(iteration), self._setting.valid(iteration.points)
            self.history.append(record)
            invalid, raising = int((~valid).sum()), iteration.phase in ("angles", "stiffen", "hold types")
            # Where a cell is invalid at first the others may lose something as long as there are fewer of them.
            kept = not self._valid.all() or no_worse_than(record, self.history[0])
            kept &= record.min_scaled_jacobian >= floor - LEVEL
            if not (self._valid & ~valid).any() and invalid <= self._invalid and kept:
                if invalid < self._invalid or iteration.phase == "lbfgs" or raising:
                    self._points = iteration.points
                if not raising:
                    self._before_raising = self._points
                elif iteration.phase == "stiffen":
                    floor = max(floor, record.min_scaled_jacobian)
                self._invalid = invalid
            yield record

    def _record(self, iteration: Iteration) -> Record:
        setting, scaled = self._setting, self._setting.scaled_jacobians(iteration.points)
        return Record(
            iteration=len(self.history),
            phase=iteration.phase,
            energy=iteration.energy,
            gradient=iteration.gradient,
            step=iteration.step,
            min_scaled_jacobian=float(scaled.min()),
            mean_scaled_jacobian=float(scaled.mean()),
            inverted=int((scaled <= 0.0).sum()),
            seconds=time.perf_counter() - self._began,
            worst_gain=float((setting.worst_by_type(scaled) - self._worst_at_first).min()),
        )

    def _iterations(self) -> Iterator[Iteration]:
        """All iterations; why they end is known at the end."""
        setting, options, points = self._setting, self.options, self._setting.start
        yield Iteration("input", points)
        if not setting.free.any():
            self._reason, self._converged = "every node is held", True
            return
        for iteration in unfold(setting, points):
            points = iteration.points
            yield iteration
        if (spoiled := self._spoiled(points)) and setting.boundary.sliding is not None:
            # What a boundary that slides folds anew may unfold where it stays.
            other = points
            for iteration in unfold(setting.with_boundary_held(), setting.start):
                other = iteration.points
                yield iteration
            points = other if self._spoiled(other) < spoiled else points
        if setting.folded_cells(points).any():
            setting, points = self._held_back(points)
            yield Iteration("go back", points)
            if not setting.free.any():
                self._reason = "what stays folded holds all others"
                return
        relative, taken = 1.0, 0
        for iteration in minimize_distortion(setting, points, options.max_iterations, options.gradient_tolerance):
            points, relative, taken = iteration.points, iteration.gradient, taken + 1
            yield iteration
        if (self._valid & ~setting.valid(points)).any():
            setting, points = self._held_back(points)
            yield Iteration("go back", points)
        if taken == options.max_iterations and relative > options.gradient_tolerance:
            self._reason = "limit of iterations"
            return
        small = relative <= options.gradient_tolerance
        self._reason, self._converged = "the gradient is small enough" if small else "the energy falls no more", True
        if options.raises_worst:
            self._reason, self._converged = "interrupted", False
            for iteration in raise_worst(setting, points):
                points = iteration.points
                yield iteration
            self._reason, self._converged = "the worst cell stalls", True
        if (worse := self._worse_types(points)).any():
            held = setting.boundary.admissible.coupled.closed(setting.nodes_of(worse))
            yield Iteration("hold types", np.where(held[:, None], setting.start, points))

    def _spoiled(self, points: Field) -> int:
        """Number of cells that are folded at a point, or were valid and are not."""
        return int((self._setting.folded_cells(points) | (self._valid & ~self._setting.valid(points))).sum())

    def _worse_types(self, points: Field) -> Mask:
        """(m,) cells of the types whose worst cell is worse than it was."""
        setting, out = self._setting, np.zeros(len(self._valid), dtype=bool)
        worst = setting.worst_by_type(setting.scaled_jacobians(points))
        for block, lower in zip(setting.blocks, worst < self._worst_at_first - LEVEL, strict=True):
            out[block.places] = lower
        return out

    def _held_back(self, points: Field) -> tuple[QuadraticSetting, Field]:
        """The points with no valid cell lost, and the setting without what is folded there."""
        points = pulled_back(self._setting, points)
        return self._setting.without(self._setting.folded_cells(points)), points

    def result(self) -> Result:
        """The result so far; call it after the loop, or after an interruption."""
        surface, options = self._setting.boundary, self.options
        before, best = self._best()
        points, after, distance = best.points, best.quality, best.distance
        shift = points - self.mesh.points
        moved, (reason, converged) = np.linalg.norm(shift, axis=1), self._ending(after, bool(shift.any()))
        regions = self._setting.regions
        interfaces, told = ((), []) if regions is None else surface.interface_rows(regions, points)
        report = Report(
            before=before.summary(),
            after=after.summary(),
            energy_before=self._setting.energy(self._setting.start),
            energy_after=self._setting.energy(self._setting.start + shift / self._setting.unit),
            boundary_moved=int((moved[surface.on_it] > 0).sum()),
            largest_displacement=float(moved.max(initial=0.0)),
            diagonal=surface.diagonal,
            iterations=max(len(self.history) - 1, 0),
            seconds=time.perf_counter() - self._began,
            reason=reason,
            converged=converged,
            options=options.described(),
            notes=(*self._notes, *surface.boundary.notes, *told, *self._why_invalid(after)),
            hausdorff=distance,
            mean_distance=surface.mean_distance(points) if distance > 0.0 else 0.0,
            sharp_edges=(surface.sharp_length(self.mesh.points), surface.sharp_length(points)),
            regions=() if regions is None else region_rows(regions, before, after),
            interfaces=interfaces,
        )
        better = self.mesh.replaced(
            points=points,
            point_data={"moved_by": shift},
            cell_data={
                "scaled_jacobian": after.scaled_jacobian,
                "scaled_jacobian_change": after.scaled_jacobian - before.scaled_jacobian,
                **region_arrays(self._setting.corners, regions),
            },
        )
        better = better if self._from_our_mesh else better.to_source_type()
        return Result(better, points, report, tuple(self.history), self.mesh, self.options.interfaces)

    def _why_invalid(self, after: Quality) -> list[str]:
        """Of cells that stay invalid, whether that has to be so."""
        if after.valid.all():
            return []
        blocks = ((block.cell_type, block.cells) for block in self._setting.blocks)
        return room_notes(nodes_without_room(self.mesh.points, blocks, ~self._setting.free), self.mesh.node_labels)

    def _best(self) -> tuple[Quality, _Outcome]:
        """The quality before, and the best of what is within the bound."""
        setting, bound, before = self._setting, self.options.hausdorff, quality(self.mesh)
        best = _Outcome(np.array(self.mesh.points), before)
        for candidate in (self._points, self._before_raising):
            for share in _SHARES if candidate is not setting.start else ():
                points = setting.to_user(setting.on_surface(setting.start + share * (candidate - setting.start)))
                distance = setting.boundary.distance(points)
                if self.options.boundary == "slide" and distance > bound:
                    continue
                found = _Outcome(points, quality(self.mesh.replaced(points)), distance)
                best = found if found.is_better_than(best) and not self._is_worse(found.quality, before) else best
                break
            if self._points is self._before_raising:
                break
        return before, best

    def _is_worse(self, after: Quality, before: Quality) -> bool:
        """True where a valid cell is lost, or with as many invalid ones the worst of a type, or the mean, is lower."""
        if (before.valid & ~after.valid).any():
            return True
        worst, first = (self._setting.worst_by_type(one.scaled_jacobian) for one in (after, before))
        same, gain = (after.valid == before.valid).all(), after.scaled_jacobian.mean() - before.scaled_jacobian.mean()
        return bool(same and ((worst < first - LEVEL).any() or gain < -_ROUNDING))

    def _ending(self, after: Quality, moved: bool) -> tuple[str, bool]:
        """Why the run is over, and whether that is by a criterion."""
        bad = np.flatnonzero(~after.valid)
        if self._reason == "interrupted":
            return self._reason, False
        if len(bad):
            stays = "as the boundary stays" if self.options.boundary == "fixed" else "within the bound"
            ids = first_ids(bad, self.mesh.cell_labels)
            return f"cells that stay invalid: {ids}; no way was found to unfold them {stays}", False
        if not moved and self._setting.free.any():
            return "nothing better than the input was found", self._converged
        return self._reason, self._converged


@dataclass(frozen=True, eq=False)
class _Outcome:
    """Points (n, 3) that a run may come to, their quality, and the distance of the surface in diagonals."""

    points: Field
    quality: Quality
    distance: float = 0.0

    @property
    def _measures(self) -> tuple[int, float, float]:
        """The number of invalid cells, the smallest scaled Jacobian and the mean one."""
        scaled = self.quality.scaled_jacobian
        return int((~self.quality.valid).sum()), float(scaled.min()), float(scaled.mean())

    def is_better_than(self, other: _Outcome) -> bool:
        """True with fewer invalid cells, or a better worst one, or where that is the same one better on average."""
        (invalid, worst, mean), (others, their_worst, their_mean) = self._measures, other._measures
        if invalid != others:
            return invalid < others
        return worst > their_worst + LEVEL or (worst > their_worst - LEVEL and mean > their_mean)


def _is_default(name: str, value: Any) -> bool:
    default = getattr(Options, name)
    return value is default or (isinstance(value, str | int | float) and value == default)
