"""Minimize the distortion, by either energy, with what else counts: volumes, and the distance of the boundary."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from copy import deepcopy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..elements import cell_volumes, edge_lengths
from ..energy import CornerWeights, DistortionTerm, Objective, inverse_targets, normalized_target
from ..formulation import Formulation, Iteration, ValidCells
from ..mesh import NormalizedMesh
from ..solver import (
    ConvexEquation,
    Iterate,
    LaplacePreconditioner,
    MatrixFreeEquation,
    Preconditioner,
    Problem,
    block_preconditioner,
    lbfgs,
    newton,
)
from .options import Options

__all__ = ["Minimization", "distortion_term"]

Field = NDArray[np.float64]

_CORNERS = 8.0  # beside other terms corners count 1 each, and so all points of a quadrature together


def distortion_term(normalized: NormalizedMesh, options: Options) -> DistortionTerm:
    """The distortion of a mesh as the options ask for it."""
    scales = None
    if options.weight == "volume":
        volumes = np.abs(cell_volumes(normalized.points, normalized.cells))
        mean = normalized.space.mean(volumes)
        scales = volumes / mean if mean > 0.0 else None
    target, rule = normalized_target(options.target, normalized), options.quadrature_rule
    inverses = inverse_targets(target, normalized.points, normalized.cells, rule, normalized.cell_labels)
    eps = None if options.energy == "quaternionic" else 0.0
    return DistortionTerm(normalized.cells, len(normalized.points), scales, inverses, eps, rule)


class Minimization:
    """Minimization of the summed distortion in admissible directions; iterate to do it.

    Parameters
    ----------
    distortion
        The distortion of the cells.
    formulation
        Directions nodes may go in, and what else counts.
    options
        Energy, method, tolerance, and what comes afterwards.
    points
        (n, 3) where to start from; valid cells stay valid.
    referenced
        (n,) nodes that belong to a cell.
    alone
        True where nothing counts but the distortion.
    acceptable
        What else must hold where it steps to.

    Attributes
    ----------
    reason
        Reason of its end, in words.
    converged
        True where the tolerance was reached.
    """

    def __init__(
        self,
        distortion: DistortionTerm,
        formulation: Formulation,
        options: Options,
        points: Field,
        referenced: NDArray[np.bool_],
        alone: bool,
        acceptable: Callable[[Field], bool] = lambda points: True,
    ) -> None:
        self.reason, self.converged = "interrupted", False
        self._distortion, self._formulation, self._options = distortion, formulation, options
        self._start, self._referenced, self._alone, self._acceptable = points, referenced, alone, acceptable
        self._schedule = formulation.schedules.minimization
        self._at_corners = distortion.quadrature == "corners" and distortion.eps is not None

    def __iter__(self) -> Iterator[Iteration]:
        schedule, options, method = self._schedule, self._options, self._options.method
        phases = (method,) if method != "auto" else ("lbfgs", "newton") if self._alone else ("majorize",)
        valid = ValidCells(self._start, self._formulation.cells)
        start = self._start
        if method == "auto" and self._alone and self._distortion.eps is not None:
            start = yield from self._thicken(valid)
        at = self._problem(self._objective(), valid).at(start)
        first, slow = at.gradient_norm, 0
        if self._is_stationary(at, first):
            return
        few = method == "auto" and self._formulation.barrier is not None and options.raises_worst
        few = few and not options.changes_sizes
        for phase in phases:
            for taken, following in enumerate(self._steps(phase, at), 1):
                if following.step == 0.0:
                    break
                rapid = following.energy < (1.0 - schedule.rapid) * at.energy
                # What a step wins may be lost again where normals are renewed: it is the whole that counts.
                slow = slow + 1 if at.energy - following.energy < self._stall * at.energy else 0
                at = following
                valid.grow(at.points)
                yield self._told(phase, at, first)
                if self._is_stationary(at, first):
                    return
                if few and taken >= schedule.few_steps and not rapid:
                    break
                if slow == 2:
                    self.reason, self.converged = "the energy stalls", not self._alone
                    return
                near = at.gradient_norm <= schedule.newton_gradient * first
                if phase != phases[-1] and (taken == schedule.handover or near):
                    break
        self.reason = "no step lowers the energy further without spoiling a cell"

    def _thicken(self, valid: ValidCells) -> Generator[Iteration, None, Field]:
        """Lower the distortion with chi_eps of equation (9) as long as that makes the thinnest cell thicker.

        At a thin cell the barrier is so steep that its gradient tells nothing of the other cells; chi_eps is bounded.
        Returns the points at which the thinnest cell is thickest.
        """
        points, schedule, space = self._start, self._formulation.schedules.thin, self._formulation.space
        thinnest, since = space.smallest(self._formulation.fullness(points)), 0
        if thinnest >= schedule.steep:
            return points
        eps = schedule.steep_eps * space.median(self._formulation.measures(points).determinant)
        at = self._problem(Objective((replace(self._distortion, eps=eps),)), valid).at(points)
        for following in lbfgs(at, self._preconditioner(at)):
            now, since = space.smallest(self._formulation.fullness(following.points)), since + 1
            if now > thinnest:
                points, thinnest, since = following.points, now, 0
                valid.grow(points)
                yield Iteration("thicken", points, step=following.step)
            if thinnest >= schedule.steep or since == schedule.steep_patience or following.step == 0.0:
                return points
        return points

    def _problem(self, objective: Objective, valid: ValidCells) -> Problem:
        # The quaternionic energy does not mind what is folded.
        spoiled = None if self._distortion.eps is None else self._formulation.spoiled(valid)
        return self._formulation.problem(objective, lambda x: valid(x) and self._acceptable(x), spoiled)

    @property
    def _stall(self) -> float:
        """Relative decrease two of which in a row end it; negative for none."""
        if self._options.raises_worst and not self._options.changes_sizes:
            return self._schedule.stall
        return -1.0 if self._alone else self._schedule.decrease

    def _told(self, phase: str, at: Iterate, first: float) -> Iteration:
        """The iteration; other things that are minimized with the distortion are not told."""
        if self._alone:
            return Iteration(phase, at.points, at.energy, at.gradient_norm / first, at.step)
        return Iteration("distortion" if self._options.method == "auto" else phase, at.points, step=at.step)

    def _objective(self) -> Objective:
        if self._alone:
            return Objective((self._distortion,))
        raised = self._options.raises_worst and not self._options.changes_sizes
        volume = self._schedule.volume_weight if raised else self._schedule.sizes_weight
        if self._at_corners:
            return self._formulation.objective(CornerWeights(), volume)
        return self._formulation.with_distortion(self._distortion.scaled(_CORNERS), volume)

    def _steps(self, phase: str, at: Iterate) -> Iterator[Iterate]:
        if phase == "majorize" and not (self._alone and self._distortion.eps is None):
            return newton(at, self._convex_equation())
        preconditioner = self._preconditioner(at)
        if phase == "lbfgs":
            return lbfgs(at, preconditioner)
        frozen, schedule = phase == "majorize", self._formulation.schedules.newton
        return newton(at, MatrixFreeEquation(preconditioner, at.gradient_norm, frozen, schedule))

    def _convex_equation(self) -> ConvexEquation:
        of_corners = self._at_corners and not self._alone
        return self._formulation.equation if of_corners else self._formulation.whole_equation

    def _preconditioner(self, at: Iterate) -> Preconditioner:
        """Multigrid for the distortion alone; with other terms one sweep over the convex blocks of them all."""
        if self._alone:
            laplacian = self._distortion.laplacian(self._stiffness())
            multigrid = self._formulation.schedules.multigrid
            where = self._formulation.admissible, self._referenced, multigrid, self._formulation.space
            return LaplacePreconditioner(laplacian, *where)
        equation = self._convex_equation()
        equation.convex(at)
        # What the formulation assembles next, in a run that is left and asked for its result, is not to be seen here.
        matrix, coupled = deepcopy(equation.assembly.matrix), equation.coupled
        space = self._formulation.space
        return block_preconditioner(matrix, equation.projectors, equation.added, space, coupled)

    def _is_stationary(self, at: Iterate, first: float) -> bool:
        """True where the gradient is small enough."""
        norm, tolerance, space = at.gradient_norm, self._options.gradient_tolerance, self._formulation.space
        if norm <= tolerance * first:
            self.reason = f"gradient fell below {tolerance:g} of its start"
        elif norm <= self._schedule.rounding * np.sqrt(space.total(len(space.own(at.points)))):
            self.reason = "gradient is at the level of rounding"
        else:
            return False
        self.converged = True
        return True

    def _stiffness(self) -> Field | None:
        """Stiffness of each cell: the Hessian of E / det^(2/3) goes with det^(-2/3)."""
        if self._distortion.eps is None:
            return None
        cells = self._distortion.cells
        size = (edge_lengths(self._start, cells) ** 2).mean(axis=1) ** 1.5
        return np.maximum(cell_volumes(self._start, cells), self._schedule.least_volume * size) ** (-2.0 / 3.0)
