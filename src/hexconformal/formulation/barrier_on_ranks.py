"""The distance barrier of kept faces that are shared out: every rank has the samples that move with its own ones.

The original surface is whole everywhere, in memory once for each machine. Backward samples belong to the rank on whose
faces the closest points are, and go where these go. Rank 0 has the barrier of all of it besides: distances of the whole
surface are measured there, samples are added there, and patches begin with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..common import agreed
from ..energy import Patch
from ..geometry import DistanceBarrier, Samples, Steep
from ..ranks import GatheredCells, Routes, dealt, on_every_machine
from .faces_on_ranks import FacesOnRanks, SurfaceShare

__all__ = ["BarrierOnRanks"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Value = TypeVar("Value")


_NO_SURFACES: dict[str, Any] = {"original": None}  # these are known
_LINES, _CORNERS = ("nodes", "weights", "near", "slack"), ("corners", "places", "slack_corners")
_Dealt = tuple[Ints | None, dict[str, NDArray[Any]] | None]


@dataclass(frozen=True, eq=False)
class BarrierOnRanks(DistanceBarrier):
    """What a rank has of the barrier of a boundary; all ranks must renew and ask for distances together.

    Attributes
    ----------
    here
        The faces of this rank.
    share
        What it has of the surface that is kept near where it was.
    whole
        The barrier of all of that surface, by the nodes of the layer of cells at it, on rank 0.
    """

    here: FacesOnRanks = field(kw_only=True)
    share: SurfaceShare = field(kw_only=True)
    whole: DistanceBarrier | None = field(kw_only=True)

    @classmethod
    def of(
        cls, whole: DistanceBarrier | None, here: FacesOnRanks, points: Field, known: BarrierOnRanks | None = None
    ) -> BarrierOnRanks:
        """What each rank has of a barrier that is on rank 0, at points (n, 3); all must call it.

        Its original may be known already.
        """
        comm, halo = here.space.halo.comm, here.space.halo
        bare = None if whole is None else _bare(whole)
        if known is not None and comm.bcast(whole is not None and known.whole.original is whole.original):  # type: ignore[union-attr]
            bare = comm.bcast(None if bare is None else replace(bare, **_NO_SURFACES))
            bare = replace(bare, original=known.original, curves=replace(bare.curves, locator=known.curves.locator))
        else:
            bare = on_every_machine(comm, bare)
        every, firsts = here.of_all()
        share = here.share(every[:0] if whole is None else whole.original.faces)
        forward, backward, curves = _dealt_rows(whole, share.owners, here.layer.numbers, every, firsts)
        ahead, behind = dealt(comm, *forward), dealt(comm, *backward)
        lines, corners = dealt(comm, *curves[0]), dealt(comm, *curves[1])
        local = {"nodes": halo.local(lines.pop("nodes")), "corners": halo.local(corners.pop("corners"))}
        return cls(
            **{
                name: getattr(bare, name) for name in ("original", "bound", "steepness", "reference", "wall", "spacing")
            },
            skin=share.surface(points, bare.original),
            forward=replace(bare.forward, **ahead | {"faces": share.places(ahead["faces"])}),
            backward=replace(bare.backward, **behind | {"near": share.places(behind["near"])}),
            curves=replace(bare.curves, **lines, **corners, **local),
            measured_at=points,
            schedule=bare.schedule,
            here=here,
            share=share,
            whole=whole,
        )

    # ------------------------------------------------------------------------------------------ measuring
    def _seen(self, points: Field) -> tuple[list[Steep], DistanceBarrier]:
        steep, seen = DistanceBarrier._seen(self._with_samples_where_closest(points), points)
        wall = self.schedule.wall if seen.skin is None else seen.wall
        return steep, replace(seen, wall=self.here.space.largest(np.array([wall])))

    def _with_samples_where_closest(self, points: Field) -> BarrierOnRanks:
        """The barrier with backward samples on the ranks that own the faces closest to them."""
        moved, before = self._with_samples_moved(points, True), self
        # From the last copies of others' faces a walk goes on there.
        while moved is not before:
            moved, before = moved._with_samples_moved(points, False), moved
        return moved

    def _with_samples_moved(self, points: Field, looks: bool) -> BarrierOnRanks:
        """The barrier with backward samples where the faces are to which they have walked; itself where all are there.

        Those that are too far away may have come to a dead end, and are looked for everywhere, if at all.
        """
        space, share, comm = self.here.space, self.share, self.here.space.halo.comm
        which, near, away = np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0, dtype=bool)
        distances = np.empty(0)
        if self.skin is not None:
            which, found, _ = self._walked(self.skin, points)[1]
            near, distances = found.faces, found.distances
            away = looks & (distances > self.schedule.wall * self.bound)
        beyond = ~away & (near >= share.own)
        if not space.anywhere(bool((away | beyond).any())):
            return self
        # Those on faces of others go there.
        routes = Routes(comm, share.ranks[near[beyond] - share.own])
        come = Samples.backward(
            routes.forward(self.backward.places[which[beyond]]),
            share.places(routes.forward(share.numbers[near[beyond]])),
            routes.forward(distances[beyond]),
        )
        kept = np.ones(len(self.backward), dtype=bool)
        kept[which[away | beyond]] = False
        backward = self.backward.chosen(kept).joined(come).joined(self._looked_for(points, which[away]))
        return replace(self, backward=backward)

    def _looked_for(self, points: Field, which: Ints) -> Samples:
        """Backward samples of all ranks that may be in a dead end, each on the rank that is closest."""
        space, comm, sheets = self.here.space, self.here.space.halo.comm, self.share.sheets(self.original)
        own = None if sheets is None else sheets[self.backward.near[which]]
        found = comm.allgather((self.backward.places[which], own))
        places = np.concatenate([rows for rows, _ in found])
        near, distances = np.zeros(len(places), np.int64), np.full(len(places), np.inf)
        if self.skin is not None:
            here, start = np.arange(len(places)), None
            if sheets is not None:
                # Of each sheet any face that is here.
                wanted = np.concatenate([rows for _, rows in found])
                known, first = np.unique(sheets, return_index=True)
                at = np.searchsorted(known, wanted).clip(max=len(known) - 1)
                here = np.flatnonzero(known[at] == wanted)
                start = first[at[here]]
            there = self.skin.with_points(points).closest(places[here], start)
            near[here], distances[here] = there.faces, there.distances
        closest = distances == space.least(distances)
        mine = space.least(np.where(closest, comm.rank, comm.size)) == comm.rank
        return Samples.backward(places[mine], near[mine], distances[mine])

    def relative_distance(self, points: Field) -> float:
        """Largest distance of any sample, in both directions, in units of the bound."""
        return self._of_whole(points, lambda whole, moved: whole.relative_distance(moved))

    def farthest(self, points: Field) -> float:
        """Hausdorff distance of the bilinear surface from its original, in units of the bound."""
        return self._of_whole(points, lambda whole, moved: whole.farthest(moved))

    def exceeded(self, points: Field) -> bool:
        """True where any place of the bilinear surface is farther from its original than the bound, or nearly so."""
        return self._of_whole(points, lambda whole, moved: whole.exceeded(moved))

    def nodes_beyond(self, points: Field) -> Mask:
        """(n,) nodes of the faces for which the bound is exceeded, or nearly so."""
        moved, found = self.here.layer.of_nodes(points), None
        with agreed(self.here.space.halo.comm, named=False):
            if self.whole is not None:
                found = self._alike(self.whole).nodes_beyond(moved)
        return self.here.layer.spread(found, np.zeros(len(points), dtype=bool))

    def watching(self, points: Field) -> BarrierOnRanks:
        """The barrier with samples where quads, or the original, are nearly out of the bound."""
        moved, whole = self.here.layer.of_nodes(points), None
        with agreed(self.here.space.halo.comm, named=False):
            if self.whole is not None:
                whole = self._alike(self.whole).renewed(moved).watching(moved)
        return BarrierOnRanks.of(whole, self.here, points, self)

    def with_slack(self, nodes: Mask) -> tuple[BarrierOnRanks, int]:
        """The barrier with curves and corners at some nodes as free as the surface; how many curves are so now."""
        touched, count, whole = self.here.layer.of_nodes(nodes), 0, None
        if self.whole is not None:
            whole, count = self.whole.with_slack(touched)
        curves = self.curves.with_slack(nodes)[0]
        return replace(self, curves=curves, whole=whole), self.here.space.halo.comm.bcast(count)

    def _of_whole(self, points: Field, measured: Callable[[DistanceBarrier, Field], Value]) -> Value:
        """What rank 0 finds of the whole boundary."""
        moved, found = self.here.layer.of_nodes(points), None
        with agreed(self.here.space.halo.comm, named=False):
            if self.whole is not None:
                found = measured(self._alike(self.whole), moved)
        value: Value = self.here.space.halo.comm.bcast(found)
        return value

    def _alike(self, whole: DistanceBarrier) -> DistanceBarrier:
        names = ("bound", "steepness", "wall", "spacing", "schedule")
        return replace(whole, **{name: getattr(self, name) for name in names})

    # -------------------------------------------------------------------------------------------- patches
    def on_one_rank(self, cells: GatheredCells, points: Field, moving: Mask) -> DistanceBarrier | None:
        """The barrier of cells that came to rank 0, where some nodes (n,) move; None elsewhere."""
        layer, moved = self.here.layer, self.here.layer.of_nodes(points)
        at_cells, inside = cells.of_nodes(points), cells.of_nodes(moving)
        if self.whole is None:
            return None
        there = np.minimum(np.searchsorted(cells.numbers, layer.numbers), cells.count - 1)
        beyond = cells.numbers[there] != layer.numbers
        table = np.where(beyond, cells.count + np.cumsum(beyond) - 1, there)
        every = np.concatenate([at_cells, moved[beyond]])
        seen = self._alike(self.whole).renewed(moved)
        if seen.skin is None:
            return None
        skin = seen.skin.part(np.arange(len(seen.skin.faces)), table, every)
        lines = replace(seen.curves, nodes=table[seen.curves.nodes], corners=table[seen.curves.corners])
        moves = np.concatenate([inside, np.zeros(beyond.sum(), dtype=bool)])
        patch = Patch(np.empty(0, np.int64), np.arange(cells.count), moves, every)
        return replace(seen, skin=skin, measured_at=every, curves=lines).restricted(patch)


def _bare(whole: DistanceBarrier) -> DistanceBarrier:
    """A barrier without its samples, with all that its original needs to be asked for distances."""
    curves = replace(whole.curves, **{name: getattr(whole.curves, name)[:0] for name in (*_LINES, *_CORNERS)})
    return replace(
        whole,
        original=whole.original.prepared(),
        skin=None,
        measured_at=whole.measured_at[:0],
        forward=whole.forward.chosen(np.zeros(len(whole.forward), dtype=bool)),
        backward=whole.backward.chosen(np.zeros(len(whole.backward), dtype=bool)),
        curves=curves,
        beside=whole.beside[:0],
    )


def _dealt_rows(
    whole: DistanceBarrier | None, owners: Ints, numbers: Ints, faces: Ints, firsts: Ints
) -> tuple[_Dealt, _Dealt, tuple[_Dealt, _Dealt]]:
    """Samples of a barrier on rank 0, and the ranks that they are for; nodes by their numbers of all ranks.

    Faces of the surface have owners; kept faces (k, 4) are those of all ranks, with the first of each.
    """
    none: _Dealt = None, None
    if whole is None:
        return none, none, (none, none)

    curves, count = whole.curves, len(numbers)
    forward = {name: getattr(whole.forward, name) for name in ("faces", "weights", "near", "distances", "attraction")}
    backward = {name: getattr(whole.backward, name) for name in ("places", "near", "distances", "attraction")}
    # A curve's sample goes where a face with its nodes is.
    ends = np.concatenate([np.stack([faces, np.roll(faces, shift, axis=1)], axis=2) for shift in (0, 1)]).reshape(-1, 2)
    keys, first = np.unique(np.sort(ends, axis=1) @ [count, 1], return_index=True)

    def ranks_at(nodes: Ints) -> Ints:
        face = first[np.searchsorted(keys, np.sort(nodes, axis=1) @ [count, 1])] // 4 % len(faces)
        return np.searchsorted(firsts, face, side="right") - 1

    lines = {name: getattr(curves, name) for name in _LINES} | {"nodes": numbers[curves.nodes]}
    corners = {name: getattr(curves, name) for name in _CORNERS} | {"corners": numbers[curves.corners]}
    of_corners = ranks_at(np.column_stack([curves.corners, curves.corners]))
    return (
        (owners[whole.forward.faces], forward),
        (owners[whole.backward.near], backward),
        ((ranks_at(curves.nodes), lines), (of_corners, corners)),
    )
