"""Newton's method: one loop, and the equations that its directions solve."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..common import Schedule, tuned
from ..energy import Assembly
from .block_solver import solve_blocks
from .conjugate_gradients import conjugate_gradients
from .coupled_nodes import UNCOUPLED, CoupledNodes
from .problem import Iterate, Preconditioner, line_search
from .step_rounding import round_direction

__all__ = ["ConvexEquation", "Equation", "MatrixFreeEquation", "NewtonSchedule", "newton", "newton_step"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class NewtonSchedule(Schedule):
    """Newton's method.

    Attributes
    ----------
    forcing
        Largest tolerance of the exact equation; it falls with the root of the gradient, so that convergence is fast.
    frozen_tolerance
        Of the equation with frozen normals, which is solved as it is meant.
    tolerance, iterations
        Of the convex equation: more is not worth it, as the next one is another.
    shifts
        Bounds of what is added to its diagonal, in traces: it stands in for the curvature that is left out.
    short, shift_factor
        Steps below this get a larger shift next time, others a smaller one, and by how much.
    mesh_rounding, patch_rounding
        What directions are rounded to, in shortest edges at a node: on a whole mesh they need less precision than on a
        patch.
    """

    forcing: float = tuned(0.1, 0.0, 1.0)
    frozen_tolerance: float = tuned(1e-10, 0.0, 1.0)
    tolerance: float = tuned(0.1, 0.0, 1.0)
    iterations: int = tuned(50)
    shifts: tuple[float, float] = tuned((1e-5, 1e-1))
    short: float = tuned(0.3, 0.0, 1.0)
    shift_factor: float = tuned(4.0, 1.0)
    mesh_rounding: float = tuned(2.0**-10, 0.0, 1.0)
    patch_rounding: float = tuned(2.0**-11, 0.0, 1.0)


class Equation(Protocol):
    """The linear equation that a direction solves."""

    @property
    def needs_gradients(self) -> bool:
        """True where the line search should compute gradients with the values."""
        ...

    def solve(self, current: Iterate) -> tuple[Iterate, Field]:
        """The iterate as it is seen from itself, and the direction from it."""
        ...

    def after(self, step: float) -> Equation:
        """The equation to take after a step of some length."""
        ...


def newton(current: Iterate, equation: Equation) -> Iterator[Iterate]:
    """Newton's method.

    Parameters
    ----------
    current
        Where to begin.
    equation
        What the directions solve.

    Yields
    ------
    The iterate after every iteration; with a step of 0 where nothing better was found.
    """
    while True:
        current, equation = newton_step(current, equation)
        yield current


def newton_step(current: Iterate, equation: Equation) -> tuple[Iterate, Equation]:
    """One step: the iterate after it, and the equation of the next."""
    current, direction = equation.solve(current)
    following = line_search(current, direction, equation.needs_gradients)
    return following, equation.after(following.step)


@dataclass(frozen=True, eq=False)
class MatrixFreeEquation:
    """H d = -g by conjugate gradients with products alone, inexactly; safe where curvature is negative.

    Attributes
    ----------
    preconditioner
        Positive definite approximation of the inverse Hessian.
    first
        Norm of the gradient at the start of the minimization, which tells how far it is.
    frozen
        Normals are frozen, which gives the majorizing Hessian of the quaternionic energy (Gruber & Aulisa, volumetric
        remeshing): every full step lowers it, since the frozen energy lies above it, equation (5). Solved to rounding.
    schedule
        Tolerances.
    """

    preconditioner: Preconditioner
    first: float
    frozen: bool = False
    schedule: NewtonSchedule = field(default_factory=NewtonSchedule)

    @property
    def needs_gradients(self) -> bool:
        """They cost little beside the values."""
        return True

    def solve(self, current: Iterate) -> tuple[Iterate, Field]:
        """The iterate as it is seen from itself, and the direction from it."""
        current = current.renewed()
        problem = current.problem
        of = problem.objective.frozen_product if self.frozen else problem.objective.second_product

        def product(field: Field) -> Field:
            return problem.project(problem.space.add(of(current.points, problem.space.update(field))))

        tolerance = self.schedule.frozen_tolerance
        if not self.frozen:
            progress = np.sqrt(current.gradient_norm / self.first) if self.first else 1.0
            tolerance = min(self.schedule.forcing, progress)
        found = conjugate_gradients(product, self.preconditioner, -current.gradient, tolerance, space=problem.space)
        return current, found

    def after(self, step: float) -> MatrixFreeEquation:
        """The same equation."""
        return self


@dataclass(frozen=True, eq=False)
class ConvexEquation:
    """(C + shift) d = -g with the convex part C of the Hessian, equation (11), assembled and solved to a tenth.

    Attributes
    ----------
    assembly
        Where the objective's blocks are added.
    projectors
        (n, 3, 3) projections onto the admissible displacements.
    cells, rounding
        Directions are rounded to multiples of so many shortest edges of the cells, see
        :mod:`hexconformal.solver.step_rounding`; 0 for none.
    shift
        Added to the diagonal blocks, relative to their trace; None for the least.
    schedule
        Tolerances and shifts.
    coupled
        Nodes that move together.
    """

    assembly: Assembly
    projectors: Field
    cells: Ints
    rounding: float = 0.0
    shift: float | None = None
    schedule: NewtonSchedule = field(default_factory=NewtonSchedule)
    coupled: CoupledNodes = UNCOUPLED

    @property
    def needs_gradients(self) -> bool:
        """They come with the next assembly."""
        return False

    def solve(self, current: Iterate) -> tuple[Iterate, Field]:
        """The iterate as it is seen from itself, and the direction from it."""
        current = self.convex(current)
        limits = self.schedule.tolerance, self.schedule.iterations
        matrix, gradient = self.assembly.matrix, current.gradient
        space = current.problem.space
        direction = solve_blocks(matrix, -gradient, self.projectors, *limits, self.added, space, self.coupled)
        if self.rounding > 0.0:
            rounded = round_direction(direction, current.points, self.cells, self.rounding, self.coupled, space)
            direction = current.problem.project(rounded)
        return current, direction

    def convex(self, current: Iterate) -> Iterate:
        """Assemble the convex blocks; returns the iterate as it is seen from itself."""
        problem = current.problem
        energy, gradient, objective = problem.objective.convex(current.points, self.assembly)
        problem = replace(problem, objective=objective)
        gradient = problem.project(problem.space.add(gradient))
        return replace(current, problem=problem, energy=problem.space.total(energy), known_gradient=gradient)

    def after(self, step: float) -> ConvexEquation:
        """The equation with a larger shift after a short step, a smaller one after a long one."""
        low, high = self.schedule.shifts
        factor = self.schedule.shift_factor
        shift = min(high, factor * self.added) if step < self.schedule.short else max(low, self.added / factor)
        return replace(self, shift=shift)

    @property
    def added(self) -> float:
        """What is added to the diagonal blocks."""
        return self.schedule.shifts[0] if self.shift is None else self.shift
