"""Evolution of a surface along a flow: adaptive steps that lower the energy, with remeshing between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from hexconformal.common import OptionError, options_from
from hexconformal.geometry import edge_table, enclosed_volume, face_area_vectors, mean_edge_length

from ..io import as_surface_mesh
from ..mesh import Floats, SurfaceMesh
from ..quality import held_nodes, require_sound, smallest_angles
from .discrete import DiscreteSurface, Elements
from .energy import energy, energy_gradient
from .flows import Flow
from .moment import Moment, surface_with_arrays
from .options import Record, Stepping, reduced_volume
from .remeshing import Remesher
from .schedule import FlowSchedule
from .step import Conserved, implicit_step, restore_conserved

__all__ = ["Evolution", "evolve"]


class Evolution:
    """An iterable run of a flow: iterate over its moments, stop at any of them, go on later.

    Parameters
    ----------
    flow
        The flow to follow.
    stepping
        Its options.
    schedule
        Other tuned numbers than those the benchmarks were made with.

    Attributes
    ----------
    history
        Records so far.
    reason
        The reason why it ended.

    Raises
    ------
    MeshError
        If the surface cannot be worked on.
    OptionError
        If an option makes no sense.

    Examples
    --------
    >>> from surface import MeanCurvature
    >>> tetrahedron = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> run = Evolution(MeanCurvature(tetrahedron, conserve="volume"), Stepping(steps=2))
    >>> for moment in run:
    ...     pass
    >>> run.reason, bool(moment.record.conserved_error < 1e-12)
    ('reached steps = 2', True)
    """

    def __init__(self, flow: Flow, stepping: Stepping, schedule: FlowSchedule | None = None) -> None:
        self.flow, self.stepping = flow, stepping
        self._schedule = FlowSchedule() if schedule is None else schedule
        self.mesh = as_surface_mesh(flow.mesh)
        self.notes = tuple(require_sound(self.mesh))
        cells = self.mesh.cells
        self.elements = Elements(cells, len(self.mesh.points))
        # Coordinates near the origin lose fewer digits. The unit stays that of the user's times and moduli.
        self.origin = self.mesh.points[cells.nodes()].mean(axis=0)
        self._start = self.mesh.points - self.origin
        self._surface = DiscreteSurface(self.elements, self._start)
        edges = edge_table(cells)
        border = edges.nodes[edges.nonmanifold]
        self._fixed = held_nodes(self.mesh, flow.fixed)
        self._fixed[border.ravel()] = True
        if "volume" in flow.conserve and len(border):
            raise OptionError("conserve must not have the volume where the surface is open: it encloses none")
        self._conserved = Conserved(flow.conserve, self._surface)
        self._first_area = self._surface.area
        self._remesher = Remesher(self.mesh, self._fixed, stepping.remesh_options, self._schedule.early_iterations)
        if stepping.remesh or stepping.remesh_below is not None:
            self.notes += self._remesher.notes
        self.history: list[Record] = []
        self._resumed = False
        self.reason = "not begun"
        self._energy = energy(self._surface, flow.terms)
        self._tau = self._first_tau() if stepping.tau is None else stepping.tau
        self._tau = min(self._tau, stepping.tau_max)
        self._step, self._time, self._energy_credit = 0, 0.0, 0.0
        self._recent_energies: list[float] = [self._energy]
        self._partial_remeshings, self._angle_before, self._largest_tau = 0, 0.0, 0.0

    def __iter__(self) -> Iterator[Moment]:
        self.reason = "interrupted"
        if not self.history and not self._resumed:
            nan = float("nan")
            yield self._moment(0.0, nan, np.empty(0), 0)
        while (reason := self._end_reason()) is None:
            jump = self._remesh()
            outcome = self._advance()
            if isinstance(outcome, str):
                self.reason = outcome
                return
            tau, multipliers, halvings = outcome
            yield self._moment(tau, jump, multipliers, halvings)
        self.reason = reason

    def state(self) -> dict[str, Any]:
        """The state of the run, as arrays and numbers; :meth:`resume` goes on from it."""
        return {
            "points": self._surface.points,
            "step": self._step,
            "time": self._time,
            "tau": self._tau,
            "energy": self._energy,
            "energy_credit": self._energy_credit,
            "recent_energies": np.array(self._recent_energies),
            "partial_remeshings": self._partial_remeshings,
            "angle_before": self._angle_before,
            "largest_tau": self._largest_tau,
            "conserved": self._conserved.values,
            "first_area": self._first_area,
        }

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from the state of another run of the same surface and flow.

        Parameters
        ----------
        state
            The value of :meth:`state`.
        """
        points = np.asarray(state["points"], dtype=np.float64)
        if points.shape != self._start.shape:
            raise OptionError("this belongs to another surface")
        self._surface = DiscreteSurface(self.elements, points)
        self._step, self._time = int(state["step"]), float(state["time"])
        self._tau, self._energy = float(state["tau"]), float(state["energy"])
        self._energy_credit, self._recent_energies = float(state["energy_credit"]), list(state["recent_energies"])
        self._partial_remeshings, self._angle_before = (
            int(state["partial_remeshings"]),
            float(state["angle_before"]),
        )
        self._largest_tau = float(state["largest_tau"])
        self._conserved.values = np.asarray(state["conserved"])
        self._first_area = float(state["first_area"])
        self._resumed = True

    @property
    def step(self) -> int:
        """Number of steps done."""
        return self._step

    @property
    def time(self) -> float:
        """Time reached."""
        return self._time

    def _end_reason(self) -> str | None:
        options = self.stepping
        if options.t_end is not None and self._time >= options.t_end:
            return f"reached t_end = {options.t_end:g}"
        if options.steps is not None and self._step >= options.steps:
            return f"reached steps = {options.steps}"
        if self._tau < self._schedule.collapsed * self._largest_tau:
            return self._describe_singularity()
        if options.stall > 0.0 and (reason := self._stall_reason()) is not None:
            return reason
        if self._surface.area <= self._schedule.vanished_area * self._first_area:
            place = ", ".join(
                f"{x:.6g}" for x in self._surface.points[self.mesh.cells.nodes()].mean(axis=0) + self.origin
            )
            return f"the surface vanishes, at ({place})"
        return None

    def _stall_reason(self) -> str | None:
        stall, recent, steps = self.stepping.stall, self._recent_energies, self._schedule.stall_steps
        if len(recent) > steps and recent[0] - recent[-1] <= stall * abs(recent[-1]):
            return f"the energy stalls: it fell by less than {stall:g} of it over {steps} steps"
        if self._partial_remeshings >= steps:
            mean = float(smallest_angles(self._surface.points, self.mesh.cells).mean())
            if mean < self._angle_before - self._schedule.angle_loss:
                return (
                    f"the energy falls only by wearing out the mesh (mean angle {self._angle_before:.1f} to "
                    f"{mean:.1f}): a finer mesh would be needed to go on"
                )
        return None

    def _remesh(self) -> float:
        """Remesh if it is due; returns the jump of the energy, NaN without remeshing."""
        options, schedule = self.stepping, self._schedule
        due = bool(options.remesh) and self._step % int(options.remesh) == 0
        if not due and options.remesh_below is not None:
            due = bool(smallest_angles(self._surface.points, self.mesh.cells).min() < options.remesh_below)
        if not due:
            return float("nan")
        early = self._step < schedule.early_remeshings * max(int(options.remesh), 1)
        remeshed = self._remesher(self._surface.points, early)
        if remeshed is None:
            return float("nan")
        old = self._surface.points
        # A remeshing raises the energy by less than the flow has lowered it, so that over a run it falls. The first
        # remeshings may raise it in advance, so that the mesh is good early; the flow makes up for that before others.
        in_advance = early * schedule.early_rise * abs(self._energy)
        largest_rise = max(schedule.rise * self._energy_credit + in_advance, 0.0)
        for fraction in schedule.fractions:
            moved = DiscreteSurface(self.elements, old + fraction * (remeshed - old))
            new = restore_conserved(moved, self._conserved, self._fixed, schedule.smoothing_length)
            if new is None:
                continue
            after = energy(new, self.flow.terms)
            jump = after - self._energy
            if jump <= largest_rise:
                self._surface, self._energy = new, after
                self._energy_credit = min(self._energy_credit - jump, 0.0)
                self._count_partial(fraction < 1.0)
                return jump
        self._count_partial(True)
        return float("nan")

    def _count_partial(self, partial: bool) -> None:
        """Count the remeshings in a row of which the energy allowed a part only; keep the mean angle before them."""
        if not partial or self._partial_remeshings == 0:
            self._angle_before = float(smallest_angles(self._surface.points, self.mesh.cells).mean())
        self._partial_remeshings = self._partial_remeshings + 1 if partial else 0

    def _advance(self) -> tuple[float, Floats, int] | str:
        """Take a step that lowers the energy and turns no cell over; the reason for the end if there is none."""
        surface, h = self._surface, mean_edge_length(self._surface.points, self.mesh.cells)
        before = face_area_vectors(surface.points, self.mesh.cells)
        stop = self.stepping.next_stop(self._time)
        for halvings in range(self._schedule.halvings):
            last = self._time + self._tau * (1 + 1e-9) >= stop
            tau = stop - self._time if last else self._tau
            found = implicit_step(surface, self.flow.terms, self._conserved, tau, self._fixed)
            if found is not None:
                new, multipliers = found
                longest = np.linalg.norm(new.points - surface.points, axis=1).max()
                turned = (face_area_vectors(new.points, self.mesh.cells) * before).sum(axis=1) <= 0
                value = energy(new, self.flow.terms)
                if (
                    longest <= self._schedule.largest_displacement * h
                    and not turned.any()
                    and value <= self._energy + 1e-14 * abs(self._energy)
                ):
                    self._energy_credit += self._energy - value
                    self._surface, self._energy = new, value
                    self._time = stop if last else self._time + tau
                    self._step += 1
                    self._largest_tau = max(self._largest_tau, tau)
                    self._recent_energies = [*self._recent_energies[-self._schedule.stall_steps :], value]
                    if halvings == 0 and not last:
                        self._tau = min(self._tau * self.stepping.growth, self.stepping.tau_max)
                    return tau, multipliers, halvings
            self._tau = min(tau, self._tau) / 2
        return self._describe_singularity()

    def _describe_singularity(self) -> str:
        y = np.linalg.norm(self._surface.nodal_curvature, axis=1)
        node = int(np.argmax(y))
        place = ", ".join(f"{x:.6g}" for x in self._surface.points[node] + self.origin)
        return (
            f"no step of reasonable length lowers the energy; the curvature is largest ({y[node]:.3g}) at node "
            f"{node}, ({place}): a singularity, or a mesh too poor there"
        )

    def _first_tau(self) -> float:
        force = self._surface.solve_mass(energy_gradient(self._surface, self.flow.terms))
        fastest = float(np.linalg.norm(force, axis=1).max())
        h = mean_edge_length(self._surface.points, self.mesh.cells)
        return self._schedule.first_displacement * h / fastest if fastest > 0 else h

    def _moment(self, tau: float, jump: float, multipliers: Floats, halvings: int) -> Moment:
        surface = self._surface
        angles = smallest_angles(surface.points, self.mesh.cells)
        volume = enclosed_volume(surface.points, self.mesh.cells)
        found = dict(zip(self._conserved.names, multipliers, strict=False))
        record = Record(
            step=self._step,
            time=self._time,
            tau=tau,
            energy=self._energy,
            remesh_jump=jump,
            area=surface.area,
            volume=volume,
            reduced_volume=reduced_volume(surface.area, volume),
            min_angle=float(angles.min()),
            mean_angle=float(angles.mean()),
            nu=float(found.get("area", np.nan)),
            lam=float(found.get("volume", np.nan)),
            conserved_error=self._conserved.error(surface),
            halvings=halvings,
        )
        self.history.append(record)
        return Moment(record, self._points(), self.mesh, self.elements, self.origin)

    def _points(self) -> Floats:
        # Nodes that did not move are bit-identical to the input.
        return self.mesh.points + (self._surface.points - self._start)

    def surface_mesh(self) -> SurfaceMesh:
        """The surface as it is now, with the arrays of a moment."""
        return surface_with_arrays(self._points(), self.mesh, self.elements, self.origin)


def evolve(flow: Flow, **options: Any) -> Iterator[Moment]:
    """Follow a flow, a moment per step, the input first.

    Parameters
    ----------
    flow
        The flow, for instance :class:`surface.Willmore`.
    **options
        Fields of :class:`surface.Stepping`: t_end, steps, tau, tau_max, growth, stall, outputs, remesh,
        remesh_below, remesh_options.

    Yields
    ------
    Moment
        With `record`, `points` and `mesh`.

    Raises
    ------
    MeshError
        If the surface cannot be worked on.
    OptionError
        If an option is unknown or makes no sense.

    Examples
    --------
    >>> from surface import MeanCurvature
    >>> tetrahedron = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> areas = [moment.record.area for moment in evolve(MeanCurvature(tetrahedron), steps=3)]
    >>> len(areas), areas == sorted(areas, reverse=True)
    (4, True)
    """
    if not isinstance(flow, Flow):
        raise OptionError(f"flow must be one such as MeanCurvature(mesh) or Willmore(mesh), not {type(flow).__name__}")
    return iter(Evolution(flow, options_from(Stepping, options)))
