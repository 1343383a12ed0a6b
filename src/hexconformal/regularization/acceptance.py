"""Acceptance of a result: no worse than the input, near enough, of the same volume, of the target sizes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import first_ids, first_names
from ..elements import are_collapsed, corner_scaled_jacobian
from ..energy import STRETCHED_ASPECTS, aspect_ratios, stretched_boxes
from ..formulation import LEVEL, Formulation
from ..geometry import BarrierSchedule, SurfaceLocator, distance_between, hausdorff, mean_distance
from ..mesh import NormalizedMesh, Regions
from ..quality import attainable_scaled_jacobian, connectivity_bound
from .boundary import Boundary
from .options import Options, Record
from .volume_restoration import enclosed_volumes, restore_volumes

__all__ = [
    "Distances",
    "Outcome",
    "auto_target_notes",
    "boundary_distance",
    "distances",
    "keeps_worst",
    "limit_notes",
    "mean_boundary_distance",
    "no_worse_than",
    "room_notes",
    "sheets_distance",
    "size_ratios",
    "swells",
    "with_volume_restored",
]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_MANY_STRETCHED = 0.05  # share of stretched cells from which on a note says that they count as distorted
_ROUNDING = 1e-12  # of a scaled Jacobian
_APART = 1e-5  # diagonals; patches that are flat to less than this are where they were
_SAME_VOLUME = 1e-10  # relative difference of volumes that is rounding
_NOTED_BELOW = 0.95  # a bound of the smallest scaled Jacobian above this says little
_REACHED = 2e-3  # of a bound, at which it is reached but for what the worst cells stall at
_POOR_SHAPE, _SHAPE_LOSS = 0.1, 0.9  # below this, less than so much of it is worse


@dataclass(frozen=True)
class Outcome:
    """Points of the user's mesh, their energy, why the run stopped, how far the boundary is, and what else to say.

    Where the run has led too far it comes to what it began with, and no criterion is met.
    """

    points: Field
    energy: float
    reason: str
    distance: float = 0.0  # diagonals
    mean_distance: float = 0.0
    notes: tuple[str, ...] = ()
    goes_back: bool = False


@dataclass(frozen=True)
class Distances:
    """How far the surface, and interfaces, have moved, in diagonals; from another surface to slide on, if any."""

    surface: float
    interfaces: float = 0.0
    is_given: bool = False

    def beyond(self, options: Options) -> tuple[str, float] | None:
        """What is farther than it may be, and how far; None for nothing. How near a given surface is, is told alone."""
        if self.interfaces > options.hausdorff:
            return "an interface", self.interfaces
        if options.boundary == "slide" and self.surface > options.hausdorff and not self.is_given:
            return "the surface", self.surface
        return None


def keeps_worst(record: Record, first: Record) -> bool:
    """True where fewer cells are inverted than at first, or flat, or as many and the worst of no type is worse."""
    tangled, before = (record.inverted, record.flat), (first.inverted, first.flat)
    return tangled < before or (
        tangled == before
        and record.min_scaled_jacobian >= first.min_scaled_jacobian - LEVEL
        and record.worst_gain >= first.worst_gain - LEVEL
    )


def no_worse_than(record: Record, first: Record) -> bool:
    """True where fewer cells are inverted than at first, or flat, or as many and nothing else is worse.

    That is the smallest and mean scaled Jacobian, the smallest of each type of cells, and the smallest shape where it
    is poor.
    """
    if (record.inverted, record.flat) != (first.inverted, first.flat):
        return keeps_worst(record, first)
    return (
        keeps_worst(record, first)
        and record.mean_scaled_jacobian >= first.mean_scaled_jacobian - _ROUNDING
        and record.min_shape >= _SHAPE_LOSS * min(first.min_shape, _POOR_SHAPE)
    )


def distances(points: Field, normalized: NormalizedMesh, boundary: Boundary, options: Options) -> Distances:
    """How far the boundary, and sheets inside, of normalized points (n, 3) are from where they were."""
    surface = boundary_distance(points, normalized, boundary, options.boundary)
    between = sheets_distance(points, normalized, boundary, options.hausdorff)
    return Distances(surface, between, boundary.reference is not None)


def boundary_distance(points: Field, normalized: NormalizedMesh, boundary: Boundary, mode: str) -> float:
    """Hausdorff distance of the boundary from where it was, or from the surface to slide on, in diagonals."""
    return boundary.measured(points, normalized, partial(_boundary_distance, mode=mode))


def _boundary_distance(points: Field, normalized: NormalizedMesh, boundary: Boundary, mode: str) -> float:
    barrier = boundary.barrier
    if boundary.reference is not None:
        return distance_between(SurfaceLocator(points, normalized.quads), boundary.reference) / normalized.diagonal
    # Only quads that have moved can be away from where they were.
    gone = (points != normalized.points).any(axis=1)
    moved = normalized.quads[gone[normalized.quads].any(axis=1)]
    if len(moved) == 0:
        return 0.0
    quads = moved if barrier is None and mode == "slide" else normalized.quads
    tolerance = None if barrier is None else barrier.schedule.tolerance * barrier.bound
    apart = hausdorff(points, normalized.points, quads, tolerance) / normalized.diagonal
    # Nodes that slide in the planes of flat patches leave the surface where it is, unless these have no outline, as
    # cells without volume do.
    return apart if quads is not moved or apart > _APART else 0.0


def mean_boundary_distance(points: Field, normalized: NormalizedMesh, boundary: Boundary) -> float:
    """Mean distance of the boundary from where it was, or from the surface to slide on, in diagonals."""
    return boundary.measured(points, normalized, _mean_boundary_distance)


def _mean_boundary_distance(points: Field, normalized: NormalizedMesh, boundary: Boundary) -> float:
    moved = SurfaceLocator(points, normalized.quads)
    if boundary.reference is not None:
        return mean_distance(moved, boundary.reference) / normalized.diagonal
    if (points == normalized.points)[np.unique(normalized.quads)].all():
        return 0.0
    return mean_distance(moved, SurfaceLocator(normalized.points, normalized.quads), near=True) / normalized.diagonal


def sheets_distance(points: Field, normalized: NormalizedMesh, boundary: Boundary, bound: float) -> float:
    """Largest Hausdorff distance of the sheets inside from where each was, in diagonals; to 2 % of a bound."""
    return boundary.measured(points, normalized, partial(_sheets_distance, bound=bound))


def _sheets_distance(points: Field, normalized: NormalizedMesh, boundary: Boundary, bound: float) -> float:
    inner, start = boundary.inner, normalized.points if boundary.start is None else boundary.start
    gone = (points != start).any(axis=1)
    if inner is None or points is normalized.points:
        return 0.0
    which = np.isin(inner.sheets, inner.sheets[gone[inner.quads].any(axis=1)])
    if not which.any():
        return 0.0
    numbers = np.unique(inner.sheets[which], return_inverse=True)[1]
    tolerance = BarrierSchedule.tolerance * bound * normalized.diagonal
    apart = hausdorff(points, start, inner.quads[which], tolerance, sheets=numbers) / normalized.diagonal
    return apart if apart > _APART else 0.0


def with_volume_restored(
    points: Field, normalized: NormalizedMesh, formulation: Formulation | None, regions: Regions | None = None
) -> tuple[Field, list[str]]:
    """The points changed to enclose the input's volume, as nearly as can be, and notes on what that took.

    Where the mesh has regions, each encloses its own.
    """
    names: tuple[str, ...] = ("the mesh",)
    surfaces, notes = [normalized.quads], []
    if regions is not None and formulation is not None:
        most = formulation.schedules.volume.regions
        if len(regions.names) <= most:
            names, surfaces = regions.names, normalized.surfaces_of(regions)
        else:
            notes.append(f"volume: that of all {len(regions.names)} regions together is kept, as they are over {most}")
    space = normalized.space
    volumes, changed = (enclosed_volumes(x, surfaces, space) for x in (normalized.points, points))
    if formulation is None or (np.abs(changed - volumes) <= _SAME_VOLUME * np.abs(volumes)).all():
        why, same = "the run was left before the cells were unfolded", points
    else:
        why = "hausdorff and the cells leave no room for more"
        same = _restored(formulation, points, surfaces, volumes)
    # Where cells upside down take away as much as the others enclose, changes are told in cubes of the mean edge.
    scales = np.where(volumes == 0.0, 1.0, np.abs(volumes))
    left = (enclosed_volumes(same, surfaces, space) - volumes) / scales
    if same is not points:
        moved = space.largest(np.linalg.norm(same - points, axis=1)) / normalized.diagonal
        changes = (changed - volumes) / scales
        before = f"a change of {changes[np.abs(changes).argmax()]:+.1e}"
        if len(names) > 1:
            before = f"changes of {len(names)} regions, the largest {changes[np.abs(changes).argmax()]:+.1e},"
        what = "was" if len(names) == 1 else "were"
        notes.append(f"volume: {before} {what} made up for by moving nodes, at most by {moved:.1e} diagonals")
    off = np.flatnonzero(np.abs(left) > _SAME_VOLUME)
    if len(off) and len(names) == 1:
        notes.append(f"the volume is not that of the input, but differs by {left[0]:+.1e}: {why}")
    elif len(off):
        listed = first_names([f"{names[k]} by {left[k]:+.1e}" for k in off])
        notes.append(f"volumes of regions are not those of the input, but differ, {listed}: {why}")
    return same, notes


def _restored(formulation: Formulation, points: Field, surfaces: Sequence[Ints], volumes: Field) -> Field:
    """The points changed to enclose volumes within the bound, which is watched closer where they come out of it."""
    for _ in range(formulation.schedules.volume.watches):
        same = restore_volumes(formulation, points, surfaces, volumes)
        if formulation.barrier is None or not formulation.barrier.exceeded(same):
            return same
        formulation = formulation.with_barrier(formulation.barrier.watching(same))
    return points


def swells(points: Field, normalized: NormalizedMesh, formulation: Formulation | None) -> bool:
    """True where a boundary that slides by the barrier encloses clearly more or less than it did."""
    if formulation is None or formulation.barrier is None or formulation.barrier.reference is not None:
        return False
    surfaces, space = [normalized.quads], normalized.space
    before, after = (float(enclosed_volumes(x, surfaces, space)[0]) for x in (normalized.points, points))
    return abs(after - before) > formulation.schedules.volume.drift * abs(before)


def size_ratios(volumes: Field, targets: Field) -> tuple[float, float] | None:
    """Smallest and largest ratio of a cell's volume to its target, None where no cell has one."""
    ratios = volumes[: len(targets)][targets > 0.0] / targets[targets > 0.0]
    return (float(ratios.min()), float(ratios.max())) if len(ratios) else None


