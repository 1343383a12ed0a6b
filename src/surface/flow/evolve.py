"""Follow a flow: adaptive steps that lower the energy, with remeshing between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from hexconformal.common import OptionError, options_from

from ..io import as_surface_mesh
from ..mesh import Floats, area_vectors, edge_table, enclosed_volume, mean_edge_length
from ..quality import held_nodes, require_sound, smallest_angles
from .discrete import Elements, State
from .energy import energy, energy_gradient
from .flows import Flow
from .moment import Moment
from .options import Record, Stepping, reduced_volume
from .remeshing import Remesher
from .step import Conserved, implicit_step, restored

__all__ = ["Evolution", "evolve"]

_FIRST = 0.1  # of the mean edge length, what a first step may move a node
_LONGEST = 0.5  # of the mean edge length, what any step may
_VANISHED = 1e-4  # of the area, where a surface counts as gone
_HALVINGS = 40
_COLLAPSED = 1e-5  # of the longest time step so far, where a run comes to nothing
_WINDOW = 10  # steps over which a stall is seen
_GIVEN_BACK = 0.95  # of the energy lost since the last remeshing, at most, by the next one
_EARLY, _ADVANCE = 10, 0.05  # the first remeshings, and how much of the energy they may raise it by in advance
_SHARES = (1.0, 0.5, 0.25, 0.125)  # of a remeshing, the first that gives back no more
_WORN = 0.5  # degrees of the mean angle over a window of remeshings in part


class Evolution:
    """A flow that can be watched: iterate over its moments; stop whenever you like, go on later.

    Parameters
    ----------
    flow
        What to follow.
    stepping
        How.

    Attributes
    ----------
    history
        Records so far.
    reason
        Why it ended.

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

    def __init__(self, flow: Flow, stepping: Stepping) -> None:
        self.flow, self.stepping = flow, stepping
        self.mesh = as_surface_mesh(flow.mesh)
        self.notes = tuple(require_sound(self.mesh))
        cells = self.mesh.cells
        self.elements = Elements(cells, len(self.mesh.points))
        # Near the origin, for digits; the unit stays the user's, who gives times and moduli in it.
        self.origin = self.mesh.points[cells.nodes()].mean(axis=0)
        self._start = self.mesh.points - self.origin
        self._state = State(self.elements, self._start)
        table = edge_table(cells)
        self._fixed = held_nodes(self.mesh, flow.fixed)
        self._fixed[table.nodes[table.uses != 2].ravel()] = True
        if "volume" in flow.conserve and (table.uses != 2).any():
            raise OptionError("conserve must not have the volume where the surface is open: it encloses none")
        self._conserved = Conserved(flow.conserve, self._state)
        self._first_area = self._state.area
        self._remesher = Remesher(self.mesh, self._fixed, stepping.remesh_options)
        self.history: list[Record] = []
        self._resumed = False
        self.reason = "not begun"
        self._energy = energy(self._state, flow.terms)
        self._tau = self._first_tau() if stepping.tau is None else stepping.tau
        self._tau = min(self._tau, stepping.tau_max)
        self._step, self._time, self._credit = 0, 0.0, 0.0
        self._recent: list[float] = [self._energy]
        self._limited, self._angle, self._longest = 0, 0.0, 0.0

    def __iter__(self) -> Iterator[Moment]:
        self.reason = "interrupted"
        if not self.history and not self._resumed:
            nan = float("nan")
            yield self._moment(0.0, nan, np.empty(0), 0)
        while (reason := self._ending()) is None:
            jump = self._remeshed()
            outcome = self._advanced()
            if isinstance(outcome, str):
                self.reason = outcome
                return
            tau, multipliers, halvings = outcome
            yield self._moment(tau, jump, multipliers, halvings)
        self.reason = reason

    def state(self) -> dict[str, Any]:
        """Where the run stands, as arrays and numbers; with :meth:`resume` it goes on from there."""
        return {
            "points": self._state.points,
            "step": self._step,
            "time": self._time,
            "tau": self._tau,
            "energy": self._energy,
            "credit": self._credit,
            "recent": np.array(self._recent),
            "limited": self._limited,
            "angle": self._angle,
            "longest": self._longest,
            "conserved": self._conserved.values,
            "first_area": self._first_area,
        }

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from where another run, of the same surface and flow, stood.

        Parameters
        ----------
        standing
            What :meth:`state` gave.
        """
        self._state = State(self.elements, np.asarray(state["points"]))
        self._step, self._time = int(state["step"]), float(state["time"])
        self._tau, self._energy = float(state["tau"]), float(state["energy"])
        self._credit, self._recent = float(state["credit"]), list(state["recent"])
        self._limited, self._angle = int(state["limited"]), float(state["angle"])
        self._longest = float(state["longest"])
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

    def _ending(self) -> str | None:
        options = self.stepping
        if options.t_end is not None and self._time >= options.t_end:
            return f"reached t_end = {options.t_end:g}"
        if options.steps is not None and self._step >= options.steps:
            return f"reached steps = {options.steps}"
        if self._tau < _COLLAPSED * self._longest:
            return self._singularity()
        if options.stall > 0.0 and (reason := self._stalling()) is not None:
            return reason
        if self._state.area <= _VANISHED * self._first_area:
            place = ", ".join(
                f"{x:.6g}" for x in self._state.points[self.mesh.cells.nodes()].mean(axis=0) + self.origin
            )
            return f"the surface vanishes, at ({place})"
        return None

    def _stalling(self) -> str | None:
        stall, recent = self.stepping.stall, self._recent
        if len(recent) > _WINDOW and recent[0] - recent[-1] <= stall * abs(recent[-1]):
            return f"the energy stalls: it fell by less than {stall:g} of it over {_WINDOW} steps"
        if self._limited >= _WINDOW:
            mean = float(smallest_angles(self._state.points, self.mesh.cells).mean())
            if mean < self._angle - _WORN:
                return (
                    f"the energy falls only by wearing out the mesh (mean angle {self._angle:.1f} to {mean:.1f}): "
                    "a finer mesh would be needed to go on"
                )
        return None

    def _remeshed(self) -> float:
        """Remesh where it is due; returns the jump of the energy."""
        options = self.stepping
        due = bool(options.remesh) and self._step % int(options.remesh) == 0
        if not due and options.remesh_below is not None:
            due = bool(smallest_angles(self._state.points, self.mesh.cells).min() < options.remesh_below)
        if not due:
            return float("nan")
        early = self._step < _EARLY * max(int(options.remesh), 1)
        moved = self._remesher(self._state.points, early)
        if moved is None:
            return float("nan")
        old = self._state.points
        # What remeshing gives back is less than what the flow has taken: over a run the energy falls. The first ones
        # are paid for in advance, to be good early, and nothing is given back until the flow has earned it.
        most = max(_GIVEN_BACK * self._credit + early * _ADVANCE * abs(self._energy), 0.0)
        for share in _SHARES:
            new = restored(State(self.elements, old + share * (moved - old)), self._conserved, self._fixed)
            if new is None:
                continue
            after = energy(new, self.flow.terms)
            jump = after - self._energy
            if jump <= most:
                self._state, self._energy = new, after
                self._credit = min(self._credit - jump, 0.0)
                self._note_limit(share < 1.0)
                return jump
        self._note_limit(True)
        return float("nan")

    def _note_limit(self, limited: bool) -> None:
        """Count the remeshings in a row that the energy allowed in part only, and keep the angles before them."""
        if not limited or self._limited == 0:
            self._angle = float(smallest_angles(self._state.points, self.mesh.cells).mean())
        self._limited = self._limited + 1 if limited else 0

    def _advanced(self) -> tuple[float, Floats, int] | str:
        """Take a step that lowers the energy and turns no cell over; a text if there is none."""
        state, h = self._state, mean_edge_length(self._state.points, self.mesh.cells)
        before = area_vectors(state.points, self.mesh.cells)
        stop = self.stepping.next_stop(self._time)
        for halvings in range(_HALVINGS):
            last = self._time + self._tau * (1 + 1e-9) >= stop
            tau = stop - self._time if last else self._tau
            found = implicit_step(state, self.flow.terms, self._conserved, tau, self._fixed)
            if found is not None:
                new, multipliers = found
                longest = np.linalg.norm(new.points - state.points, axis=1).max()
                turned = (area_vectors(new.points, self.mesh.cells) * before).sum(axis=1) <= 0
                value = energy(new, self.flow.terms)
                if longest <= _LONGEST * h and not turned.any() and value <= self._energy + 1e-14 * abs(self._energy):
                    self._credit += self._energy - value
                    self._state, self._energy = new, value
                    self._time = stop if last else self._time + tau
                    self._step += 1
                    self._longest = max(self._longest, tau)
                    self._recent = [*self._recent[-_WINDOW:], value]
                    if halvings == 0 and not last:
                        self._tau = min(self._tau * self.stepping.growth, self.stepping.tau_max)
                    return tau, multipliers, halvings
            self._tau = min(tau, self._tau) / 2
        return self._singularity()

    def _singularity(self) -> str:
        y = np.linalg.norm(self._state.nodal_curvature, axis=1)
        node = int(np.argmax(y))
        place = ", ".join(f"{x:.6g}" for x in self._state.points[node] + self.origin)
        return (
            f"no step worth its while lowers the energy any more; the curvature is largest ({y[node]:.3g}) at node "
            f"{node}, ({place}): a singularity, or a mesh too poor there"
        )

    def _first_tau(self) -> float:
        force = self._state.solved(energy_gradient(self._state, self.flow.terms))
        fastest = float(np.linalg.norm(force, axis=1).max())
        h = mean_edge_length(self._state.points, self.mesh.cells)
        return _FIRST * h / fastest if fastest > 0 else h

    def _moment(self, tau: float, jump: float, multipliers: Floats, halvings: int) -> Moment:
        state = self._state
        angles = smallest_angles(state.points, self.mesh.cells)
        volume = enclosed_volume(state.points, self.mesh.cells)
        found = dict(zip(self._conserved.names, multipliers, strict=False))
        record = Record(
            step=self._step,
            time=self._time,
            tau=tau,
            energy=self._energy,
            remesh_jump=jump,
            area=state.area,
            volume=volume,
            reduced_volume=reduced_volume(state.area, volume),
            min_angle=float(angles.min()),
            mean_angle=float(angles.mean()),
            nu=float(found.get("area", np.nan)),
            lam=float(found.get("volume", np.nan)),
            conserved_error=self._conserved.error(state),
            halvings=halvings,
        )
        self.history.append(record)
        # What did not move is bit-identical to the input.
        return Moment(record, self.mesh.points + (state.points - self._start), self.mesh, self.elements, self.origin)


def evolve(flow: Flow, **options: Any) -> Iterator[Moment]:
    """Follow a flow, a moment per step, the input first.

    Parameters
    ----------
    flow
        What to follow, for instance :class:`surface.Willmore`.
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
