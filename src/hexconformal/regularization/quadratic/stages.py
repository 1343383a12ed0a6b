"""Unfolding and minimization of a mesh of quadratic hexahedra whose boundary stays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...common import Schedule, tuned
from ...elements import EDGE_NODES, FACES, LATTICE, determinant_bounds
from ...energy import Objective, QuadraticTerm, stretched_boxes
from ...formulation import Iteration
from ...mesh import CellBlock, MixedMesh, boundary_quads
from ...solver import Iterate, Problem, lbfgs

__all__ = ["QuadraticSchedule", "QuadraticSetting", "unfold_and_minimize"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class QuadraticSchedule(Schedule):
    """Numbers of the run for quadratic hexahedra.

    Attributes
    ----------
    evenness
        Weight of the evenness of det J in equation (10a): at 1 it costs about what the distortion does.
    rounds
        Values of eps at most: a curved O-grid with no valid cell takes some ten.
    steps
        Iterations with each: more follow a function that is soon another.
    first_eps
        The first eps over the largest folded determinant.
    least_eps
        Least first eps, in cubes of the mean edge: what is flat has none of its own.
    progress
        Least relative decrease sigma in equation (9).
    settled
        Relative decrease of the energy below which an iteration counts as the last: a digit above rounding is left.
    """

    evenness: float = tuned(1.0)
    rounds: int = tuned(60)
    steps: int = tuned(40)
    first_eps: float = tuned(0.2)
    least_eps: float = tuned(1e-4)
    progress: float = tuned(0.1, 0.0, 1.0)
    settled: float = tuned(1e-9, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class QuadraticSetting:
    """A mesh in units of its edges about its centre, and what of it moves.

    Attributes
    ----------
    mesh
        The user's mesh, of quadratic hexahedra alone.
    schedule
        Numbers of the run.
    """

    mesh: MixedMesh
    schedule: QuadraticSchedule

    @property
    def blocks(self) -> Sequence[CellBlock]:
        """The cells by their type."""
        return self.mesh.blocks

    @cached_property
    def boundary(self) -> Mask:
        """(n,) nodes on the boundary, those on its edges and faces too."""
        found, table = np.zeros(len(self.mesh.points), dtype=bool), self.mesh.table
        quads, owners = boundary_quads(table)
        face = (table[owners][:, FACES] == quads[:, None]).all(axis=2).argmax(axis=1)
        row = np.empty(len(table), dtype=np.int64)
        for block in self.blocks:
            row[block.places] = np.arange(len(block.cells))
            mine = np.isin(owners, block.places)
            lattice = LATTICE[: block.cells.shape[1]]
            members = np.array([np.flatnonzero(lattice[:, axis] == side) for axis in range(3) for side in (0, 2)])
            found[block.cells[row[owners[mine]][:, None], members[face[mine]]]] = True
        return found

    @cached_property
    def free(self) -> Mask:
        """(n,) nodes that move."""
        used = np.zeros(len(self.mesh.points), dtype=bool)
        used[self.mesh.cells] = True
        return used & ~self.boundary & ~self.mesh.held

    @cached_property
    def unit(self) -> float:
        """Median length of an edge, from end to end."""
        ends = [self.mesh.points[block.cells[:, EDGE_NODES[:, :2]]] for block in self.blocks]
        lengths = np.concatenate([np.linalg.norm(x[:, :, 1] - x[:, :, 0], axis=2).ravel() for x in ends])
        return float(np.median(lengths)) or 1.0

    @cached_property
    def centre(self) -> Field:
        """(3,) mean of the points."""
        return np.asarray(self.mesh.points.mean(axis=0))

    @cached_property
    def start(self) -> Field:
        """(n, 3) the points in units of edges."""
        return (self.mesh.points - self.centre) / self.unit

    def to_user(self, points: Field) -> Field:
        """The points in the user's unit; what does not move is what it was, bit by bit."""
        return np.where(self.free[:, None], self.unit * points + self.centre, self.mesh.points)

    @cached_property
    def _boxes(self) -> tuple[Field | None, ...]:
        """Of each type, the boxes of cells that are stretched on purpose."""
        return tuple(stretched_boxes(self.start, np.ascontiguousarray(block.cells[:, :8])) for block in self.blocks)

    def terms(self, eps: float = 0.0) -> tuple[QuadraticTerm, ...]:
        """Equation (10a) for each type."""
        return tuple(
            QuadraticTerm(block.cells, block.cell_type, len(self.mesh.points), boxes, eps, self.schedule.evenness)
            for block, boxes in zip(self.blocks, self._boxes, strict=True)
        )

    def smallest_determinant(self, points: Field) -> float:
        """Of all points of all cells."""
        return min(float(term.determinants(points).min()) for term in self.terms())

    def scaled_jacobians(self, points: Field) -> Field:
        """(m,) smallest scaled Jacobian at the points of each cell."""
        out = np.empty(sum(len(block.cells) for block in self.blocks))
        for block, term in zip(self.blocks, self.terms(), strict=True):
            out[block.places] = term.scaled_jacobians(points)
        return out

    def valid(self, points: Field) -> Mask:
        """(m,) cells that are proved to be valid, where the user's mesh has them."""
        out, points = np.empty(sum(len(block.cells) for block in self.blocks), dtype=bool), self.to_user(points)
        for block in self.blocks:
            out[block.places] = determinant_bounds(points, block.cells, block.cell_type)[0] > 0
        return out

    def problem(self, eps: float, kept: Mask | None = None) -> Problem:
        """The minimization with an eps; cells (m,) that are kept stay valid."""
        objective = Objective(self.terms(eps))
        problem = Problem(objective, self._project)
        if kept is None:
            return problem

        def acceptable(points: Field) -> bool:
            return not (kept & ~self.valid(points)).any()

        def spoiled(points: Field) -> Mask:
            lost, nodes = kept & ~self.valid(points), np.zeros(len(points), dtype=bool)
            for block in self.blocks:
                nodes[block.cells[lost[block.places]]] = True
            return nodes

        return replace(problem, acceptable=acceptable, spoiled=spoiled)

    def _project(self, field: Field) -> Field:
        return np.where(self.free[:, None], field, 0.0)


