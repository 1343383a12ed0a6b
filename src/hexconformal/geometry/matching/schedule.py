"""The numbers by which the features of a mesh are matched with those of a surface."""

from __future__ import annotations

from dataclasses import dataclass

from ...common import Schedule, tuned

__all__ = ["MatchingSchedule"]


@dataclass(frozen=True)
class MatchingSchedule(Schedule):
    """Matching corners with nodes and curves with paths; distances in lengths of the edges there.

    Attributes
    ----------
    direct
        Distance of the ends of a piece of a curve over its length, at least: a quarter of a circle has .9, a half .64,
        which a path may take to be the way along the other half.
    candidates
        Nodes nearest to a corner that come into question for it.
    reach
        Edges around a curve where paths go.
    step
        Cost of an edge by itself: the shorter of two ways that are as near.
    misfit
        Cost of each cell around an edge more or less than the angle of the curve has room for: worth a distance of
        .7 edges, so that a ridge of cells is found where nodes are off by that.
    untagged
        Cost of an edge that is not between the tags on both sides of a curve where others are.
    none
        Cost of an end from which there is no way.
    farthest
        Root of the mean square of distances from which on a path does not follow its curve.
    rounds
        Times that the choice of nodes is gone through.
    close
        Share of the mean distance along a curve below which two nodes are too close, and all are spread evenly.
    smoothing
        Rounds of smoothing of the skin within its patches, where it is folded.
    """

    direct: float = tuned(0.7, 0.0, 1.0)
    candidates: int = tuned(12)
    reach: float = tuned(3.0)
    step: float = tuned(0.1)
    misfit: float = tuned(0.5)
    untagged: float = tuned(10.0)
    none: float = tuned(1e3)
    farthest: float = tuned(1.5)
    rounds: int = tuned(20)
    close: float = tuned(0.1, 0.0, 1.0)
    smoothing: int = tuned(30)
