"""A run's mesh where it is shared out between ranks: taken in, checked, and reported on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...common import OptionError, agreed
from ...formulation import Schedules
from ...geometry import sharp_length
from ...mesh import NormalizedMesh
from ...quality import quality
from ...ranks import MeshPiece, NormalizedPiece, rank_summary, require_alike, rows_of_copies, taken_in
from ..acceptance import Outcome
from ..boundary import Boundary
from ..options import Options, Record
from ..region_rows import InterfaceRow, interface_rows, region_rows
from ..report import Report
from ..setting import Setting
from .boundary_on_ranks import BoundaryOnRanks
from .stages_there import require_options
from .unfolding_on_ranks import require_room

if TYPE_CHECKING:
    from ..stages import State  # which know this folder

__all__ = ["MeshOnRanks"]

Field = NDArray[np.float64]


class MeshOnRanks:
    """What a run needs of a mesh that all ranks hand in together; all must do the same with it.

    Parameters
    ----------
    piece
        The :class:`hexconformal.ranks.MeshPiece` of this rank.
    options, schedules
        Of the run.
    comm
        The ranks.

    Attributes
    ----------
    mesh, normalized
        Own cells, and the nodes of this rank, as they came and as they are worked on.
    boundary
        What nodes here may do.
    notes
        Decisions, in words.
    """

    def __init__(self, piece: Any, options: Options, schedules: Schedules, comm: Any) -> None:
        with agreed(comm):
            require_options(options)
        require_alike(comm, schedules=schedules, **{one.name: getattr(options, one.name) for one in fields(options)})
        curved = options.boundary == "slide" and options.hausdorff > 0.0
        rings = schedules.barrier.copied_rings if curved else 0
        self._distribution = taken_in(piece, comm, options.interfaces, rings)
        self._options, self._schedules, self._given_ids = options, schedules, piece.node_ids
        self.mesh = self._distribution.piece
        self.normalized, self.notes = NormalizedPiece(self._distribution), tuple[str, ...]()
        self.boundary = BoundaryOnRanks.of(self.normalized, options, schedules)

    def require_stages(self, setting: Setting) -> None:
        """Raise an OptionError where the mesh needs a stage that is not there."""
        if self._options.energy == "barrier" and setting.is_tangled:
            require_room(setting, self.normalized)

    def placed(self, points: Field, node_ids: NDArray[np.int64] | None) -> tuple[Field, NDArray[np.bool_]]:
        """Points (n, 3) of the nodes here, from rows (k, 3) that all ranks have together, each with the id of its node.

        Without ids they are those of the nodes that this rank handed in, in their order.

        Returns
        -------
        The points, and the nodes (n,) that there is one for.

        Raises
        ------
        OptionError
            If there are not as many as ids, or copies of a node are at several places.
        """
        comm, ids = self.normalized.space.halo.comm, self._given_ids if node_ids is None else node_ids
        with agreed(comm):
            if len(points) != len(ids):
                raise OptionError(f"start must be the {len(ids)} points of the piece, not {len(points)}")
        return rows_of_copies(comm, self.mesh.node_ids, ids, points, "start: copies of a node must be at one place")

    def with_features(self, features: str) -> Boundary:
        """The boundary with other features, which holds from now on."""
        options = replace(self._options, features=features)
        self.boundary = BoundaryOnRanks.of(self.normalized, options, self._schedules)
        return self.boundary

    def to_given_nodes(self, points: Field) -> Field:
        """Points (n, 3) in the order in which this rank handed in its nodes."""
        return self._distribution.to_given_nodes(points)

    def result(
        self, outcome: Outcome, state: State, history: Sequence[Record], notes: Sequence[str], seconds: float
    ) -> tuple[MeshPiece, Report]:
        """The better mesh, own cells and their nodes, and the report, the same on all ranks.

        Parameters
        ----------
        outcome
            What it comes to.
        state, history, notes, seconds
            Of the run.
        """
        space, normalized, mesh, points = self.normalized.space, self.normalized, self.mesh, outcome.points
        before, after = quality(mesh), quality(mesh.replaced(points=points))
        shift = points - mesh.points
        moved = np.linalg.norm(shift, axis=1)
        skin = np.zeros(len(points), dtype=bool)
        skin[normalized.quads] = True
        skin = space.joined(skin)
        diagonal = normalized.diagonal * normalized.unit
        sharp, interfaces, told = self._on_faces(points, diagonal)
        regions = normalized.regions(self._options.interfaces)
        report = Report(
            before=rank_summary(before, space),
            after=rank_summary(after, space),
            energy_before=history[0].energy if history else float("nan"),
            energy_after=outcome.energy,
            boundary_moved=int(space.total((space.own(moved) > 0.0)[space.own(skin)].sum())),
            largest_displacement=max(space.largest(moved), 0.0),
            diagonal=diagonal,
            iterations=max(len(history) - 1, 0),
            seconds=seconds,
            reason=outcome.reason,
            converged=state.converged and not outcome.goes_back,
            options=self._options.described(),
            notes=(*notes, *told, f"ranks: {space.halo.comm.size}"),
            hausdorff=outcome.distance,
            mean_distance=outcome.mean_distance,
            sharp_edges=sharp,
            regions=() if regions is None else region_rows(regions, before, after, space),
            interfaces=interfaces,
        )
        better = mesh.replaced(
            points=points,
            point_data={"moved_by": shift},
            cell_data={
                "scaled_jacobian": after.scaled_jacobian,
                "scaled_jacobian_change": after.scaled_jacobian - before.scaled_jacobian,
            },
        )
        return better, report

    def _on_faces(
        self, points: Field, diagonal: float
    ) -> tuple[tuple[float, float] | None, tuple[InterfaceRow, ...], list[str]]:
        """Length of sharp edges before and after, rows of interfaces, and notes; of points in the user's unit."""
        interfaces, boundary = self._options.interfaces, self.boundary

        def measure(
            moved: Field, layer: NormalizedMesh, _: Boundary
        ) -> tuple[tuple[float, float], tuple[InterfaceRow, ...], list[str]]:
            regions, before = layer.regions(interfaces), layer.mesh.points
            sharp = sharp_length(before, layer.quads), sharp_length(moved, layer.quads)
            rows, notes = ((), []) if regions is None else interface_rows(regions, layer.mesh, moved, diagonal)
            return sharp, rows, notes

        return (None, (), []) if boundary.gathered is None else boundary.measured(points, self.normalized, measure)
