"""The schedules of the stages of a run: every tuned number of them, with its unit and its reason.

Lengths are in mean edges of the mesh unless something else is said; shares and ratios have no unit. A row of
`benchmarks/ablation.md` is named after the schedule and the number.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ..common import Schedule, tuned
from ..geometry import BarrierSchedule, FeatureSchedule, MatchingSchedule
from ..solver import MultigridSchedule, NewtonSchedule, SearchSchedule
from .unfolding_schedules import (
    FittingSchedule,
    FoldedSchedule,
    InteriorSchedule,
    ThinSchedule,
    UnfoldingSchedule,
    UntanglingSchedule,
)

__all__ = ["CompatibleSchedule", "MinimizationSchedule", "ReturnSchedule", "Schedules", "VolumeSchedule"]
__all__ += ["WorkSchedule", "WorstCellsSchedule"]


@dataclass(frozen=True)
class MinimizationSchedule(Schedule):
    """Lowering the distortion.

    Attributes
    ----------
    handover
        Iterations of L-BFGS after which Newton takes over.
    newton_gradient
        Relative gradient below which Newton is the better choice.
    rounding
        Gradient per node that is rounding.
    stall
        Relative decrease of the energy two of which in a row are a stall, where the worst cells are raised afterwards.
    decrease
        The same beside a barrier or volumes, where the gradient may never vanish.
    few_steps, rapid
        Steps of that before the angles take over: more win nothing that these do not, but where a step lowers the
        energy by more than this share.
    least_volume
        Smallest volume, relative to the cube of the edges, that the stiffness of a cell takes as it is.
    proportion_weight, slender
        Weight of the proportions of edges at corners, beside the distortion or the angles, and the ratio up to which
        they cost nothing, whatever it was at first.
    slenderest, least_slender
        That ratio of folded cells where most are folded, and of the longest to the shortest edge with what a target
        has of its own; and the least beside a target, however stretched that is.
    volume_weight
        Weight of the volumes of cells beside the angles or the distortion, where the worst cells are raised.
    sizes_weight
        The same where they are not.
    target_sizes_factor
        Factor of these where sizes were asked for.
    """

    handover: int = tuned(60)
    newton_gradient: float = tuned(1e-6, 0.0, 1.0)
    rounding: float = tuned(1e-13)
    stall: float = tuned(3e-3, 0.0, 1.0)
    decrease: float = tuned(1e-6, 0.0, 1.0)
    few_steps: int = tuned(2)
    rapid: float = tuned(0.1, 0.0, 1.0)
    least_volume: float = tuned(0.05, 0.0, 1.0)
    proportion_weight: float = tuned(20.0)
    slender: float = tuned(6.0, 1.0)
    slenderest: float = tuned(12.0, 1.0)
    least_slender: float = tuned(2.0, 1.0)
    volume_weight: float = tuned(6.0)
    sizes_weight: float = tuned(4.0)
    target_sizes_factor: float = tuned(25.0)


@dataclass(frozen=True)
class WorstCellsSchedule(Schedule):
    """Raising the worst cells, equation (12): of the whole mesh, then in patches around them.

    Attributes
    ----------
    distortion_share
        Of the whole distortion beside the angles: less makes thin cells for little better angles.
    stiffness
        Times the worst density: no corner gets worse than that one, and it is pushed hardest.
    angle_steps, stiff_steps
        Newton steps on the whole mesh: more of them cost more and win nothing that the patches do not.
    angle_decrease
        Relative decrease two of which in a row end the former.
    patch_steps, patch_passes, patch_rounds
        Newton steps on a patch, passes with the stiffness anew, and patches at most.
    margin, spared
        Cells this close to the worst scaled Jacobian are raised with it, but for those that are better by this than the
        connections allow the worst to get.
    rings
        Of cells around them that move.
    least_gain
        Of the worst scaled Jacobian, or a tenth of it: a round with less is a stall.
    alike
        Cells this close to a worst one that stalls are set aside with it.
    poor
        Scaled Jacobian below which the worst of the others are raised then, and curves may be let go.
    good
        Worst scaled Jacobian at which nothing is left to do.
    worth
        By which the worst scaled Jacobian at curves has to rise for these to be let go as far as the surface; what
        leaves the surface further for more than this, and more than poor, is not sought.
    reopened, opened, patience, reopenings
        Scaled Jacobian below which worst cells that stall are opened as if folded, the fullness they are opened to,
        rounds of that without success, and how often all is lowered and raised anew after it.
    many_cells
        Cells up to which those of the whole mesh are raised first; beyond, patches alone.
    """

    distortion_share: float = tuned(0.2)
    stiffness: float = tuned(0.95, 0.0, 1.0)
    angle_steps: int = tuned(10)
    stiff_steps: int = tuned(3)
    angle_decrease: float = tuned(3e-3, 0.0, 1.0)
    patch_steps: int = tuned(4)
    patch_passes: int = tuned(3)
    patch_rounds: int = tuned(40)
    margin: float = tuned(0.1, 0.0, 1.0)
    spared: float = tuned(0.005, 0.0, 1.0)
    rings: int = tuned(3)
    least_gain: float = tuned(1e-3, 0.0, 1.0)
    alike: float = tuned(0.02, 0.0, 1.0)
    poor: float = tuned(0.6, 0.0, 1.0)
    good: float = tuned(0.98, 0.0, 1.0)
    worth: float = tuned(0.05, 0.0, 1.0)
    reopened: float = tuned(0.2, 0.0, 1.0)
    opened: float = tuned(0.1, 0.0, 1.0)
    patience: int = tuned(2)
    reopenings: int = tuned(2)
    many_cells: int = tuned(200_000)


@dataclass(frozen=True)
class ReturnSchedule(Schedule):
    """Bringing the boundary back into its bound.

    Attributes
    ----------
    rounds
        With other samples or another steepness, at most.
    steps
        Of Newton's method in each.
    slow, patience
        Relative decrease of the distance in a step, and how many of them in a row may bring less.
    watches, keeping
        Rounds that take in samples, and the first of these, which let no cell get worse than the worst is.
    steeper
        Factor of the steepness where samples stay outside.
    untightened, tighter
        Rounds that take in samples after which the bound is made smaller for them, and by which factor in each: what
        lies between samples is a little farther away than they are.
    parts_back, rings_back, tries_back
        Shares of the way back to earlier points within the bound, and rings of cells around what is out of it that go
        so far, in turn, and how often those are taken in that are out of it then.
    shares_back
        The same of the whole mesh, where all that has not been enough.
    """

    rounds: int = tuned(24)
    steps: int = tuned(8)
    slow: float = tuned(0.01, 0.0, 1.0)
    patience: int = tuned(2)
    watches: int = tuned(8)
    keeping: int = tuned(4)
    steeper: float = tuned(4.0, 1.0)
    untightened: int = tuned(1)
    tighter: float = tuned(0.98, 0.0, 1.0)
    parts_back: tuple[float, ...] = tuned((0.05, 0.1, 0.3, 1.0), 0.0, 1.0)
    rings_back: tuple[int, ...] = tuned((2, 4, 8, 16))
    tries_back: int = tuned(4)
    shares_back: tuple[float, ...] = tuned((0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9), 0.0, 1.0)


@dataclass(frozen=True)
class WorkSchedule(Schedule):
    """Bounds of the work of each phase, in Newton steps on the whole mesh: what resists longer does so for good.

    Attributes
    ----------
    unfolding, again
        Of unfolding, and of unfolding with more room or other features, or of cells that stall next to flat.
    patches
        Of raising the worst cells patch by patch.
    returning
        Of bringing the boundary back.
    folded, interior
        Of raising what stays folded, and of unfolding insides.
    least_cells
        Cells that a small mesh counts as.
    step_cells
        Cells that could be worked on in the time that a step takes besides.
    """

    unfolding: float = tuned(120.0)
    again: float = tuned(20.0)
    patches: float = tuned(80.0)
    returning: float = tuned(30.0)
    folded: float = tuned(100.0)
    interior: float = tuned(600.0)
    least_cells: int = tuned(12000)
    step_cells: int = tuned(300)


@dataclass(frozen=True)
class VolumeSchedule(Schedule):
    """Giving the volume back.

    Attributes
    ----------
    drift
        Relative change of the volume from which on it is made up for without being asked.
    exact
        Relative difference of volumes that counts as none.
    steps, halvings
        Steps, and how often each is halved.
    stiffness
        Times the worst density: no cell gets worse than that one is.
    tolerance, iterations, shift
        Of the solves for the way that costs least energy.
    watches
        Times that the bound is watched closer, where it is exceeded.
    regions
        Regions up to which each one's volume is kept: every step takes a solve, and a field in memory, for each.
    stall
        Ratio of the largest difference of several volumes to the one before from which on there is no progress.
    """

    drift: float = tuned(0.003)
    exact: float = tuned(1e-14)
    steps: int = tuned(40)
    halvings: int = tuned(10)
    stiffness: float = tuned(0.95, 0.0, 1.0)
    tolerance: float = tuned(1e-2)
    iterations: int = tuned(50)
    shift: float = tuned(1e-5)
    watches: int = tuned(4)
    regions: int = tuned(50)
    stall: float = tuned(0.99, 0.0, 1.0)


@dataclass(frozen=True)
class CompatibleSchedule(Schedule):
    """Steps under the compatible constraint, equation (14b).

    Attributes
    ----------
    steps
        At most.
    stall
        Relative decrease of the distortion in a step below which it is the last.
    nearly
        Bounds from which on a step that lowers the distortion no more may be held back by the bound.
    """

    steps: int = tuned(100)
    stall: float = tuned(1e-3, 0.0, 1.0)
    nearly: float = tuned(0.9, 0.0, 1.0)


@dataclass(frozen=True)
class Schedules:
    """The schedules of all stages of a run.

    Examples
    --------
    >>> from dataclasses import replace
    >>> replace(Schedules(), worst_cells=WorstCellsSchedule(rings=2)).worst_cells.rings
    2
    """

    features: FeatureSchedule = field(default_factory=FeatureSchedule)
    matching: MatchingSchedule = field(default_factory=MatchingSchedule)
    barrier: BarrierSchedule = field(default_factory=BarrierSchedule)
    newton: NewtonSchedule = field(default_factory=NewtonSchedule)
    search: SearchSchedule = field(default_factory=SearchSchedule)
    multigrid: MultigridSchedule = field(default_factory=MultigridSchedule)
    untangling: UntanglingSchedule = field(default_factory=UntanglingSchedule)
    thin: ThinSchedule = field(default_factory=ThinSchedule)
    interior: InteriorSchedule = field(default_factory=InteriorSchedule)
    folded: FoldedSchedule = field(default_factory=FoldedSchedule)
    unfolding: UnfoldingSchedule = field(default_factory=UnfoldingSchedule)
    fitting: FittingSchedule = field(default_factory=FittingSchedule)
    minimization: MinimizationSchedule = field(default_factory=MinimizationSchedule)
    worst_cells: WorstCellsSchedule = field(default_factory=WorstCellsSchedule)
    returning: ReturnSchedule = field(default_factory=ReturnSchedule)
    volume: VolumeSchedule = field(default_factory=VolumeSchedule)
    compatible: CompatibleSchedule = field(default_factory=CompatibleSchedule)
    work: WorkSchedule = field(default_factory=WorkSchedule)
