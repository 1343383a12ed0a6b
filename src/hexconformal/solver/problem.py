"""A constrained minimization, its iterates, and the line search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..common import Schedule, tuned
from ..energy import Objective
from ..mesh import SERIAL, Space

__all__ = ["Iterate", "Preconditioner", "Problem", "SearchSchedule", "line_search"]

Field = NDArray[np.float64]

# Values closer than this (relative) are distinguished by their slopes instead (Hager & Zhang 2005).
_ROUNDING = 1e-13


Mask = NDArray[np.bool_]
Preconditioner = Callable[[Field], Field]  # maps an admissible gradient to an admissible displacement


@dataclass(frozen=True)
class SearchSchedule(Schedule):
    """The line search, and what L-BFGS keeps.

    Attributes
    ----------
    enough
        Decrease of the objective, relative to what the slope promises, that is enough for a step: any real one.
    halvings
        Of a step, at most: what is shorter is rounding.
    flatter
        Share of the slope below which it must have come where values are alike but for rounding.
    memory
        Pairs that L-BFGS keeps: more cost memory and win little.
    patience
        Halvings after which it is looked for cells that stand against a step.
    few
        Share of the nodes up to which these are few, and must not stop all others: many are better off together.
    held_back
        Shares of a direction left, one after the other, at nodes of such cells.
    """

    enough: float = tuned(1e-4, 0.0, 1.0)
    halvings: int = tuned(40)
    flatter: float = tuned(0.9, 0.0, 1.0)
    memory: int = tuned(10)
    patience: int = tuned(3)
    few: float = tuned(0.05, 0.0, 1.0)
    held_back: tuple[float, ...] = tuned((0.25, 0.25, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Problem:
    """A constrained minimization.

    Attributes
    ----------
    objective
        What is minimized.
    project
        Orthogonal projection of an (n, 3) field onto the admissible displacements.
    acceptable
        True where a mesh may be stepped to, however low its value.
    space
        Where the fields live.
    search
        Numbers of the line search.
    spoiled
        (n,) nodes of cells that are not acceptable at some points; None where that is not known.
    """

    objective: Objective
    project: Callable[[Field], Field]
    acceptable: Callable[[Field], bool] = lambda points: True
    space: Space = SERIAL
    search: SearchSchedule = field(default_factory=SearchSchedule)
    spoiled: Callable[[Field], Mask] | None = None

    def start(self, points: Field) -> Iterate:
        """The iterate at points (n, 3), of which nothing is known yet."""
        return Iterate(self, points, float("nan"))

    def at(self, points: Field, step: float = 0.0, with_gradient: bool = True) -> Iterate:
        """The iterate at points (n, 3)."""
        if not with_gradient:
            return Iterate(self, points, self.space.total(self.objective.value(points)), step)
        value, gradient = self.objective.value_gradient(points)
        return Iterate(self, points, self.space.total(value), step, self.project(self.space.add(gradient)))


@dataclass(frozen=True, eq=False)
class Iterate:
    """A point of a minimization.

    Attributes
    ----------
    problem
        The minimization, as it is seen from where the step began.
    points
        (n, 3) positions.
    energy
        Value of the objective; NaN at a start, where nothing is known.
    step
        Length of the step to here, 1 for a full one; 0 where nothing better was found.
    known_gradient
        (n, 3) admissible gradient, where it is known already.
    decrease
        By how much the step has lowered the objective.
    """

    problem: Problem
    points: Field
    energy: float
    step: float = 0.0
    known_gradient: Field | None = None
    decrease: float = 0.0

    @cached_property
    def gradient(self) -> Field:
        """(n, 3) admissible gradient."""
        if self.known_gradient is not None:
            return self.known_gradient
        return self.problem.at(self.points).gradient

    @property
    def has_finite_gradient(self) -> bool:
        """True where the gradient is finite at all nodes."""
        space = self.problem.space
        return space.everywhere(bool(np.isfinite(space.own(self.gradient)).all()))

    @property
    def gradient_norm(self) -> float:
        """Euclidean norm of the gradient."""
        return float(np.sqrt(self.problem.space.inner(self.gradient, self.gradient)))

    def renewed(self) -> Iterate:
        """The iterate of the problem as it is seen from here; itself where that makes no difference."""
        objective = self.problem.objective.renewed(self.points)
        if objective is self.problem.objective:
            return self
        return replace(self.problem, objective=objective).at(self.points, self.step)


def line_search(current: Iterate, direction: Field, with_gradient: bool = True) -> Iterate:
    """Backtrack along a direction to an acceptable mesh of sufficiently lower value.

    Parameters
    ----------
    current
        Where the search begins.
    direction
        (n, 3) admissible direction.
    with_gradient
        Compute the gradients with the values, which costs little for some objectives.

    Returns
    -------
    The first iterate that is good enough; the current one, with a step of 0, if there is none.
    """
    problem, search = current.problem, current.problem.search
    slope = problem.space.inner(current.gradient, direction)
    step = 1.0
    for halving in range(search.halvings):
        trial = problem.at(problem.space.update(current.points + step * direction), step, with_gradient)
        if np.isfinite(trial.energy) and (not with_gradient or trial.has_finite_gradient):
            enough = trial.energy <= current.energy + search.enough * step * slope
            # At the level of rounding the slope still tells whether the step is too long.
            flat = (
                not enough
                and trial.energy <= current.energy + _ROUNDING * abs(current.energy)
                and abs(problem.space.inner(trial.gradient, direction)) <= -search.flatter * slope
            )
            if (enough or flat) and problem.space.everywhere(problem.acceptable(trial.points)):
                return replace(trial, decrease=current.energy - trial.energy)
        step *= 0.5
        if halving == search.patience and (shorter := _held_back(current, direction)) is not None:
            direction, slope, step = shorter, problem.space.inner(current.gradient, shorter), 1.0
    return replace(current, step=0.0, decrease=0.0)


def _held_back(current: Iterate, direction: Field) -> Field | None:
    """The direction, shorter at nodes of cells that it would spoil; None if there are none, or it would not descend."""
    problem = current.problem
    if problem.spoiled is None:
        return None
    space, shorter, held = problem.space, direction, np.zeros(len(direction), dtype=bool)
    for share in problem.search.held_back:
        nodes = problem.spoiled(space.update(current.points + shorter))
        if not space.anywhere(bool(nodes.any())):
            break
        shorter, held = np.where(nodes[:, None], share * shorter, shorter), held | nodes
    count, whole = space.total(space.own(held).sum()), space.total(len(space.own(held)))
    if not 0 < count <= max(8.0, problem.search.few * whole):
        return None
    # Not to the brink.
    shorter = np.where(held[:, None], 0.5 * shorter, shorter)
    descends = space.inner(current.gradient, shorter) < 0.0
    return shorter if descends else None
