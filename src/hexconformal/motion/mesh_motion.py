"""Move a mesh with its boundary, step after step, for simulations whose domain moves (ALE, fluid-structure)."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import OptionError, agreed, array_of_numbers, first_ids, is_number, require_choice, require_number
from ..elements import all_valid, corner_scaled_jacobian, is_valid, rows_by_type
from ..energy import DistortionTerm, Objective, inverse_targets
from ..ranks import require_alike
from ..solver import AdmissibleDirections, Problem, fixed_components, lbfgs
from .carried_interfaces import CarriedInterfaces
from .extension import EXTENSIONS
from .moving_mesh import MovingMesh, MovingPiece, moving_ids
from .report import MotionReport, MotionStep
from .schedule import MotionSchedule

__all__ = ["MeshMotion"]

Field = NDArray[np.float64]

OPERATORS = ("conformal", *EXTENSIONS)
TARGETS = ("input", "current")


class MeshMotion:
    """Keeps a mesh valid and good while its boundary moves.

    What belongs to the topology is set up once; each step starts from the last position. Nodes keep their numbers.
    Every mesh that is returned is valid (det J > 0 everywhere), or the step is refused before it would not be.

    Parameters
    ----------
    mesh
        A valid mesh of linear cells of any types, anything :func:`hexconformal.as_volume_mesh` takes.
    moving
        Nodes whose displacement will be given: ids, in the order of the displacements, (n,) booleans, or the name of
        a point array or of a set or group of the file.
    fixed
        Nodes that stay: ids, booleans (n,) or per component (n, 3), or the name of a point array or of a set
        or group of the file. Other nodes of the boundary slide on its flat faces and along its straight edges, and
        stay where it is curved.
    target
        Perfect shape of the cells, whatever their type: "input", their own as they came, so that nothing adds up over a
        run and the way back leads to the initial mesh; or "current", their own at the last step.
    operator
        "conformal" minimizes the quaternionic conformal distortion from the target; "harmonic" and
        "elastic" extend the displacement by a linear problem, as is usual, and may end early.
    energy_tolerance
        Stop where a further iteration would lower the energy by less than this, relatively.
    interfaces
        Faces between regions, which move as the displacement is extended, not to where cells are best: "auto", where an
        array on cells changes that stands for regions (material, region, part, gmsh:physical and the like), or else
        between the cell sets of the file as far as they do not overlap; "ignore"; the name of an array; or (m,)
        integers. Their nodes follow the harmonic extension of the displacement from the initial mesh, so that they are
        in one place for one displacement; those among `moving` go where they are told. A linear operator moves them
        itself.
    schedule
        Other tuned numbers than those the benchmarks were made with.
    comm
        An MPI communicator: every rank hands in its :class:`hexconformal.ranks.MeshPiece`, names those of its nodes
        that move or are fixed, and gives their displacements; all must make the same steps. A node that several ranks
        have moves where one of them or more name it, for all of these in the same way.

    Attributes
    ----------
    mesh, moving
        The mesh or piece as it came, and ids (k,) of the moving nodes.
    moves, held
        Nodes (n,) that move, on ranks where any of them says so, and components (n, 3) that are given or stay.
    notes
        Warnings about the mesh, in words.

    Raises
    ------
    MeshError
        If the mesh cannot be worked on, is not valid, or has quadratic cells.
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
        target: str = "input",
        operator: str = "conformal",
        energy_tolerance: float = 1e-6,
        interfaces: Any = "auto",
        schedule: MotionSchedule | None = None,
        comm: Any = None,
    ) -> None:
        self._schedule = schedule = MotionSchedule() if schedule is None else schedule
        with agreed(comm):
            require_choice("target", target, TARGETS)
            require_choice("operator", operator, OPERATORS)
            require_number("energy_tolerance", energy_tolerance)
            if not 0.0 < energy_tolerance < 1.0:
                raise OptionError(f"energy_tolerance must lie in (0, 1), not {energy_tolerance!r}")
        require_alike(
            comm,
            target=target,
            operator=operator,
            energy_tolerance=energy_tolerance,
            interfaces=interfaces,
            schedule=schedule,
        )
        self._whole = whole = MovingMesh(mesh) if comm is None else MovingPiece(mesh, interfaces, comm)
        self._normalized = normalized = whole.normalized
        self.mesh, self.notes, self._space = whole.mesh, whole.notes, normalized.space
        with agreed(comm):
            self.moving = moving_ids(moving, whole.hexahedra)
            held = fixed_components(whole.hexahedra, fixed)
        if self._space.total(len(self.moving)) == 0:
            raise OptionError("moving must name a node or more: nothing moves")
        self._target, self._operator, self._energy_tolerance = target, operator, energy_tolerance
        held[self.moving] = True
        held = np.column_stack([whole.marked(component) for component in held.T])
        self.held = whole.given_back(held)
        moves = np.zeros(len(self.held), dtype=bool)
        moves[self.moving] = True
        moves = whole.marked(moves)
        self.moves, self._moving = whole.given_back(moves), np.flatnonzero(moves)
        admissible = AdmissibleDirections.from_normal_sums(whole.wall_normals(), held)
        linear = operator != "conformal"
        self._interfaces = CarriedInterfaces(
            normalized, admissible, self._moving, interfaces, linear, schedule.linear_tolerance
        )
        self.notes += self._interfaces.notes
        self._admissible = admissible.with_held(self._interfaces.nodes)
        self._extension = EXTENSIONS[operator if linear else "harmonic"](
            normalized, self._admissible, schedule.linear_tolerance if linear else schedule.guess_tolerance
        )
        self._energy = self._distortion(normalized.points)
        self._types = rows_by_type(normalized.cells)
        self._points = normalized.points
        self._prescribed = np.zeros((len(self._moving), 3))

    @property
    def comm(self) -> Any:
        """The ranks; None in one process."""
        return self._whole.comm

    @property
    def cell_ids(self) -> NDArray[np.int64]:
        """(m,) what reports call the hexahedra, or cells of any type: on all ranks, or by their places."""
        return self._whole.cell_ids

    def at_nodes(self, rows: ArrayLike, ids: ArrayLike) -> Field:
        """Rows (n, 3) at the nodes, of those that all ranks have together of the ids in :meth:`state`."""
        return self._whole.rows_of_state(rows, ids, np.arange(len(self.held)))

    def at_moving_nodes(self, rows: ArrayLike, ids: ArrayLike) -> Field:
        """The same, (k, 3), at those that move."""
        return self._whole.rows_of_state(rows, ids, self.moving)

    @property
    def options(self) -> str:
        """Operator, target and tolerance, in words."""
        return f"{self._operator}, {self._target}, {self._energy_tolerance:g}"

    @property
    def carried(self) -> NDArray[np.int64]:
        """Ids of the nodes of interfaces that follow the extension of the displacement."""
        on = np.zeros(len(self._points), dtype=bool)
        on[self._interfaces.nodes] = True
        return np.flatnonzero(self._whole.given_back(on))

    @property
    def points(self) -> Field:
        """(n, 3) positions of the nodes."""
        return self._whole.given_back(self._normalized.to_user(self._points))

    def step(self, displacement: ArrayLike, dt: float | None = None) -> MotionStep:
        """Move the boundary, and the mesh with it.

        Parameters
        ----------
        displacement
            (k, 3) displacement of the moving nodes from their initial place, in the order they were given in; on ranks
            of those that this one has named.
        dt
            Time the step takes, for the velocity.

        Returns
        -------
        MotionStep
            The mesh at the end of the step, or, if that was refused, as far as it went.

        Raises
        ------
        OptionError
            If the displacement has another shape or is not finite, or `dt` is not positive and finite.
        """
        began = time.perf_counter()
        with agreed(self._whole.comm):
            given = array_of_numbers("displacement", displacement)
            if given.shape != self.moving.shape + (3,):
                raise OptionError(f"displacement must be a finite array {(len(self.moving), 3)}, not {given.shape}")
            odd = self.moving[~np.isfinite(given).all(axis=1)]
            if len(odd):
                named = first_ids(odd, self.mesh.node_labels)
                raise OptionError(f"displacement must be a finite array; NaN or infinite at nodes: {named}")
            if dt is not None and not (is_number(dt) and 0 < dt < np.inf):
                raise OptionError(f"dt must be positive and finite, not {dt!r}")
        require_alike(self._whole.comm, dt=dt)
        before, origin = self.points, self._prescribed
        problem = "displacement: copies of a node must go to one place"
        goal = self._whole.brought(given, self.moving, self._moving, problem) / self._normalized.unit
        if self._target == "current":
            self._energy = self._distortion(self._points)
        reached, share, substeps, iterations = 0.0, 1.0, 0, 0
        blocked = np.zeros(len(self._normalized.cells), dtype=bool)
        while reached < 1.0 and share >= self._schedule.least_share:
            share = min(share, 1.0 - reached)
            last = reached + share >= 1.0
            part = goal if last else origin + (reached + share) * (goal - origin)
            found = self._solve(part, self._energy_tolerance if last else self._schedule.substep_tolerance)
            if isinstance(found, tuple):
                self._points, taken = found
                self._prescribed, reached = part, 1.0 if last else reached + share
                substeps, iterations = substeps + 1, iterations + taken
                share *= 2
            else:
                blocked = found
                share /= 2
        quality = corner_scaled_jacobian(self._points, self._normalized.cells)
        points, ids = self.points, self._whole.ids(blocked & (reached < 1.0))
        report = MotionReport(
            reached=reached,
            substeps=substeps,
            iterations=iterations,
            min_scaled_jacobian=self._space.smallest(quality),
            mean_scaled_jacobian=self._space.mean(quality),
            types={one.cell_type.name: self._space.smallest(quality[one.rows]) for one in self._types},
            blocked=ids,
            reason="" if reached == 1.0 else self._refusal(reached, ids),
            seconds=time.perf_counter() - began,
        )
        return MotionStep(points, None if dt is None else (points - before) / dt, report)

    def state(self) -> dict[str, NDArray[Any]]:
        """State of the motion, for a restart with :meth:`resume`.

        Places of all nodes, and displacements of those that move, with ids; on ranks of the nodes that this one has.
        """
        prescribed = np.zeros_like(self._points)
        prescribed[self._moving] = self._prescribed
        back, ids = self._whole.given_back, self._whole.node_ids
        return {
            "ids": ids.copy(),
            "points": back(self._points).copy(),
            "moving": ids[self.moving],
            "prescribed": back(prescribed)[self.moving],
        }

    def resume(self, state: Mapping[str, ArrayLike]) -> None:
        """Go on from where another run, of the same mesh and options, stood.

        Parameters
        ----------
        state
            What :meth:`state` gave; on ranks each may have any part of it, also from another number of ranks.

        Raises
        ------
        OptionError
            If it belongs to another mesh.
        """
        whole, nodes = self._whole, np.arange(len(self.held))
        with agreed(whole.comm):
            points, ids, prescribed, moving = (state[name] for name in ("points", "ids", "prescribed", "moving"))
        points, prescribed = self.at_nodes(points, ids), self.at_moving_nodes(prescribed, moving)
        self._points = whole.brought(points, nodes, np.arange(len(self._points)))
        self._prescribed = whole.brought(prescribed, self.moving, self._moving)

    def _distortion(self, points: Field) -> DistortionTerm:
        normalized = self._normalized
        inverses = inverse_targets("input", points, normalized.cells, "corners")
        return DistortionTerm(normalized.cells, len(points), None, inverses, 0.0, "corners")

    def _solve(self, prescribed: Field, tolerance: float) -> tuple[Field, int] | NDArray[np.bool_]:
        """The points with their boundary there, and the iterations that took; or which cells stand in the way."""
        normalized = self._normalized
        if self._target == "input" and not self._space.anywhere(bool(prescribed.any())):
            return normalized.points, 0
        linear = self._operator == "harmonic"
        points, since = (normalized.points, 0.0) if linear else (self._points, self._prescribed)
        carried = self._interfaces.nodes
        field = np.zeros_like(points)
        field[self._moving] = prescribed - since
        field[carried] = self._interfaces.places(prescribed) - points[carried]
        guess = points + self._extension(field, points)
        bad = ~is_valid(guess, normalized.cells)
        if self._space.anywhere(bool(bad.any())):
            return bad
        return self._minimize(guess, tolerance) if self._operator == "conformal" else (guess, 1)

    def _minimize(self, points: Field, tolerance: float) -> tuple[Field, int]:
        cells = self._normalized.cells
        project, preconditioner = self._admissible.project, self._extension.preconditioner
        problem = Problem(Objective((self._energy,)), project, lambda points: all_valid(points, cells), self._space)
        at = problem.at(points)
        taken = 0
        for taken, following in enumerate(lbfgs(at, preconditioner), 1):
            decrease, at = at.energy - following.energy, following
            if decrease <= tolerance * at.energy or taken == self._schedule.iterations:
                break
        return at.points, taken

    def _refusal(self, reached: float, blocked: NDArray[np.int64]) -> str:
        return (
            f"the boundary stopped after {reached:.0%} of the step: going on would invert cells "
            f"{self._whole.named(blocked)}; take shorter steps, free more of the boundary, or remesh"
        )
