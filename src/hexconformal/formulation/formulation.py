"""The formulation of a minimization: cells, targets, what moves, what keeps the surface; of a mesh or a patch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..elements import all_valid, corner_scaled_jacobian, is_valid
from ..energy import (
    Assembly,
    CornerMeasures,
    CornerTerm,
    CornerWeights,
    Objective,
    Patch,
    Term,
    VolumeTerm,
)
from ..geometry import DistanceBarrier
from ..mesh import SERIAL, Space, boundary_quads
from ..solver import AdmissibleDirections, ConvexEquation, Iterate, Problem, newton
from .compatible_constraint import CompatibleConstraint
from .schedules import Schedules
from .work import Work

__all__ = ["LEVEL", "Formulation", "ValidCells", "convex_newton"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

LEVEL = 1e-6  # of a scaled Jacobian; the smallest one is approached from below where a corner is held


@dataclass(frozen=True, eq=False)
class Formulation:
    """What objectives are made of, with weights that change from stage to stage.

    Attributes
    ----------
    cells
        (m, 8) nodes.
    count
        Number of nodes n.
    inverses
        Inverse target frames as in :class:`hexconformal.energy.DistortionTerm`, empty for cubes.
    admissible
        Directions in which nodes may move.
    barrier
        Keeps curved parts of the boundary near the surface; None where there are none that move.
    target_volumes
        (m,) volumes that cells should have, 0 for those without; empty for none at all.
    volume_factor
        Factor of the weight of volumes.
    rounding
        Of directions, in shortest edges at a node (see :mod:`hexconformal.solver.step_rounding`); 0 for none.
        Patches have a finer one.
    scales
        (m,) weight of each cell; empty where every cell counts the same.
    slender
        (m,) slenderness of each cell up to which its proportions cost nothing; empty where they never do.
    least
        (m,) smallest scaled Jacobian that the type of each cell had at first: where there are several, what is below
        counts as worst. Empty where there is one.
    attainable
        (m,) what the smallest scaled Jacobian around each cell cannot exceed, as the cells are connected (12b); 0 where
        one of them cannot be valid (13b). Empty where that does not count.
    constraint
        The compatible constraint, where it is asked for.
    schedules
        The tuned numbers of all stages.
    work
        What the phase may take; without an end where nothing is said.
    space
        Where fields on the nodes live.
    """

    cells: Ints
    count: int
    inverses: Field
    admissible: AdmissibleDirections
    barrier: DistanceBarrier | None = None
    target_volumes: Field = field(default_factory=lambda: np.empty(0))
    volume_factor: float = 1.0
    rounding: float = 0.0
    scales: Field = field(default_factory=lambda: np.empty(0))
    slender: Field = field(default_factory=lambda: np.empty(0))
    least: Field = field(default_factory=lambda: np.empty(0))
    attainable: Field = field(default_factory=lambda: np.empty(0))
    constraint: CompatibleConstraint | None = None
    schedules: Schedules = field(default_factory=Schedules)
    work: Work = field(default_factory=Work)
    space: Space = SERIAL

    # --------------------------------------------------------------------------------------- objectives
    def objective(self, weights: CornerWeights, volume: float = 0.0) -> Objective:
        """The corner energy (11, 12, 12a), volumes (10) with a weight, and the barrier (14)."""
        if weights.eps == 0.0:
            weights = replace(weights, proportion=self.schedules.minimization.proportion_weight)
        corners = CornerTerm(self.cells, self.inverses, weights, self.scales, self.slender)
        return self.with_distortion(corners, volume)

    def with_distortion(self, distortion: Term, volume: float) -> Objective:
        """A distortion, volumes with a weight, and the barrier."""
        terms: list[Term] = [distortion]
        if volume > 0.0 and len(self.target_volumes):
            terms.append(VolumeTerm(self.cells, self.target_volumes, volume * self.volume_factor))
        terms += [term for term in (self.barrier, self.constraint) if term is not None]
        return Objective(tuple(terms))

    def problem(
        self,
        objective: Objective,
        acceptable: Callable[[Field], bool] = lambda points: True,
        spoiled: Callable[[Field], Mask] | None = None,
    ) -> Problem:
        """The minimization of an objective in admissible directions."""
        search = self.schedules.search
        return Problem(objective, self.admissible.project, acceptable, self.space, search, spoiled)

    @property
    def equation(self) -> ConvexEquation:
        """The convex equation (11) of terms at corners; its matrix is used by all problems of this formulation."""
        return self._equation(self._assembly)

    @property
    def whole_equation(self) -> ConvexEquation:
        """The same for terms that couple all nodes of a cell."""
        return self._equation(Assembly.of_cells(self.cells, self.free, diagonals=True))

    def _equation(self, assembly: Assembly) -> ConvexEquation:
        schedule, coupled = self.schedules.newton, self.admissible.coupled
        return ConvexEquation(assembly, self.projectors, self.cells, self.rounding, schedule=schedule, coupled=coupled)

    @cached_property
    def _assembly(self) -> Assembly:
        return Assembly.of_cells(self.cells, self.free)

    def release(self) -> None:
        """Let go of the matrix of all cells, which is made again where it is needed."""
        self.__dict__.pop("_assembly", None)

    # ------------------------------------------------------------------------------------------ measures
    def measures(self, points: Field) -> CornerMeasures:
        """Determinants and densities of every cell at its corners."""
        return CornerTerm(self.cells, self.inverses).measures(points)

    def fullness(self, points: Field) -> Field:
        """Fullness (m,) of every cell, which the measures tell too."""
        return CornerTerm(self.cells, self.inverses).fullness(points)

    def quality(self, points: Field) -> Field:
        """Smallest scaled Jacobian (m,) of every cell, less than that of all others where it is below its least."""
        quality = corner_scaled_jacobian(points, self.cells)
        if len(self.least) == 0:
            return quality
        below = (quality > 0.0) & (quality < self.least)
        return np.where(below, min(float(quality.min()), 1.0) * quality / np.where(below, self.least, 1.0), quality)

    def spoils_a_type(self, points: Field) -> bool:
        """True where the worst cell of a type is worse than its least."""
        return bool(self.of_spoiled_types(points).any())

    def of_spoiled_types(self, points: Field) -> Mask:
        """(m,) cells of the types whose worst cell is worse than its least."""
        if len(self.least) == 0:
            return np.zeros(len(self.cells), dtype=bool)
        worse = corner_scaled_jacobian(points, self.cells) < self.least - LEVEL
        return np.isin(self.least, self.least[worse])

    def spoiled(self, valid: ValidCells, weights: CornerWeights | None = None) -> Callable[[Field], Mask]:
        """What tells nodes (n,) of cells that are folded, invalid though they must not be, or worse than is allowed."""
        most = (CornerWeights() if weights is None else weights).largest_angles(self.cells)

        def spoiled(points: Field) -> Mask:
            measures, nodes = self.measures(points), np.zeros(len(points), dtype=bool)
            cells = (measures.determinant <= 0.0) | (measures.angle >= most) | valid.spoiled(points)
            nodes[self.cells[cells]] = True
            return self.space.joined(self.admissible.coupled.closed(nodes))

        return spoiled

    def relative_distance(self, points: Field) -> float:
        """Largest distance of the boundary from the surface, in units of its bound."""
        return 0.0 if self.barrier is None else self.barrier.relative_distance(points)

    @cached_property
    def projectors(self) -> Field:
        """(n, 3, 3) orthogonal projections onto the admissible displacements; 0 holds a node."""
        return self.admissible.all_projectors(self.count)

    @cached_property
    def free(self) -> Mask:
        """(n,) nodes that can move at all."""
        return self.admissible.free(self.count)

    @cached_property
    def inner(self) -> Mask:
        """(n,) nodes inside the mesh that can move in all directions, each by itself."""
        inner = (self.projectors == np.eye(3)).all(axis=(1, 2))
        inner[boundary_quads(self.cells)[0]] = False
        if self.barrier is not None:
            inner[self.barrier.nodes] = False
        inner[self.admissible.coupled.nodes] = False
        return np.asarray(inner)

    @cached_property
    def impossible(self) -> Mask:
        """(m,) cells around nodes where not all can be valid, as they are connected (13b)."""
        return np.asarray(self.attainable <= 0.0) if len(self.attainable) else np.zeros(len(self.cells), dtype=bool)

    # --------------------------------------------------------------------------------------------- parts
    def restricted(self, moving: Mask, points: Field) -> tuple[Formulation, Ints]:
        """The formulation of the patch whose nodes are those that move and can, and the ids of its nodes here.

        Nodes that are coupled to one that moves do so too.
        """
        moving = self.admissible.coupled.closed(moving & self.free)
        patch = Patch.around(moving, self.cells, points)
        part = self._of_cells(patch.cells)
        inside = replace(
            part,
            cells=patch.local[part.cells],
            count=len(patch.nodes),
            admissible=self.admissible.restricted(patch),
            barrier=None if self.barrier is None else self.barrier.restricted(patch),
            constraint=None if self.constraint is None else self.constraint.restricted(patch),
            rounding=min(self.rounding, self.schedules.newton.patch_rounding),
        )
        return inside, patch.nodes

    def without(self, cells: Mask) -> Formulation:
        """The formulation without some cells (m,), the nodes of which are held."""
        nodes = np.zeros(self.count, dtype=bool)
        nodes[self.cells[cells]] = True
        nodes = self.space.joined(nodes)
        others = replace(
            self._of_cells(np.flatnonzero(~cells)), admissible=self.admissible.with_held(np.flatnonzero(nodes))
        )
        if len(self.attainable) == 0:
            return others
        # Of the cells around a node one cannot be better; who knows whether it is left.
        attainable = np.where(nodes[others.cells].any(axis=1), 1.0, others.attainable)
        return replace(others, attainable=attainable)

    def with_barrier(self, barrier: DistanceBarrier | None) -> Formulation:
        """The formulation with another barrier."""
        return self._alike(replace(self, barrier=barrier))

    def seen_from(self, points: Field) -> Formulation:
        """The formulation with the barrier as it is seen from points (n, 3): what patches of it begin with."""
        return self if self.barrier is None else self.with_barrier(self.barrier.renewed(points))

    def with_work(self, work: Work) -> Formulation:
        """The formulation with so much work to take."""
        return self._alike(replace(self, work=work))

    def within(self, steps: float) -> Formulation:
        """The formulation with the work of so many Newton steps on the whole mesh; a small one counts as larger."""
        schedule, cells = self.schedules.work, self.space.total(len(self.cells))
        return self.with_work(Work(steps * max(cells, schedule.least_cells), schedule.step_cells))

    def _alike(self, other: Formulation) -> Formulation:
        # What is known of the cells depends on neither.
        for name in ("_assembly", "projectors", "free", "inner"):
            if name in self.__dict__:
                other.__dict__[name] = self.__dict__[name]
        return other

    def _of_cells(self, cells: Ints) -> Formulation:
        return replace(
            self,
            cells=np.ascontiguousarray(self.cells[cells]),
            inverses=self.inverses[cells] if len(self.inverses) > 1 else self.inverses,
            target_volumes=self.target_volumes[cells] if len(self.target_volumes) else self.target_volumes,
            scales=self.scales[cells] if len(self.scales) else self.scales,
            slender=self.slender[cells] if len(self.slender) else self.slender,
            least=self.least[cells] if len(self.least) else self.least,
            attainable=self.attainable[cells] if len(self.attainable) else self.attainable,
        )


class ValidCells:
    """The cells that must be valid (Bernstein): those that are so at the start, and, once they are, others.

    Parameters
    ----------
    points, cells
        The mesh at the start.
    """

    def __init__(self, points: Field, cells: Ints) -> None:
        self._cells, self._valid = cells, is_valid(points, cells)

    def __call__(self, points: Field) -> bool:
        """True where all of them are valid at points (n, 3)."""
        return all_valid(points, self._cells, None if self._valid.all() else np.flatnonzero(self._valid))

    def spoiled(self, points: Field) -> Mask:
        """(m,) those of them that are not."""
        return self._valid & ~is_valid(points, self._cells)

    def grow(self, points: Field) -> None:
        """Take in the cells that are valid at points (n, 3)."""
        if not self._valid.all():
            self._valid |= is_valid(points, self._cells)


def convex_newton(
    formulation: Formulation, points: Field, weights: CornerWeights, volume: float | None = None, decrease: float = 1e-3
) -> Iterator[Iterate]:
    """Newton's method with the convex equation; yields the iterate after every step.

    Volumes count with a weight, default that of the schedule. Ends where two steps in a row lower the objective by less
    than the given fraction, no step lowers it, or the formulation's work is done. A cell that is valid everywhere
    (Bernstein) stays so, and so does one that becomes so.
    """
    volume = formulation.schedules.minimization.volume_weight if volume is None else volume
    valid, slow = ValidCells(points, formulation.cells), 0
    objective, spoiled = formulation.objective(weights, volume), formulation.spoiled(valid, weights)
    problem = formulation.problem(objective, valid, spoiled)
    steps = newton(problem.start(points), formulation.equation)
    while formulation.work.take(len(formulation.cells)):
        iterate = next(steps)
        if iterate.step == 0.0:
            return
        valid.grow(iterate.points)
        yield iterate
        slow = slow + 1 if iterate.decrease <= decrease * abs(iterate.energy + iterate.decrease) else 0
        if slow == 2:
            return
