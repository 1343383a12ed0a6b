"""What stays the same during a run: the mesh, the options, and what these ask for."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..elements import TypedRows, all_valid, corner_scaled_jacobian, is_valid, rows_by_type
from ..energy import CornerTerm, DistortionTerm, inverse_targets, normalized_target, stretch_of, target_volumes
from ..formulation import Formulation, Schedules
from ..mesh import NormalizedMesh, Regions, face_table, node_rings
from ..quality import connectivity_bounds, impossible_corners
from .boundary import Boundary
from .minimize import distortion_term
from .options import Options

__all__ = ["Setting"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Setting:
    """The mesh and the options of a run.

    Attributes
    ----------
    normalized
        The mesh.
    options
        The options.
    schedules
        The tuned numbers of all stages.
    start
        (n, 3) normalized points that an earlier run has reached; None where there was none.
    lowered
        True where that run had lowered the distortion already, and was raising the worst cells.
    """

    normalized: NormalizedMesh
    options: Options
    schedules: Schedules = field(default_factory=Schedules)
    start: Field | None = None
    lowered: bool = False

    @property
    def first(self) -> Field:
        """(n, 3) normalized points at which the run begins."""
        return self.normalized.points if self.start is None else self.start

    @cached_property
    def target_volumes(self) -> Field:
        """(m,) volumes that cells should have, in the user's unit, 0 for those without; empty for none at all."""
        normalized = self.normalized
        sized = np.empty_like(normalized.valid)
        sized[normalized.cell_ids] = normalized.valid & ~self.flat(normalized.points)
        volumes = target_volumes(self.options.sizes, normalized.mesh, sized)
        return volumes[normalized.cell_ids] if len(volumes) else volumes

    @cached_property
    def regions(self) -> Regions | None:
        """The regions of the mesh, if it has any that count."""
        return self.normalized.regions(self.options.interfaces)

    @cached_property
    def distortion(self) -> DistortionTerm:
        """The distortion as the options ask for it."""
        return distortion_term(self.normalized, self.options)

    def formulation(self, boundary: Boundary) -> Formulation:
        """What objectives are made of, with a boundary."""
        normalized, options, scales = self.normalized, self.options, self.distortion.scales
        return Formulation(
            normalized.cells,
            len(normalized.points),
            self._corners.inverses,
            boundary.admissible,
            boundary.barrier,
            self.target_volumes / normalized.unit**3,
            self.schedules.minimization.target_sizes_factor if options.changes_sizes else 1.0,
            self.schedules.newton.mesh_rounding if options.raises_worst and not options.changes_sizes else 0.0,
            np.empty(0) if scales is None else scales,
            self._slender,
            self.least_of_types,
            self._attainable,
            schedules=self.schedules,
            space=normalized.space,
        )

    @cached_property
    def _corners(self) -> CornerTerm:
        normalized = self.normalized
        target = normalized_target(self.options.target, normalized)
        inverses = inverse_targets(target, normalized.points, normalized.cells, "corners", normalized.cell_labels)
        return CornerTerm(normalized.cells, np.empty((0, 1, 3, 3)) if inverses is None else inverses)

    @cached_property
    def _slender(self) -> Field:
        """(m,) slenderness up to which proportions cost nothing: no cell has to get thicker than it is."""
        schedule, corners = self.schedules.minimization, self._corners
        measures = corners.measures(self.normalized.points)
        sized = ~self.schedules.untangling.are_flat(measures.fullness)
        # How thin a folded cell is meant to be nobody knows; where few are folded, as those around them.
        few = self.normalized.space.mean(sized) > 0.5
        allowed = np.where(sized | few, schedule.slender, schedule.slenderest)
        # Slenderness is relative to the target: what that has of its own counts.
        if len(corners.inverses):
            room = np.maximum(schedule.slenderest / stretch_of(corners.inverses), schedule.least_slender)
            allowed = np.minimum(allowed, room)
        return np.where(sized, np.maximum(measures.slenderness, allowed), allowed)

    @cached_property
    def _attainable(self) -> Field:
        """(m,) what the smallest scaled Jacobian around each cell cannot exceed."""
        normalized = self.normalized
        boundary = np.zeros(len(normalized.points), dtype=bool)
        boundary[normalized.quads] = True
        bounds = connectivity_bounds(normalized.cells, normalized.space.joined(boundary), normalized.space)
        if not normalized.space.is_shared:  # a rank does not see all faces at the nodes of its cells
            bounds[np.isin(normalized.cells, self._impossible_nodes()).any(axis=1)] = 0.0
        return bounds

    def _impossible_nodes(self) -> Ints:
        """Nodes around which not all cells can be valid: they are among those of cells that are not so."""
        cells, count = self.normalized.cells, len(self.normalized.points)
        invalid = node_rings(cells, count, ~self.valid, 0)
        around = cells[invalid[cells].any(axis=1)]
        nodes = impossible_corners(face_table(around), around)
        return nodes[invalid[nodes]]

    @cached_property
    def least_of_types(self) -> Field:
        """(m,) smallest scaled Jacobian that the type of each cell has at first; empty where there is one type."""
        least = np.empty(len(self.normalized.cells) if len(self._first_minima) > 1 else 0)
        if len(least):
            for one, smallest in zip(self._types, self._first_minima, strict=True):
                least[one.rows] = smallest
        return least

    def worst_gain(self, scaled_jacobian: Field) -> float:
        """The least, over the types, of what the smallest of scaled Jacobians (m,) has won since the input."""
        space = self.normalized.space
        return float((space.least(self._minima(scaled_jacobian)) - self._first_minima).min())

    @cached_property
    def _types(self) -> tuple[TypedRows, ...]:
        return rows_by_type(self.normalized.cells)

    @cached_property
    def _first_minima(self) -> Field:
        normalized = self.normalized
        return normalized.space.least(self._minima(corner_scaled_jacobian(normalized.points, normalized.cells)))

    def _minima(self, values: Field) -> Field:
        return np.array([values[one.rows].min(initial=np.inf) for one in self._types])

    def flat(self, points: Field) -> Mask:
        """(m,) cells with a corner that is folded, or as good as flat beside its target: with next to no volume."""
        return self.schedules.untangling.are_flat(self._corners.fullness(points))

    @cached_property
    def is_tangled(self) -> bool:
        """True where a cell is invalid where the run begins, or has next to no volume."""
        bad = self.flat(self.first) | ~self.valid  # all parts are asked for both
        return self.normalized.space.anywhere(bool(bad.any()))

    @cached_property
    def valid(self) -> Mask:
        """(m,) cells that are valid where the run begins."""
        return self.normalized.valid if self.start is None else is_valid(self.start, self.normalized.cells)

    @cached_property
    def _valid_in_mesh(self) -> Ints:
        normalized = self.normalized
        return np.flatnonzero(is_valid(normalized.to_user(self.first), normalized.mesh.cells))

    def keeps_valid(self, points: Field) -> bool:
        """True where every cell that is valid where the run begins, as the user has it, is so at these points."""
        normalized = self.normalized
        valid = all_valid(normalized.to_user(points), normalized.mesh.cells, self._valid_in_mesh)
        return normalized.space.everywhere(valid)

    def ids(self, cells: Mask) -> Ints:
        """Ids that cells (m,) have in the mesh."""
        return np.sort(self.normalized.cell_ids[cells])
