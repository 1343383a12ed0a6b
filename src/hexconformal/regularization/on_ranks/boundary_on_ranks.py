"""The boundary of a mesh that is shared out: its features are those of the whole, found on rank 0."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...common import OptionError
from ...formulation import BarrierOnRanks, Schedules, SkinOnRanks
from ...geometry import sharp_length
from ...ranks import GatheredSkin, NormalizedPiece, agreed
from ...solver import AdmissibleDirections, fixed_components
from ..acceptance import boundary_distance, mean_boundary_distance
from ..boundary import Boundary, boundary_of
from ..options import Options

__all__ = ["BoundaryOnRanks"]

Field = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BoundaryOnRanks:
    """The boundary, in the places of nodes of this rank, and its skin on rank 0.

    Attributes
    ----------
    boundary
        What nodes here may do.
    skin
        The cells at the boundary, brought together; None where all of it stays.
    whole
        The boundary of that skin, on rank 0.
    """

    boundary: Boundary
    skin: GatheredSkin | None = None
    whole: Boundary | None = None

    @classmethod
    def of(cls, normalized: NormalizedPiece, options: Options, schedules: Schedules) -> BoundaryOnRanks:
        """The boundary as the options ask for it.

        Raises
        ------
        OptionError
            If masks or modes make no sense, or ask for what is not there.
        """
        space, count = normalized.space, len(normalized.points)
        with agreed(space.halo.comm):
            fixed = fixed_components(normalized.mesh, options.fixed)
        if options.boundary == "fixed":
            sums = np.zeros((count, 3, 3))
            sums[np.unique(normalized.quads)] = np.eye(3)
            sums = space.update(space.add(sums))
            return cls(Boundary(AdmissibleDirections.from_normal_sums(sums, fixed)))
        skin = GatheredSkin.of(normalized)
        held, whole, forbidden = skin.gathered.of_nodes(fixed), None, None
        with agreed(space.halo.comm, named=False):
            if skin.layer is not None:
                alike = replace(options, fixed=held, interfaces="ignore")
                whole = boundary_of(skin.layer, alike, schedules)
                _require_there(whole)
                forbidden = np.eye(3) - whole.admissible.all_projectors(len(skin.layer.points))
        sums = skin.gathered.spread(forbidden, np.zeros((count, 3, 3)))
        notes = space.halo.comm.bcast(None if whole is None else whole.notes)
        barrier = None
        if space.halo.comm.bcast(whole is not None and whole.barrier is not None):
            here = SkinOnRanks(space, normalized.quads, normalized.beside, skin.gathered)
            barrier = BarrierOnRanks.of(None if whole is None else whole.barrier, here, normalized.points)
        admissible = AdmissibleDirections.from_normal_sums(sums, fixed)
        return cls(Boundary(admissible, barrier, notes=notes), skin, whole)

    def measures(
        self, before: Field, after: Field, normalized: NormalizedPiece, options: Options
    ) -> tuple[float, float, tuple[float, float] | None]:
        """Largest and mean distance that the boundary has moved, in diagonals, and length of its sharp edges.

        Parameters
        ----------
        before, after
            (n, 3) normalized points.
        normalized
            The mesh.
        options
            Those of the run.
        """
        if self.skin is None:
            return 0.0, 0.0, None
        moved, told = self.skin.gathered.of_nodes(after), None
        if self.skin.layer is not None and self.whole is not None:
            layer = self.skin.layer
            largest = boundary_distance(moved, layer, self.whole, options.boundary)
            mean = mean_boundary_distance(moved, layer, self.whole) if largest > 0.0 else 0.0
            lengths = [layer.unit * sharp_length(points, layer.quads) for points in (layer.points, moved)]
            told = largest, mean, (lengths[0], lengths[1])
        found: tuple[float, float, tuple[float, float]] = normalized.space.halo.comm.bcast(told)
        return found


def _require_there(boundary: Boundary) -> None:
    if len(boundary.admissible.coupled.nodes):
        raise OptionError(
            f"runs on ranks cannot move nodes together yet ({'; '.join(boundary.notes)}): take couplings='ignore'"
        )
