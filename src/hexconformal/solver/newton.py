"""Newton's method: one loop, and the equations that its directions solve."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..energy import Assembly
from .block_solver import solve_blocks
from .conjugate_gradients import conjugate_gradients
from .problem import Iterate, Preconditioner, line_search
from .step_rounding import round_direction

__all__ = ["ConvexEquation", "Equation", "MatrixFreeEquation", "newton", "newton_step"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_FORCING = 0.1  # largest tolerance of the exact equation; it falls with the root of the gradient
_FROZEN_TOLERANCE = 1e-10  # of the equation with frozen normals
_SOLVE_TOLERANCE, _SOLVE_ITERATIONS = 0.1, 50  # tolerance and limit of the truncated solves of the convex equation
_SHIFTS = (1e-5, 1e-1)  # bounds of the shift that stands in for the curvature the convex Hessian leaves out
_SHORT, _SHIFT_FACTOR = 0.3, 4.0  # steps below this get a larger shift next time, others a smaller one


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
    """

    preconditioner: Preconditioner
    first: float
    frozen: bool = False
    needs_gradients: bool = True

    def solve(self, current: Iterate) -> tuple[Iterate, Field]:
        """The iterate as it is seen from itself, and the direction from it."""
        current = current.renewed()
        problem = current.problem
        of = problem.objective.frozen_product if self.frozen else problem.objective.second_product

        def product(field: Field) -> Field:
            return problem.project(problem.space.add(of(current.points, field)))

        tolerance = _FROZEN_TOLERANCE
        if not self.frozen:
            tolerance = min(_FORCING, np.sqrt(current.gradient_norm / self.first)) if self.first else _FORCING
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
        Added to the diagonal blocks, relative to their trace.
    """

    assembly: Assembly
    projectors: Field
    cells: Ints
    rounding: float = 0.0
    shift: float = _SHIFTS[0]
    needs_gradients: bool = False

    def solve(self, current: Iterate) -> tuple[Iterate, Field]:
        """The iterate as it is seen from itself, and the direction from it."""
        current = self.convex(current)
        direction = solve_blocks(
            self.assembly.matrix, -current.gradient, self.projectors, _SOLVE_TOLERANCE, _SOLVE_ITERATIONS, self.shift
        )
        if self.rounding > 0.0:
            rounded = round_direction(direction, current.points, self.cells, self.rounding)
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
        low, high = _SHIFTS
        shift = min(high, _SHIFT_FACTOR * self.shift) if step < _SHORT else max(low, self.shift / _SHIFT_FACTOR)
        return replace(self, shift=shift)
