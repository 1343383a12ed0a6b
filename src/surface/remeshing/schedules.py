"""The schedules of a remeshing: every tuned number of it, with its unit and its reason.

Lengths are in mean edges of the input unless something else is said; shares and ratios have no unit. A row of
`benchmarks/ablation_surfaces.md` is named after the schedule and the number.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

from hexconformal.common import Schedule, tuned

__all__ = [
    "AcceptanceSchedule",
    "ApproachSchedule",
    "ContinuationSchedule",
    "ProblemSchedule",
    "PullBackSchedule",
    "RestartSchedule",
]
__all__ += ["Schedules", "StepSchedule"]


@dataclass(frozen=True)
class ProblemSchedule(Schedule):
    """What is lowered, and what is kept.

    Attributes
    ----------
    mean_m, mean_c, worst_c
        m and c of equation (16) with emphasis on the mean; c on the worst, where m is infinite. A small m gives up
        angles of cells that cannot be good for those that can, c keeps the worst from paying for it.
    bound_margin
        Of the bound, for distances that are measured at nodes and centres while the run goes on.
    area_tolerance
        Largest relative change of the area: a rough surface has area to lose, and loses its detail with it.
    area_reached
        Of that, from which on forces that would change the area further are taken out.
    max_growth
        Factor by which the energy of a cell may grow in one step, besides the mean: more is a cell that is spoiled.
    max_force
        Of the forces that act on volume and area, in medians: a few bad cells must not move all others through them.
    max_curvature
        Per length; larger ones are noise, and clipped where the area is restored.
    projected_tolerance, free_tolerance
        Of the linear systems, with and without projection: a projected step is corrected anyway.
    """

    mean_m: float = tuned(0.02)
    mean_c: float = tuned(0.1)
    worst_c: float = tuned(0.5)
    bound_margin: float = tuned(0.9, 0.0, 1.0)
    area_tolerance: float = tuned(0.008, 0.0, 1.0)
    area_reached: float = tuned(0.98, 0.0, 1.0)
    max_growth: float = tuned(2.0, 1.0)
    max_force: float = tuned(10.0)
    max_curvature: float = tuned(2.0)
    projected_tolerance: float = tuned(0.03, 0.0, 1.0)
    free_tolerance: float = tuned(1e-8, 0.0, 1.0)


@dataclass(frozen=True)
class StepSchedule(Schedule):
    """One step: how it is shortened, and how nodes are damped that stand in the way.

    Attributes
    ----------
    uniform_tries
        Steps tried with all nodes alike, each half as long as the one before, before nodes are damped.
    max_tries
        Of both kinds.
    max_rises
        In one search, in which cells whose energy rises are damped before the step is shortened for all.
    min_damping, max_damping
        Of a node, in the stiffness of its frames; one that would need more is held.
    damping_growth, damping_decay
        Factors within a search, and from one step to the next.
    max_damped
        Share of the nodes not held: where more would have to be damped the step is shortened for all.
    area_rounding
        Relative area beyond its range that a step may reach.
    """

    uniform_tries: int = tuned(3)
    max_tries: int = tuned(24, 1)
    max_rises: int = tuned(3)
    min_damping: float = tuned(0.125)
    max_damping: float = tuned(64.0)
    damping_growth: float = tuned(8.0, 1.0)
    damping_decay: float = tuned(0.25, 0.0, 1.0)
    max_damped: float = tuned(0.5, 0.0, 1.0)
    area_rounding: float = tuned(1e-4)


@dataclass(frozen=True)
class ContinuationSchedule(Schedule):
    """The way to the final energy, and when it ends.

    Attributes
    ----------
    first_cap, final_cap
        Density from which on a cell counts less: at first bad cells must not dominate, at last they count.
    first_factor
        Of m: with the final one the energy hardly sees how to unfold a cell.
    slow_decrease
        Relative decrease of the energy in a step below which the continuation advances.
    late_decrease
        The same from which on a run is late: new normals must not take back what it gains.
    normals_rise
        Of the last decrease: by so much new normals may raise the energy late in a run.
    stalled_steps
        Steps in a row that gain less than the tolerance, which end the run.
    stalled_energy
        Late steps in a row that hardly lower the energy against the cells' own normals, which end it, too.
    """

    first_cap: float = tuned(10.0)
    final_cap: float = tuned(100.0)
    first_factor: float = tuned(64.0, 1.0)
    slow_decrease: float = tuned(0.05, 0.0, 1.0)
    late_decrease: float = tuned(0.01, 0.0, 1.0)
    normals_rise: float = tuned(0.5)
    stalled_steps: int = tuned(5, 1)
    stalled_energy: int = tuned(10, 1)


@dataclass(frozen=True)
class RestartSchedule(Schedule):
    """Descents that begin again where one ends with spoiled cells.

    Attributes
    ----------
    first_patience, patience
        Steps with cells turned over, once that is forbidden, after which the first descent and the further ones end:
        a few turn back by themselves.
    restarts
        Descents after the first; the last one has all the patience there is.
    """

    first_patience: int = tuned(10, 1)
    patience: int = tuned(1, 1)
    restarts: int = tuned(9)

    @property
    def patiences(self) -> tuple[float, ...]:
        """The patience of every descent."""
        return (self.first_patience, *[self.patience] * (self.restarts - 1), inf)[-self.restarts - 1 :]


@dataclass(frozen=True)
class PullBackSchedule(Schedule):
    """The way back into the bound.

    Attributes
    ----------
    shrinkage
        Factor of the displacement of a node each time.
    rounds
        Times at most: 60 leave a twentieth.
    rings
        Rings of nodes that go back with those that are too far away, tried one after the other.
    shares
        Of the displacements of all nodes, where no ring has been enough.
    """

    shrinkage: float = tuned(0.95, 0.0, 1.0)
    rounds: int = tuned(60)
    rings: tuple[int, ...] = tuned((0, 1, 3))
    shares: tuple[float, ...] = tuned((0.95, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2, 0.1), 0.0, 1.0)


@dataclass(frozen=True)
class AcceptanceSchedule(Schedule):
    """What is no worse than the input, and what is enough better to move nodes for it.

    Attributes
    ----------
    angle_tolerance
        Relative decrease of the smallest angle that is tolerated: corners of a plane grid have the best one there is,
        and would hold all others.
    small_gain, small_degrees
        Relative gain of the smallest angle, and degrees of the mean one, below which nothing was gained.
    large_gain
        Relative decrease of the energy, gain of the smallest angle, or of the deficit of the mean one, that is enough.
    far_share, far_gain
        Beyond this share of the allowed distance, the share of a deficit that must be gained.
    energy_gain
        Relative decrease that is enough where the energy decides.
    """

    angle_tolerance: float = tuned(1e-3, 0.0, 1.0)
    small_gain: float = tuned(0.02)
    small_degrees: float = tuned(0.1)
    large_gain: float = tuned(0.1, 0.0, 1.0)
    far_share: float = tuned(0.5, 0.0, 1.0)
    far_gain: float = tuned(0.15, 0.0, 1.0)
    energy_gain: float = tuned(0.02, 0.0, 1.0)


@dataclass(frozen=True)
class ApproachSchedule(Schedule):
    """How the surface is brought nearer to the input at the end, and what that may cost.

    Attributes
    ----------
    stiffness, knee
        k of equation (20a) at first, and s, from where on the square counts more: no place is given up for many.
    gain, largest_change
        k changes by exp(gain) where all that may be spent of the mean angle is left, and by this factor at most.
    bound_share
        Of the bound; a surface that is nearer may come back as far as that.
    emphasis, max_emphasis
        Factor of the weight of a cell that would be too thin, each time, and the largest.
    max_steps
        Newton steps.
    near_enough
        Root mean square of the distance, in mean edges, below which nothing is left to see.
    slow, patience
        Relative decrease of that in a step, and how many steps in a row may bring less while some of the price is left.
    least_decrease, spent
        Relative decrease in a step below which it is the last one, if no more than this share of the price is left.
    degrees, share
        The price: by so much the smallest and the mean angle may fall, and by this share of what they gained.
    deficit_share
        Of what the mean angle misses: it may not fall by more, or the next run would take it back.
    least_gain
        Relative decrease of the distance, root mean square, for which it is paid.
    """

    stiffness: float = tuned(15.0)
    knee: float = tuned(0.17)
    gain: float = tuned(0.5)
    largest_change: float = tuned(1.5, 1.0)
    bound_share: float = tuned(0.25, 0.0, 1.0)
    emphasis: float = tuned(2.0, 1.0)
    max_emphasis: float = tuned(64.0, 1.0)
    max_steps: int = tuned(20)
    near_enough: float = tuned(0.01, 0.0, 1.0)
    slow: float = tuned(0.02, 0.0, 1.0)
    patience: int = tuned(3)
    least_decrease: float = tuned(0.002, 0.0, 1.0)
    spent: float = tuned(0.05, 0.0, 1.0)
    degrees: float = tuned(0.49)
    share: float = tuned(0.1, 0.0, 1.0)
    deficit_share: float = tuned(0.08, 0.0, 1.0)
    least_gain: float = tuned(0.2, 0.0, 1.0)


@dataclass(frozen=True)
class Schedules:
    """The schedules of all stages of a remeshing.

    Examples
    --------
    >>> from dataclasses import replace
    >>> replace(Schedules(), step=StepSchedule(uniform_tries=0)).step.uniform_tries
    0
    """

    problem: ProblemSchedule = field(default_factory=ProblemSchedule)
    step: StepSchedule = field(default_factory=StepSchedule)
    continuation: ContinuationSchedule = field(default_factory=ContinuationSchedule)
    restart: RestartSchedule = field(default_factory=RestartSchedule)
    pull_back: PullBackSchedule = field(default_factory=PullBackSchedule)
    approach: ApproachSchedule = field(default_factory=ApproachSchedule)
    acceptance: AcceptanceSchedule = field(default_factory=AcceptanceSchedule)
