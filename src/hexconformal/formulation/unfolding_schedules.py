"""The schedules of unfolding: every tuned number of it, with its unit and its reason.

Lengths are in mean edges of the mesh unless something else is said; shares and ratios have no unit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..common import Schedule, tuned

__all__ = ["FittingSchedule", "FoldedSchedule", "InteriorSchedule", "ThinSchedule", "UnfoldingSchedule"]
__all__ += ["UntanglingSchedule"]


@dataclass(frozen=True)
class UntanglingSchedule(Schedule):
    """Unfolding corners, equation (9): of the whole mesh, then patch by patch.

    Attributes
    ----------
    flat
        Fullness of a corner up to which it is as good as flat and opened like one that is folded: the barrier holds it
        where it is, and what is around it.
    many_folded
        Share of folded cells from which on the whole mesh is unfolded first: patches are faster where there are few.
    hardly_folded
        How far below zero the fullness may be where the whole mesh is unfolded from where it is.
    whole_steps, patch_steps
        Newton steps on the whole mesh, and on a patch: what the former leave is for the latter.
    rounds
        Rounds of patches, each a ring of cells larger than before: larger patches reach the same only past more ways to
        go wrong, so the folded cells alone come first.
    first_eps
        Starting eps of the attempts on a patch, in smallest determinants: another start is another way out.
    starts
        How many of the places an attempt begins at are tried: where the patch is, at its harmonic positions, where it
        was at first, at the harmonic positions of that.
    attraction
        Share of the attraction of the surface that is left for patches.
    enough
        Share of the cells of a patch that may be left for the next round: other starts are for patches that resist.
    stuck
        eps over the smallest determinant at which a fold will not open any more.
    least_sigma
        Progress that equation (9) counts with at least: perfect cells have no energy to lose, and mirrored they are as
        perfect.
    shares_back, tries_back
        Of the way to the input, for nodes of cells that have become worse and of a boundary that is too far away, and
        how often they go back by it: in the first half of the tries these alone, then rings around them, all the way.
    """

    flat: float = tuned(1e-4, 0.0, 1.0)
    many_folded: float = tuned(0.05, 0.0, 1.0)
    hardly_folded: float = tuned(0.05, 0.0, 1.0)
    whole_steps: int = tuned(15)
    patch_steps: int = tuned(120)
    rounds: int = tuned(6)
    first_eps: tuple[float, ...] = tuned((1.0, 0.2, 5.0))
    starts: int = tuned(4, 1, 4)
    attraction: float = tuned(0.0, 0.0, 1.0)
    enough: float = tuned(0.5, 0.0, 1.0)
    stuck: float = tuned(0.02, 0.0, 1.0)
    least_sigma: float = tuned(0.1, 0.0, 1.0)
    shares_back: tuple[float, ...] = tuned((0.25, 0.5, 1.0), 0.0, 1.0)
    tries_back: int = tuned(24)

    def are_flat(self, fullness: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(m,) cells of which the fullness says that they are folded or flat."""
        return np.asarray(fullness <= self.flat)


@dataclass(frozen=True)
class ThinSchedule(Schedule):
    """Thickening cells that have next to no volume.

    Attributes
    ----------
    thin
        Fullness below which a corner is thin.
    rings
        Of cells around thin ones that move with them.
    eps
        Of the barrier chi_eps meanwhile, in determinants of thin corners, the median of them.
    steps, patience
        Newton steps at most, and without success.
    steep, steep_eps, steep_patience
        The same where nothing but the distortion counts, of the whole mesh at once by L-BFGS: fullness below which that
        is done, eps in determinants of all cells, the median of them, and steps without success.
    """

    thin: float = tuned(2e-2, 0.0, 1.0)
    rings: int = tuned(3)
    eps: float = tuned(1.0)
    steps: int = tuned(40)
    patience: int = tuned(6)
    steep: float = tuned(0.1, 0.0, 1.0)
    steep_eps: float = tuned(0.1)
    steep_patience: int = tuned(2)


@dataclass(frozen=True)
class InteriorSchedule(Schedule):
    """Unfolding cells that are folded inside though no corner is.

    Attributes
    ----------
    widths
        Rings of cells around the invalid ones that move with them, tried in this order.
    rounds, steps
        Values of eps, and steps of L-BFGS at each.
    first_eps
        First eps in smallest determinants.
    shrink
        Ratio of one eps to the one before.
    least_eps
        Where cells are hardly folded.
    slow, alike, patience
        Relative decrease of the energy, and relative change of the worst determinant inside from one eps to the next,
        so many of which in a row that are smaller are the end.
    """

    widths: tuple[int, ...] = tuned((0, 1, 2))
    rounds: int = tuned(12)
    steps: int = tuned(100)
    slow: float = tuned(1e-5, 0.0, 1.0)
    alike: float = tuned(1e-2, 0.0, 1.0)
    patience: int = tuned(3)
    first_eps: float = tuned(0.5)
    shrink: float = tuned(0.5, 0.0, 1.0)
    least_eps: float = tuned(1e-3)


@dataclass(frozen=True)
class FoldedSchedule(Schedule):
    """Raising the worst of what stays folded.

    Attributes
    ----------
    widths
        Rings of cells around the folded ones that move with them.
    sharpness
        Of the soft minimum, one after the other: the sharp one alone sees one corner at a time.
    steps
        Of L-BFGS at each.
    floor, floor_weight
        Scaled Jacobian that the others keep where they have it, or half of what they have, and the weight of that.
    loss_weight
        Of what they lose above it.
    """

    widths: tuple[int, ...] = tuned((0, 1))
    sharpness: tuple[float, ...] = tuned((8.0, 16.0, 32.0, 64.0))
    steps: int = tuned(100)
    floor: float = tuned(0.2, 0.0, 1.0)
    floor_weight: float = tuned(100.0)
    loss_weight: float = tuned(0.05)


@dataclass(frozen=True)
class UnfoldingSchedule(Schedule):
    """What is tried where cells resist.

    Attributes
    ----------
    patience
        Rounds of patches without success before something else is tried.
    wider_bounds
        Diagonals that the boundary may move to unfold what resists, one after the other.
    other_features
        Of the ways to take features, hard and soft, how many are tried after that.
    return_steepness
        Steepness of the barrier on the way back from there: a steep one is met too early.
    whole, gathered
        Cells of a mesh that is shared out up to which one rank gets all of them, and cells at the boundary and around
        folded ones that it gets of a larger mesh: about 2 kB each.
    """

    patience: int = tuned(1)
    wider_bounds: tuple[float, ...] = tuned((0.05, 0.1, 0.2), 0.0, 1.0)
    other_features: int = tuned(2, 0, 2)
    return_steepness: float = tuned(12.5)
    whole: int = tuned(200_000)
    gathered: int = tuned(1_000_000)


@dataclass(frozen=True)
class FittingSchedule(Schedule):
    """Unfolding a mesh whose skin has been put on another surface.

    Attributes
    ----------
    few_folded
        Share of folded cells up to which patches are unfolded from where they are: there cells have the sizes that they
        should have, which thin layers at the mean of their neighbours have not.
    patience
        Rounds of patches without success before another start is tried.
    """

    few_folded: float = tuned(0.15, 0.0, 1.0)
    patience: int = tuned(3)