def auto_target_notes(normalized: NormalizedMesh) -> list[str]:
    """A note on what target="auto" came to, if there was something to decide."""
    space = normalized.space
    boxes = stretched_boxes(normalized.points, normalized.cells, space)
    if boxes is not None:
        keeping = int(space.total((boxes != 1.0).any(axis=1).sum()))
        return [f"target auto: {keeping} cells are stretched in the input and keep their proportions"]
    stretched = aspect_ratios(normalized.points, normalized.cells) > STRETCHED_ASPECTS[0]
    if space.mean(stretched) < _MANY_STRETCHED or not space.everywhere(bool(normalized.valid.all())):
        return []
    count = int(space.total(stretched.sum()))
    why = f"the {count} cells of aspect {STRETCHED_ASPECTS[0]:g} or more are skewed, not bricks"
    if space.anywhere(bool(are_collapsed(normalized.cells).any())):
        return [f"target auto: cubes, and ideals of other types, as {why}"]
    return [f"target auto: cubes, as {why}; target='input' would keep their shapes"]


def limit_notes(normalized: NormalizedMesh, start: Field, held: NDArray[np.bool_], points: Field) -> list[str]:
    """What the smallest scaled Jacobian cannot exceed, as corners are held; or, once it is reached, as few cells meet.

    Parameters
    ----------
    normalized
        The mesh.
    start
        (n, 3) points from which nodes that are held did not move.
    held
        (n,) those.
    points
        (n, 3) what has been reached, in any unit.
    """
    space, notes = normalized.space, list[str]()
    bound, cell = attainable_scaled_jacobian(start, normalized.cells, held)
    lowest = space.smallest(np.array([bound]))
    if lowest < _NOTED_BELOW:
        which = space.named(None if bound > lowest else normalized.cell_labels[cell])
        notes.append(f"the smallest scaled Jacobian cannot exceed {lowest:.4g}: a corner of cell {which} is held")
    boundary = np.zeros(len(points), dtype=bool)
    boundary[normalized.quads] = True
    bound, node, count = connectivity_bound(normalized.cells, boundary, space)
    reached = space.smallest(corner_scaled_jacobian(points, normalized.cells))
    # More than the bound is reached where cells go round a node twice, or two bodies share it.
    if (1.0 - _REACHED) * bound < reached <= bound < _NOTED_BELOW:
        which = space.named(None if node is None else normalized.node_labels[node])
        notes.append(
            f"the smallest scaled Jacobian is what it can be, wherever the nodes are: it cannot exceed {bound:.4f}, as "
            f"{count} hexahedra meet at node {which}"
        )
    return notes


def room_notes(nodes: Ints, labels: NDArray[Any] | None) -> list[str]:
    """Nodes (k,) at which some cell stays invalid, as what is held is turned over, by their labels (n,) if any."""
    if len(nodes) == 0:
        return []
    return [
        f"no valid mesh has these nodes where they are held: {first_ids(nodes, labels)}; faces there are turned over"
    ]
