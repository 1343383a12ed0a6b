"""The tuned numbers of the run for quadratic cells, and of making quadratic hexahedra of linear ones."""

from __future__ import annotations

from dataclasses import dataclass

from ...common import Schedule, tuned

__all__ = ["CurvingSchedule", "QuadraticSchedule"]


@dataclass(frozen=True)
class QuadraticSchedule(Schedule):
    """Numbers of the run for quadratic cells.

    Attributes
    ----------
    parts, nearness
        Into which edges are cut where the boundary slides, at least and at most: 16 parts follow a face sixteen
        times as closely as one does; and to how many bounds they have to, where faces bend so far that it takes more.
    evenness
        Weight of the evenness of det J in equation (10a): at 1 it costs about what the distortion does.
    many_folded
        Share of folded cells from which on the whole mesh is unfolded first: where it slides it may end with better
        worst cells than what unfolds some places alone.
    straight_steps
        Newton steps on all cells that unfolding straight ones may take, as :class:`WorkSchedule` counts them.
    rounds, patience
        Values of eps at most, and how many without a point less that is folded are the end of it: most meshes take one
        or two from one of the starts, and what takes more than ten does so from a bad one.
    steps
        Iterations with each: more follow a function that is soon another.
    first_eps
        The first eps over the largest folded determinant.
    least_eps
        Least first eps, in cubes of the mean edge: what is flat has none of its own.
    progress
        Least relative decrease sigma in equation (9).
    tries_back
        How often nodes of cells that were valid before go back, as :class:`UntanglingSchedule` has it.
    settled
        Relative decrease of the energy below which an iteration counts as the last: a digit above rounding is left.
    stall
        The same where the worst cells are raised afterwards.
    distortion_share, raised_evenness, stiffness
        Weights beside the angles where the worst of these are raised, and the stiffness times the worst. With the
        evenness as before det J varies thirtyfold within cells of a sphere, with this eightfold, at the same angles.
    negligible
        Largest e(u) of corners so good that none need be raised: edges are within a degree of right angles.
    renewal
        Iterations after which it is looked anew for closest points, and L-BFGS begins anew.
    stiff_steps, stiff_rounds
        Iterations with a stiffness, and how many of these there are at most.
    least_gain
        Relative decrease of the worst angle two of which in a row end them.
    """

    parts: tuple[int, int] = tuned((4, 8))
    nearness: float = tuned(0.5, 0.0, 1.0)
    evenness: float = tuned(1.0)
    many_folded: float = tuned(0.02, 0.0, 1.0)
    straight_steps: float = tuned(20.0)
    rounds: int = tuned(20)
    patience: int = tuned(6)
    steps: int = tuned(40)
    first_eps: float = tuned(0.2)
    least_eps: float = tuned(1e-4)
    progress: float = tuned(0.1, 0.0, 1.0)
    tries_back: int = tuned(24)
    settled: float = tuned(1e-9, 0.0, 1.0)
    stall: float = tuned(1e-4, 0.0, 1.0)
    distortion_share: float = tuned(0.5)
    raised_evenness: float = tuned(3.0)
    stiffness: float = tuned(0.95, 0.0, 1.0)
    negligible: float = tuned(1e-3)
    renewal: int = tuned(25)
    stiff_steps: int = tuned(15)
    stiff_rounds: int = tuned(20)
    least_gain: float = tuned(0.01, 0.0, 1.0)


@dataclass(frozen=True)
class CurvingSchedule(Schedule):
    """Putting the middles of linear hexahedra on a surface.

    Attributes
    ----------
    looks
        Cosine to one of the 26 directions of a cube's faces, edges and corners from which on a face looks there.
        Normals are up to 28 degrees away from the nearest one: 84 leave room for a surface that bends by 56 more, as a
        quarter of a circle over one edge does by 45, and none for the back of a wall.
    projections, still
        Onto the sides of an edge in turn, at most, and the share of its length by which none that still moves does so:
        two planes at 30 degrees are met to a thousandth in twenty.
    reach
        Lengths of an edge that its middle may go: half of one is what the half of a circle over it takes.
    shares
        Of the way that nodes go in turn where cells would be folded, though other edges follow, down to none.
    kept
        Of the smallest det J of a cell relative to its size: with less it is nearly folded, and solvers do not like it.
    told
        Share of what straight edges miss that corners may be away from the surface without a note; so may they by the
        rounding of files in single precision.
    parts
        Of an edge, between whose nodes distances are measured: a power of two.
    """

    looks: float = tuned(0.1, 0.0, 1.0)
    projections: int = tuned(20)
    still: float = tuned(1e-9)
    reach: float = tuned(0.5)
    shares: tuple[float, ...] = tuned((1.0, 0.5, 0.25, 0.0), 0.0, 1.0)
    kept: float = tuned(0.1, 0.0, 1.0)
    told: float = tuned(0.1, 0.0, 1.0)
    parts: int = tuned(4, 2)