def unfold_and_minimize(setting: QuadraticSetting, limit: int, tolerance: float) -> Iterator[Iteration]:
    """All iterations, at most `limit` once no point is folded; the last one tells by its phase why it is the last.

    Unfolding may fold what is valid, on the way: its iterates are not for the user to have.
    """
    points = setting.start
    yield Iteration("input", points)
    for points in _unfolded(setting, points):
        yield Iteration("untangle", points)
    if setting.smallest_determinant(points) <= 0.0:
        return
    kept = setting.valid(points)
    current = setting.problem(0.0, kept).at(points)
    first = current.gradient_norm
    steps = lbfgs(current, current.problem.project, scaled=True)
    for _ in range(limit):
        following = next(steps)
        relative = following.gradient_norm / first if first > 0.0 else 0.0
        yield Iteration("lbfgs", following.points, following.energy, relative, following.step)
        done = following.decrease <= setting.schedule.settled * abs(following.energy)
        if following.step == 0.0 or done or relative <= tolerance:
            return


def _unfolded(setting: QuadraticSetting, points: Field) -> Iterator[Field]:
    """Points after each eps, until no determinant is folded."""
    schedule, smallest = setting.schedule, setting.smallest_determinant(points)
    if smallest > 0.0:
        return
    eps = float(np.hypot(schedule.least_eps, schedule.first_eps * smallest))
    for _ in range(schedule.rounds):
        first = last = setting.problem(eps).at(points)
        last = _minimized(first, schedule)
        points, smallest = last.points, setting.smallest_determinant(last.points)
        yield points
        if smallest > 0.0:
            return
        progress = max(1.0 - last.energy / first.energy, schedule.progress)
        # Equation (9); chi without cancellation where the determinant is negative.
        chi = 0.25 * eps * eps / (0.5 * (abs(smallest) + np.hypot(eps, smallest)))
        aim = (1.0 - progress) * chi
        eps = min(2.0 * float(np.sqrt(aim * (aim - smallest))), eps)


def _minimized(current: Iterate, schedule: QuadraticSchedule) -> Iterate:
    steps = lbfgs(current, current.problem.project, scaled=True)
    for _ in range(schedule.steps):
        following = next(steps)
        done = following.decrease <= schedule.settled * abs(following.energy)
        current = following
        if following.step == 0.0 or done:
            break
    return current
