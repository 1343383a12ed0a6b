"""Minimizers as generators: each yields the iterate after every iteration, and the caller decides when to stop.

All of them see the same problem: a smooth energy, a linear space of admissible displacements, a positive
definite preconditioner, and a test that says whether a mesh may be accepted at all. Whatever is yielded is valid.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..kernel import loop, parallel_ranges

__all__ = [
    "ARMIJO",
    "MINIMIZERS",
    "Iterate",
    "Problem",
    "conjugate_gradients",
    "initial_iterate",
    "inner",
    "lbfgs",
    "majorize",
    "newton",
]

Field = NDArray[np.float64]

ARMIJO = 1e-4  # decrease of the energy, relative to what the slope promises, that is enough for a step
_HALVINGS = 40
_MEMORY = 10
# Energies closer than this (relative) are distinguished by their slopes instead (Hager & Zhang 2005).
_ROUNDING = 1e-13


class Energy(Protocol):
    """An energy that can be minimized: value with gradient, and second derivatives times a field."""

    def value_gradient(self, points: Field) -> tuple[float, Field]: ...
    def second_product(self, points: Field, variation: Field) -> Field: ...
    def frozen_product(self, points: Field, variation: Field) -> Field: ...


@dataclass(frozen=True)
class Problem:
    """A constrained minimization.

    Attributes
    ----------
    energy
        Value, gradient and second derivatives.
    project
        Orthogonal projection of an (n, 3) field onto the admissible displacements.
    preconditioner
        Positive definite approximation of the inverse Hessian, maps admissible fields to admissible fields.
    acceptable
        True where a mesh may be stepped to, however low its energy.
    """

    energy: Energy
    project: Callable[[Field], Field]
    preconditioner: Callable[[Field], Field]
    acceptable: Callable[[Field], bool]


@dataclass(frozen=True)
class Iterate:
    """One accepted point of a minimization; ``step`` is 0 where the line search found nothing better."""

    points: Field
    energy: float
    gradient: Field
    step: float

    @property
    def gradient_norm(self) -> float:
        """Euclidean norm of the gradient."""
        return float(np.sqrt(inner(self.gradient, self.gradient)))


def inner(a: Field, b: Field) -> float:
    """Euclidean inner product of two fields, without BLAS: its threads would spin beside ours."""
    return float(np.einsum("ij,ij->", a, b))


@loop
def _accumulate(first, last, x, factor, y):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        for k in range(3):
            x[i, k] += factor * y[i, k]


def accumulate(x: Field, factor: float, y: Field) -> None:
    """Add a multiple of one field to another, in place."""
    parallel_ranges(_accumulate, len(x), x, factor, y)


def initial_iterate(problem: Problem, points: Field) -> Iterate:
    """The iterate at points (n, 3), before any step."""
    energy, gradient = problem.energy.value_gradient(points)
    return Iterate(points, energy, problem.project(gradient), 0.0)


def line_search(problem: Problem, current: Iterate, direction: Field) -> Iterate:
    """Backtrack along a direction to an acceptable mesh of sufficiently lower energy."""
    slope = inner(current.gradient, direction)
    step = 1.0
    for _ in range(_HALVINGS):
        points = current.points + step * direction
        energy, gradient = problem.energy.value_gradient(points)
        if np.isfinite(energy) and np.isfinite(gradient).all():
            gradient = problem.project(gradient)
            enough = energy <= current.energy + ARMIJO * step * slope
            # At the level of rounding the slope still tells whether the step is too long.
            flat = (
                energy <= current.energy + _ROUNDING * abs(current.energy)
                and abs(inner(gradient, direction)) <= -0.9 * slope
            )
            if (enough or flat) and problem.acceptable(points):
                return Iterate(points, energy, gradient, step)
        step *= 0.5
    return Iterate(current.points, current.energy, current.gradient, 0.0)


def lbfgs(problem: Problem, current: Iterate) -> Iterator[Iterate]:
    """Limited-memory BFGS (Nocedal & Wright, algorithm 7.4) with the problem's preconditioner as initial inverse."""
    pairs: deque[tuple[Field, Field, float]] = deque(maxlen=_MEMORY)
    while True:
        q = current.gradient.copy()
        factors = []
        for s, y, rho in reversed(pairs):
            factors.append(rho * inner(s, q))
            accumulate(q, -factors[-1], y)
        direction = problem.preconditioner(q)
        for (s, y, rho), factor in zip(pairs, reversed(factors), strict=True):
            accumulate(direction, factor - rho * inner(y, direction), s)
        following = line_search(problem, current, -direction)
        if following.step == 0.0 and pairs:
            pairs.clear()
            continue
        s, y = following.points - current.points, following.gradient - current.gradient
        curvature = inner(s, y)
        if curvature > 1e-10 * np.sqrt(inner(s, s) * inner(y, y)):
            pairs.append((s, y, 1.0 / curvature))
        current = following
        yield current


def conjugate_gradients(
    product: Callable[[Field], Field],
    preconditioner: Callable[[Field], Field],
    rhs: Field,
    tolerance: float,
    max_iterations: int = 200,
) -> Field:
    """Preconditioned conjugate gradients from zero; stops at a direction of negative curvature.

    Stops when |r| <= tolerance |rhs| in the norm of the preconditioner. Before the first step a direction of negative
    curvature is returned as it is: it still descends.
    """
    x = np.zeros_like(rhs)
    r = rhs.copy()
    z = preconditioner(r)
    p = z.copy()
    rz = first = inner(r, z)
    for iteration in range(max_iterations):
        if rz <= tolerance**2 * first:
            break
        hp = product(p)
        curvature = inner(p, hp)
        if curvature <= 0.0:
            return p if iteration == 0 else x
        alpha = rz / curvature
        accumulate(x, alpha, p)
        accumulate(r, -alpha, hp)
        z = preconditioner(r)
        rz, old = inner(r, z), rz
        p *= rz / old
        p += z
    return x


def newton(problem: Problem, current: Iterate) -> Iterator[Iterate]:
    """Newton's method with inexact solves by conjugate gradients, exact Hessian, negative curvature safe."""
    initial = current.gradient_norm
    while True:
        forcing = min(0.1, np.sqrt(current.gradient_norm / initial)) if initial else 0.1
        base = current.points

        def product(field: Field, base: Field = base) -> Field:
            return problem.project(problem.energy.second_product(base, field))

        direction = conjugate_gradients(product, problem.preconditioner, -current.gradient, forcing)
        current = line_search(problem, current, direction)
        yield current


def majorize(problem: Problem, current: Iterate) -> Iterator[Iterate]:
    """Majorize-minimize: freeze the normals, solve the linear problem, repeat (Gruber & Aulisa, volumetric remeshing).

    Every full step lowers the quaternionic energy, since the frozen energy lies above it, equation (5); the line search
    only shortens a step where the mesh would become unacceptable.
    """
    while True:
        base = current.points

        def product(field: Field, base: Field = base) -> Field:
            return problem.project(problem.energy.frozen_product(base, field))

        direction = conjugate_gradients(product, problem.preconditioner, -current.gradient, 1e-10)
        current = line_search(problem, current, direction)
        yield current


MINIMIZERS: dict[str, Callable[[Problem, Iterate], Iterator[Iterate]]] = {
    "lbfgs": lbfgs,
    "newton": newton,
    "majorize": majorize,
}
