"""The stages of a run: unfold, lower the distortion, raise the worst cells; each yields iterations as it goes."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..elements import are_collapsed, corner_scaled_jacobian
from ..formulation import Formulation, Iteration
from ..geometry import DistanceBarrier
from ..ranks import NormalizedPiece
from ..untangling import improve_folded, thicken, untangle_interior
from .acceptance import sheets_distance
from .boundary import Boundary
from .compatible_steps import CompatibleSteps
from .fitting import fit
from .minimize import Minimization
from .on_ranks.unfolding_on_ranks import unfold_on_ranks
from .return_to_surface import return_to_surface, towards
from .setting import Setting
from .unfolding import Unfolded, hold_folded, unfold, within_bound
from .worst_cells import next_to_flat, raise_worst, raise_worst_patches, reopen_worst, soften_curves

__all__ = ["Stages", "State"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]
Raising = Callable[[Formulation, Field, bool], Iterator[Iteration]]


@dataclass(frozen=True, eq=False)
class State:
    """Where a run is.

    Attributes
    ----------
    boundary
        Constraint and barrier of the boundary; other ones where cells could not be unfolded else.
    formulation
        That of all cells that are not folded, once there is one; None before.
    notes
        Decisions and warnings, in words.
    reason
        Reason of its end, in words.
    converged
        True where that was a stopping criterion, not a limit.
    lowered
        True once the distortion is low, and the worst cells are raised.
    """

    boundary: Boundary
    formulation: Formulation | None = None
    notes: tuple[str, ...] = ()
    reason: str = "interrupted"
    converged: bool = False
    lowered: bool = False


class Stages:
    """The stages of a run in their order; iterate to run them.

    Attributes
    ----------
    state
        Where the run is; it may be left at any iteration.
    """

    def __init__(self, setting: Setting, boundary: Boundary) -> None:
        self.state = State(boundary)
        self._setting, self._earlier = setting, [setting.normalized.points, setting.first]

    def __iter__(self) -> Iterator[Iteration]:
        kept = self._setting.normalized.points
        yield Iteration("input", kept)
        if self._setting.start is not None:
            kept = self._setting.start
            yield Iteration("start", kept)
        left = most = self._setting.options.max_iterations
        start, coupled = kept, self.state.boundary.admissible.coupled
        for iteration in islice(self._passes(), most):
            left -= 1
            # Steps are rounded where nodes are: here their sum is the same for those that are coupled.
            iteration = replace(iteration, points=coupled.together(iteration.points, start))
            # The way out of a tangle may lead through cells that were valid: what is seen of it is what was before.
            if iteration.points is not kept and self._setting.keeps_valid(iteration.points):
                kept = iteration.points
            yield iteration if iteration.points is kept else Iteration(iteration.phase, kept)
        if left == 0:
            self._ended(f"reached max_iterations = {most}", False)

    @property
    def _raises_worst(self) -> bool:
        return self._setting.options.raises_worst

    def _ended(self, reason: str, converged: bool) -> None:
        self.state = replace(self.state, reason=reason, converged=converged)

    def _passes(self) -> Iterator[Iteration]:
        """Run; once more with the nodes of sheets inside held, where these could not be kept within their bound."""
        setting = self._setting
        points = yield from self._iterations()
        boundary, bound = self.state.boundary, setting.options.hausdorff
        if sheets_distance(points, setting.normalized, boundary, bound) <= bound:
            return
        boundary = boundary.with_sheets_held(setting.normalized, setting.options, setting.schedules)
        why = "faces inside could not be kept within their bound while they slide: their nodes are held"
        self.state = State(boundary, notes=(why,))
        yield from self._iterations()

    def _iterations(self) -> Generator[Iteration, None, Field]:
        setting, boundary, options = self._setting, self.state.boundary, self._setting.options
        schedules = setting.schedules
        normalized = setting.normalized
        formulation = setting.formulation(boundary)
        found = Unfolded(boundary, formulation, setting.first, np.zeros(len(normalized.cells), dtype=bool))
        whole = found
        if boundary.start is not None:
            whole = found = yield from fit(setting, boundary)
        # The quaternionic energy does not see what is folded.
        elif options.energy == "barrier" and setting.is_tangled:
            if isinstance(normalized, NormalizedPiece):
                whole, found = yield from unfold_on_ranks(setting, normalized, boundary)
            else:
                whole = found = yield from unfold(setting, boundary)
        folded = normalized.space.anywhere(bool(found.bad.any()))
        if folded and not normalized.space.is_shared:
            found = hold_folded(setting, found)
            yield Iteration("hold what stays inverted", found.points)
        formulation, points = found.formulation, found.points
        self._earlier = [normalized.points, setting.first, points]
        notes = (*self.state.notes, *found.notes)
        self.state = replace(self.state, boundary=found.boundary, formulation=formulation, notes=notes)
        alone = formulation.barrier is None and not folded and not options.changes_sizes
        alone = alone and not normalized.space.anywhere(bool(are_collapsed(normalized.cells).any()))
        # What an earlier run has won for the worst cells would be lost for a while if the distortion came first again.
        if not (setting.lowered and options.raises_worst):
            # Where nothing but the distortion counts there is nothing that thin cells could outweigh.
            if options.energy == "barrier" and not alone:
                points = yield from _followed(thicken(formulation, points), points)
            points = yield from _followed(self._minimize(formulation, points, found.bad, alone), points)
            self._earlier.append(points)
        self.state = replace(self.state, lowered=True)
        works = normalized.space.anywhere(bool(formulation.free.any()) and len(formulation.cells) > 0)
        if options.raises_worst and works:
            formulation, points = yield from self._raise_worst(formulation, points, found)
        points = yield from self._return_to_surface(formulation, points)
        if options.energy == "barrier":
            unfolded = untangle_interior(formulation, points)
            if unfolded is not points:
                points = unfolded
                yield Iteration("untangle interior", points)
                if options.raises_worst:
                    again = formulation.within(schedules.work.patches)
                    points = yield from _followed(raise_worst_patches(again, points), points)
                points = yield from self._return_to_surface(formulation, points)
        if folded:
            points = improve_folded(whole.formulation, points, found.bad)
            yield Iteration("improve what stays inverted", points)
        if options.energy == "barrier" and (left := int(normalized.space.total(self._setting.flat(points).sum()))):
            what = "a cell has" if left == 1 else f"{left} cells have"
            self._ended(f"{self.state.reason}; {what} no volume, or next to none", False)
        return points

    def _raise_worst(
        self, formulation: Formulation, points: Field, found: Unfolded
    ) -> Generator[Iteration, None, tuple[Formulation, Field]]:
        """Raise the worst cells; returns the formulation, which may have softer curves then, and the points."""
        schedules, options = self._setting.schedules, self._setting.options
        quality, space = corner_scaled_jacobian(points, formulation.cells), formulation.space
        if space.smallest(quality) >= schedules.worst_cells.good:
            if not self.state.converged:
                self._ended(f"no cell is worse than {schedules.worst_cells.good:g}", True)
            return formulation, points
        self._ended("interrupted", False)
        raise_cells = raise_worst
        if space.total(len(quality)) > schedules.worst_cells.many_cells:
            raise_cells = raise_worst_patches
            formulation.release()
        bounded = formulation.within(schedules.work.patches)
        points = yield from _followed(raise_cells(bounded, points, True), points)
        points = yield from self._reopen_worst(formulation, points, found.bad, raise_cells)
        if formulation.space.anywhere(bool(next_to_flat(formulation, points).any())):
            # Others beside what stays so.
            points = yield from _followed(raise_worst_patches(bounded, points), points)
        if options.features == "auto" and options.surface is None:
            soft = yield from soften_curves(formulation.within(schedules.work.patches), points)
            if soft is not None:
                formulation, points = formulation.with_barrier(soft.barrier), soft.points
                self.state = replace(self.state, formulation=formulation, notes=(*self.state.notes, soft.note))
                yield Iteration("soften curves", points)
        if formulation.spoils_a_type(points) and not formulation.spoils_a_type(found.points):
            # What is lost where distortion is lowered on the whole does not always come back: patch by patch little is;
            # where that is too much the types that lost are held.
            bounded = formulation.within(schedules.work.patches)
            points = yield from _followed(raise_worst_patches(bounded, found.points), found.points)
            lost = formulation.of_spoiled_types(points)
            if lost.any() and not lost.all():
                others = formulation.without(lost).within(schedules.work.patches)
                points = yield from _followed(raise_worst(others, found.points), found.points)
        if bounded.work.is_done:
            self._ended("the worst cells get better still, but the work allowed for that is done", False)
        else:
            self._ended("the worst cell stalls", True)
        return formulation, points

    def _reopen_worst(
        self, formulation: Formulation, points: Field, bad: Mask, raise_cells: Raising
    ) -> Generator[Iteration, None, Field]:
        """Open the worst cells where they stall next to flat, then lower and raise all anew, as long as that wins."""
        schedules, space = self._setting.schedules, formulation.space
        for _ in range(schedules.worst_cells.reopenings):
            trial = yield from reopen_worst(formulation.within(schedules.work.again), points)
            if not space.anywhere(trial is not points):
                return points
            # A patch watches the surface around itself only.
            if formulation.barrier is not None and formulation.barrier.reference is None:
                for back in return_to_surface(formulation, trial, keeps_worst=False):
                    trial = back[0]
                    yield Iteration("reopen worst cells", points)
            for iteration in self._minimize(formulation, trial, bad, False):
                trial = iteration.points
                yield Iteration("reopen worst cells", points)
            self._ended("interrupted", False)  # what is left here is not at its end
            for iteration in raise_cells(formulation.within(schedules.work.patches), trial, True):
                trial = iteration.points
                yield Iteration("reopen worst cells", points)
            if space.smallest(formulation.quality(trial)) <= space.smallest(formulation.quality(points)):
                return points
            points = trial
            yield Iteration("reopen worst cells", points)
        return points

    def _minimize(self, formulation: Formulation, points: Field, bad: Mask, alone: bool) -> Iterator[Iteration]:
        distortion = self._setting.distortion
        if bad.any():
            distortion = distortion.of_cells(np.flatnonzero(~bad))
        referenced = self._setting.normalized.referenced
        problem = distortion, formulation, self._setting.options, points, referenced
        minimization: Minimization | CompatibleSteps = Minimization(*problem, alone)
        if self._setting.options.constraint == "compatible" and formulation.barrier is not None:
            boundary = self.state.boundary
            minimization = CompatibleSteps(*problem, formulation.barrier, boundary.quads, boundary.patches)
        yield from minimization
        self._ended(minimization.reason, minimization.converged)

    def _return_to_surface(self, formulation: Formulation, points: Field) -> Generator[Iteration, None, Field]:
        """Bring back what is out of its bound; with another surface to slide on that is told, not changed."""
        barrier = formulation.barrier
        if barrier is None or barrier.reference is not None:
            return points
        for seen in return_to_surface(formulation, points, self._raises_worst):
            points, formulation = seen
            yield Iteration("return to the surface", points)
        if not barrier.exceeded(points):
            return points
        # The worst cell stands in the way: all goes back a little, or it is let go, whatever makes it better.
        best, space = self._towards_earlier(barrier, points), formulation.space
        lost = space.smallest(formulation.quality(points)) - space.smallest(formulation.quality(best))
        if self._raises_worst and lost > self._setting.schedules.worst_cells.least_gain:
            for trial in self._let_go(formulation, points):
                yield Iteration("return to the surface", best)
                one, other = (space.smallest(formulation.quality(x)) for x in (trial, best))
                best = trial if one > other and not barrier.exceeded(trial) else best
        yield Iteration("return to the surface", best)
        return best

    def _let_go(self, formulation: Formulation, points: Field) -> Iterator[Field]:
        """Points on the way back to the surface without regard to the worst cells, which are raised again then."""
        watching = formulation
        for seen in return_to_surface(formulation, points, keeps_worst=False):
            points, watching = seen
            yield points
        # More samples are watched now than when they were raised first.
        for iteration in raise_worst_patches(watching.within(self._setting.schedules.work.patches), points):
            points = iteration.points
            yield points
        for points, _ in return_to_surface(watching, points, keeps_worst=True):
            yield points

    def _towards_earlier(self, barrier: DistanceBarrier, points: Field) -> Field:
        """Points on the way back to the last ones within the bound: the first that are so, without spoiling a cell."""
        back = next((before for before in reversed(self._earlier) if within_bound(barrier, before)), points)
        normalized = self._setting.normalized
        return towards(barrier, points, back, normalized.cells, self._setting.schedules.returning, normalized.space)

    def brought_back(self, points: Field) -> Field:
        """The points with the boundary within its bound, as nearly as can be, where the run was left before it was."""
        formulation, barrier = self.state.formulation, self.state.boundary.barrier
        if formulation is None:
            if barrier is not None and barrier.reference is None and barrier.exceeded(points):
                return self._towards_earlier(barrier, points)
            return points
        if formulation.barrier is not None and not self.state.converged:
            for iteration in self._return_to_surface(formulation, points):
                points = iteration.points
        return points


def _followed(stage: Iterator[Iteration], points: Field) -> Generator[Iteration, None, Field]:
    """The iterations of a stage; returns the points of the last one, those given if there is none."""
    for iteration in stage:
        points = iteration.points
        yield iteration
    return points
