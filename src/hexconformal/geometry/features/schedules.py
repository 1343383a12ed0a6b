"""The numbers by which features are found."""

from __future__ import annotations

from dataclasses import dataclass

from ...common import Schedule, tuned

__all__ = ["CreaseSchedule", "FeatureSchedule"]


@dataclass(frozen=True)
class FeatureSchedule(Schedule):
    """Feature curves of a boundary; angles in degrees.

    Attributes
    ----------
    filterings
        Times that normals are averaged.
    noise_factor, widest
        Neighbours count up to this multiple of the noise, at most so many degrees.
    sharp, contrast
        Angle from which on no edge is rounded, else how much sharper than those beside: a coarse cylinder has
        no creases.
    continued
        Share of the angle down to which a crease goes on, once found.
    shortest, shortest_beside
        Edges of a curve with a free end, alone, and beside others that are kept.
    strong
        Share of the edges of a curve that have the whole angle.
    zigzag
        Chains that change their sense of turning more than this are stair steps or noise.
    turn
        That a curve makes at a corner.
    stepped
        Share of the sharp edges beside steps of one cell from which on all are stair steps.
    open
        Share of the curves that end freely from which on all are noise.
    rounded
        Curves may be rounded off if the surface may move so far, in edges and in diagonals.
    opening
        Between the sides of a slit, up to which its end is a crack front.
    """

    filterings: int = tuned(3)
    noise_factor: float = tuned(4.0)
    widest: float = tuned(60.0, 0.0, 180.0)
    sharp: float = tuned(55.0, 0.0, 180.0)
    contrast: float = tuned(1.5)
    continued: float = tuned(0.6, 0.0, 1.0)
    shortest: int = tuned(5)
    shortest_beside: int = tuned(15)
    strong: float = tuned(0.5, 0.0, 1.0)
    zigzag: float = tuned(0.6, 0.0, 1.0)
    turn: float = tuned(50.0, 0.0, 180.0)
    stepped: float = tuned(0.7, 0.0, 1.0)
    open: float = tuned(0.5, 0.0, 1.0)
    rounded: tuple[float, float] = tuned((0.3, 0.01))
    opening: float = tuned(60.0, 0.0, 180.0)


@dataclass(frozen=True)
class CreaseSchedule(Schedule):
    """Creases of a surface of triangles.

    Attributes
    ----------
    smallest_group
        Edges of connected creases; of mean length, where one ends nowhere in particular.
    alike
        Degrees between normals that confirm each other.
    beside
        Share of the angle by which the surface bends beside a crease of many corners, if that is noise.
    spurs
        Rounds in which edges that lead nowhere are taken away.
    """

    smallest_group: int = tuned(12)
    alike: float = tuned(5.0, 0.0, 180.0)
    beside: float = tuned(0.2, 0.0, 1.0)
    spurs: int = tuned(3)
