"""The boundary of a mesh that is shared out: its features, and what is kept inside, are found on rank 0."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...common import OptionError, agreed
from ...formulation import BarrierOnRanks, FacesOnRanks, Schedules
from ...mesh import NormalizedMesh
from ...ranks import GatheredFaces, NormalizedPiece
from ...solver import AdmissibleDirections, fixed_components
from ..boundary import Boundary, Measure, Value, boundary_of
from ..options import Options

__all__ = ["BoundaryOnRanks"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class BoundaryOnRanks(Boundary):
    """The boundary, in the places of nodes of this rank, and all of it on rank 0.

    Attributes
    ----------
    gathered
        The cells at kept faces, brought together; None where all of the boundary stays, and nothing is kept inside.
    whole
        The boundary of these cells, on rank 0.
    """

    gathered: GatheredFaces | None = field(default=None, kw_only=True)
    whole: Boundary | None = field(default=None, kw_only=True)

    @classmethod
    def of(
        cls, normalized: NormalizedPiece, options: Options, schedules: Schedules, held: Mask | None = None
    ) -> BoundaryOnRanks:
        """The boundary as the options ask for it; nodes (n,) may be held besides.

        Raises
        ------
        OptionError
            If masks or modes make no sense, or ask for what is not there.
        """
        space, count = normalized.space, len(normalized.points)
        with agreed(space.halo.comm):
            fixed = fixed_components(normalized.mesh, options.fixed)
        if options.boundary == "fixed" and normalized.regions(options.interfaces) is None:
            sums = np.zeros((count, 3, 3))
            sums[np.unique(normalized.quads)] = np.eye(3)
            sums = space.update(space.add(sums))
            return cls(AdmissibleDirections.from_normal_sums(sums, fixed))
        gathered = GatheredFaces.of(normalized)
        alike = replace(options, fixed=gathered.cells.of_nodes(fixed))
        stays = None if held is None else gathered.cells.of_nodes(held)
        whole, forbidden = None, None
        with agreed(space.halo.comm, named=False):
            if gathered.layer is not None:
                whole = boundary_of(gathered.layer, alike, schedules, held=stays)
                _require_there(whole)
                forbidden = np.eye(3) - whole.admissible.all_projectors(len(gathered.layer.points))
        sums = gathered.cells.spread(forbidden, np.zeros((count, 3, 3)))
        return cls.spread(whole, AdmissibleDirections.from_normal_sums(sums, fixed), gathered, normalized)

    @classmethod
    def spread(
        cls,
        whole: Boundary | None,
        admissible: AdmissibleDirections,
        gathered: GatheredFaces,
        normalized: NormalizedPiece,
    ) -> BoundaryOnRanks:
        """What each rank has of a boundary that rank 0 has of cells that came there; its directions are known."""
        comm, barrier = normalized.space.halo.comm, None
        curved, notes = comm.bcast(None if whole is None else (whole.barrier is not None, whole.notes))
        if curved:
            here = FacesOnRanks(normalized.space, normalized.faces.quads, normalized.beside, gathered.cells)
            barrier = BarrierOnRanks.of(None if whole is None else whole.barrier, here, normalized.points)
        return cls(admissible, barrier, notes, gathered=gathered, whole=whole)

    def measured(self, points: Field, normalized: NormalizedMesh, measure: Measure[Value]) -> Value:
        """What rank 0 measures of the points (n, 3) of all ranks, and of the boundary, as far as it has these."""
        if self.gathered is None:
            return measure(points, normalized, self)  # nothing has moved anywhere
        moved, told = self.gathered.cells.of_nodes(points), None
        comm = self.gathered.cells.space.halo.comm
        with agreed(comm, named=False):
            if self.gathered.layer is not None and self.whole is not None:
                told = measure(moved, self.gathered.layer, self.whole)
        found: Value = comm.bcast(told)
        return found

    def with_sheets_held(self, normalized: NormalizedMesh, options: Options, schedules: Schedules) -> Boundary:
        """The boundary with the nodes of the sheets inside held; all ranks must call it."""
        if self.gathered is None or not isinstance(normalized, NormalizedPiece):
            return self
        cells = self.gathered.cells
        on = None if self.whole is None else self.whole.on_sheets(cells.count)
        held = cells.spread(on, np.zeros(len(normalized.points), dtype=bool))
        return self.of(normalized, options, schedules, held)


def _require_there(boundary: Boundary) -> None:
    if len(boundary.admissible.coupled.nodes):
        raise OptionError(
            f"runs on ranks cannot move nodes together yet ({'; '.join(boundary.notes)}): take couplings='ignore'"
        )
