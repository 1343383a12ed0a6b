"""What a run comes to, measured: how far the boundary went, its volume, sizes of cells, and whether it is no worse."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..energy import STRETCHED_ASPECTS, CornerEnergy, aspect_ratios, stretched_boxes
from ..geometry import DistanceBarrier, SurfaceLocator, distance_between, enclosed_volume, hausdorff
from ..mesh import NormalizedMesh
from .options import Record
from .volume_restoration import restored

__all__ = ["chosen_target", "distance", "no_worse", "of_same_volume", "size_ratios"]

Field = NDArray[np.float64]

_MANY = 0.05  # share of stretched cells from which on it is told that they count as distorted
_ROUNDING = 1e-12  # of a scaled Jacobian
_LEVEL = 1e-6  # the smallest one is approached from below where a corner is held: this close is as good
_SAME_VOLUME = 1e-10  # relative difference of volumes that is rounding


def no_worse(record: Record, first: Record) -> bool:
    """Whether fewer cells are inverted than in the input, or as many and neither minimum (to six digits) nor mean is
    lower."""
    if record.inverted != first.inverted:
        return record.inverted < first.inverted
    return (
        record.min_scaled_jacobian >= first.min_scaled_jacobian - _LEVEL
        and record.mean_scaled_jacobian >= first.mean_scaled_jacobian - _ROUNDING
    )


def distance(points: Field, frame: NormalizedMesh, band: DistanceBarrier | None, boundary: str) -> float:
    """How far the boundary is from where it was, or from the surface to slide on, in diagonals."""
    if band is not None and band.reference is not None:
        return distance_between(SurfaceLocator(points, frame.quads), band.reference) / frame.diagonal
    # Nodes that stay, or slide in the planes of flat patches, leave the surface where it is.
    exact = points is frame.points or (band is None and boundary != "free")
    return 0.0 if exact else hausdorff(points, frame.points, frame.quads) / frame.diagonal


def of_same_volume(points: Field, frame: NormalizedMesh, problem: CornerEnergy | None) -> tuple[Field, list[str]]:
    """The points changed to enclose what the input does, as nearly as can be, and what that took."""
    volume, changed = (enclosed_volume(x, frame.quads) for x in (frame.points, points))
    if problem is None or abs(changed - volume) <= _SAME_VOLUME * abs(volume):
        why, same = "the run was left before the cells were unfolded", points
    else:
        why, same = "hausdorff and the cells leave no room for more", restored(problem, points, frame.quads, volume)
    # Where cells upside down take away as much as the others enclose, changes are told in cubes of the mean edge.
    scale = abs(volume) or 1.0
    left = (enclosed_volume(same, frame.quads) - volume) / scale
    notes = []
    if same is not points:
        moved = np.linalg.norm(same - points, axis=1).max() / frame.diagonal
        before = f"a change of {(changed - volume) / scale:+.1e}"
        notes.append(f"volume: {before} was made up for by moving nodes, at most by {moved:.1e} diagonals")
    if abs(left) > _SAME_VOLUME:
        notes.append(f"the volume is not that of the input, but differs by {left:+.1e}: {why}")
    return same, notes


def size_ratios(volumes: Field, wanted: Field) -> tuple[float, float] | None:
    """Smallest and largest ratio of a cell's volume to the wanted one, None where none is wanted."""
    ratios = volumes[: len(wanted)][wanted > 0.0] / wanted[wanted > 0.0]
    return (float(ratios.min()), float(ratios.max())) if len(ratios) else None


def chosen_target(frame: NormalizedMesh) -> list[str]:
    """What target="auto" came to, if there was something to decide."""
    boxes = stretched_boxes(frame.points, frame.cells)
    if boxes is not None:
        keeping = int((boxes != 1.0).any(axis=1).sum())
        return [f"target auto: {keeping} cells are stretched in the input and keep their proportions"]
    stretched = aspect_ratios(frame.points, frame.cells) > STRETCHED_ASPECTS[0]
    if stretched.mean() < _MANY or not frame.valid.all():
        return []
    why = f"the {stretched.sum()} cells of aspect {STRETCHED_ASPECTS[0]:g} or more are skewed, not bricks"
    return [f"target auto: cubes, as {why}; target='input' would keep their shapes"]
