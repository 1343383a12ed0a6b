"""Where a run begins if an earlier one of the same mesh has come a part of the way: taken in, and checked."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...common import MeshError, OptionError, agreed, array_of_numbers, first_ids, unusable_points
from ...elements import is_valid
from ...io import as_volume_mesh
from ...mesh import HexMesh, MixedMesh, NormalizedMesh
from ...ranks import node_ids_of
from ...solver import fixed_components
from ..acceptance import distances
from ..boundary import Boundary, boundary_of
from ..setting import Setting

if TYPE_CHECKING:
    from ..on_ranks.mesh_on_ranks import MeshOnRanks

__all__ = ["Start", "begun_at"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_UNMOVED = 1e-9  # diagonals: what a file in text may lose of the place of a node


@dataclass(frozen=True, eq=False)
class Start:
    """What a run has reached, for another one of the same mesh to go on from.

    Attributes
    ----------
    points
        (k, 3) points, in the user's unit.
    lowered
        True where the distortion is low already, and the worst cells are raised.
    on_the_way
        True where the boundary may be out of its bound still, as in the middle of a run.
    node_ids
        (k,) the ids of their nodes, as in a :class:`hexconformal.ranks.MeshPiece`, on any ranks; None for all nodes of
        the mesh, or of the piece, in their order.
    """

    points: Field
    lowered: bool = False
    on_the_way: bool = False
    node_ids: Ints | None = None

    @classmethod
    def of(cls, given: Any) -> Start:
        """A start from one, from an array of points, or from a mesh with the same nodes, or its path.

        Raises
        ------
        OptionError
            If it is not of numbers, or not of three in a row.
        """
        if isinstance(given, cls):
            return given
        if not isinstance(given, np.ndarray | list):
            given = as_volume_mesh(given).points
        points = array_of_numbers("start", given, "(n, 3) points")
        if points.ndim != 2 or points.shape[1] != 3:
            raise OptionError(f"start must be (n, 3) points, not of shape {points.shape}")
        return cls(points)

    def placed(self, mesh: HexMesh | MixedMesh) -> Field:
        """The points (n, 3), in the order of the nodes of a mesh in one process.

        Raises
        ------
        OptionError
            If there is not one point for each node.
        """
        count = len(mesh.points)
        if self.node_ids is None:
            if len(self.points) != count:
                raise OptionError(f"start must be the {count} points of the mesh, not {len(self.points)}")
            return np.array(self.points)
        ids, first = np.unique(self.node_ids, return_index=True)
        wanted = node_ids_of(mesh)
        place = np.minimum(np.searchsorted(ids, wanted), max(len(ids) - 1, 0))
        missing = ids[place] != wanted if len(ids) else np.ones(count, dtype=bool)
        _require_all(missing, wanted)
        return self.points[first[place]]


def _require_all(missing: Mask, ids: Ints) -> None:
    """Raise an OptionError where points are missing."""
    if missing.any():
        raise OptionError(
            f"start must have a point for each node of the mesh; nodes without: {first_ids(ids[missing])}"
        )


def begun_at(
    given: Any, setting: Setting, boundary: Boundary, whole: MeshOnRanks | None
) -> tuple[Setting, Boundary, bool]:
    """The setting of a run that begins where an earlier one has come to; all ranks must call it.

    Returns
    -------
    The setting; the boundary, another one where that run has moved nodes that features hold, which it had let go; True
    where the boundary is within its bound, as a result must be.

    Raises
    ------
    OptionError
        If there is not one point for each node, or there is another surface to slide on.
    MeshError
        If points are not finite, nodes that are held have moved, valid cells are not, or the boundary is too far away.
    """
    normalized, options = setting.normalized, setting.options
    with _together(whole):
        if options.surface is not None:
            raise OptionError("start must go without another surface to slide on: hand in the half-done mesh instead")
        start = Start.of(given)
        found = start.placed(normalized.mesh) if whole is None else start.points
    if whole is not None:
        found, known = whole.placed(start.points, start.node_ids)
    with _together(whole):
        if whole is not None:
            _require_all(~known, whole.mesh.node_ids)
        bad, text = unusable_points(found, normalized.mesh.node_labels)
        if len(bad):
            raise MeshError(f"start: {text}")
    shift = (found - normalized.mesh.points)[normalized.node_ids] / normalized.unit
    moved = np.abs(shift) > _UNMOVED * normalized.diagonal
    boundary, held = _that_lets(moved, setting, boundary, whole)
    shift[held] = 0.0
    points = _coupled(normalized.points + shift, normalized, boundary)
    with _together(whole):
        _require_valid(points, normalized)
    far = distances(points, normalized, boundary, options)
    beyond = far.beyond(options)
    if beyond is not None and not start.on_the_way:
        what, much = beyond
        with _together(whole):
            raise MeshError(
                f"start: {what} is {much:.4g} diagonals away from where it is in the mesh, more than hausdorff = "
                f"{options.hausdorff:g} allows"
            )
    return replace(setting, start=points, lowered=start.lowered), boundary, beyond is None


def _together(whole: MeshOnRanks | None) -> AbstractContextManager[None]:
    """Inside, an error of a rank is one of all."""
    return nullcontext() if whole is None else agreed(whole.normalized.space.halo.comm)


def _that_lets(moved: Mask, setting: Setting, boundary: Boundary, whole: MeshOnRanks | None) -> tuple[Boundary, Mask]:
    """The boundary, or that with soft features, which lets components (n, 3) of nodes move, and those that it holds."""
    normalized, options = setting.normalized, setting.options
    with _together(whole):
        fixed = fixed_components(normalized.mesh, options.fixed)[normalized.node_ids]
    held = fixed | ~boundary.admissible.free(len(moved))[:, None]
    if options.features == "auto" and normalized.space.anywhere(bool((held & ~fixed & moved).any())):
        softened = replace(options, features="soft")
        other = boundary_of(normalized, softened, setting.schedules) if whole is None else whole.with_features("soft")
        note = "features='soft' instead, as nodes that these hold are elsewhere at the start"
        boundary = replace(other, notes=(*other.notes, note))
        held = fixed | ~boundary.admissible.free(len(moved))[:, None]
    with _together(whole):
        bad = (held & moved).any(axis=1)
        if bad.any():
            ids = first_ids(np.sort(normalized.node_labels[bad]))
            raise MeshError(f"start: nodes that are held are not where the mesh has them: {ids}")
    return boundary, held


def _coupled(points: Field, normalized: NormalizedMesh, boundary: Boundary) -> Field:
    """The points, with nodes that move together so to the last digit."""
    together = boundary.admissible.coupled.together(points, normalized.points)
    apart = (np.abs(together - points) > _UNMOVED * normalized.diagonal).any(axis=1)
    if apart.any():
        ids = first_ids(np.sort(normalized.node_labels[apart]))
        raise MeshError(f"start: nodes that move together have moved apart: {ids}")
    return together


def _require_valid(points: Field, normalized: NormalizedMesh) -> None:
    """Raise a MeshError where a cell is valid in the user's mesh, and not at normalized points (n, 3)."""
    mesh = normalized.mesh
    lost = np.flatnonzero(is_valid(mesh.points, mesh.cells) & ~is_valid(normalized.to_user(points), mesh.cells))
    if len(lost):
        raise MeshError(f"start: cells that are valid in the mesh are not: {first_ids(lost, mesh.cell_labels)}")
