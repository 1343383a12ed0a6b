"""The mesh of a motion as it is worked on, and the way there of what is handed in; in one process, or on ranks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, OptionError, agreed, array_of_numbers, as_mask, first_ids
from ..geometry import kept_edges
from ..io import as_volume_mesh
from ..mesh import HexMesh, MixedMesh, NormalizedMesh, collapsed_mesh
from ..quality import require_linear, require_sound
from ..ranks import GatheredFaces, MeshPiece, NormalizedPiece, node_ids_of, rows_by_id, rows_of_copies, taken_in
from ..solver import line_normal_sums, planar_normal_sums

__all__ = ["MovingMesh", "MovingPiece", "moving_ids"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


_OTHER_STATE = "state must be that of the same mesh and moving nodes"


class MovingMesh:
    """A mesh in one process, all nodes of which have the numbers that they came with.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_volume_mesh` takes.

    Attributes
    ----------
    mesh, hexahedra
        The mesh as it came, and with its cells as hexahedra, some of them collapsed.
    normalized
        The mesh as it is worked on.
    node_ids, cell_ids
        What its nodes (n,) and cells (m,) are called: on all ranks, or by their places.
    comm
        The ranks that have it; None for one process.
    notes
        Warnings about it, in words.

    Raises
    ------
    MeshError
        If the mesh cannot be worked on, or is not valid.
    """

    mesh: HexMesh | MixedMesh
    hexahedra: HexMesh
    node_ids: Ints
    cell_ids: Ints
    comm: Any = None

    def __init__(self, mesh: Any) -> None:
        self.mesh = as_volume_mesh(mesh)
        require_linear(self.mesh)
        self.notes = tuple(finding.message for finding in require_sound(self.mesh))
        self.hexahedra = collapsed_mesh(self.mesh)
        self.normalized = NormalizedMesh(self.hexahedra)
        self.node_ids, self.cell_ids = node_ids_of(self.mesh), np.arange(len(self.hexahedra.cells))
        self._require_valid()

    def _require_valid(self) -> None:
        invalid = self.ids(~self.normalized.valid)
        if len(invalid):
            raise MeshError(
                f"a mesh that moves must be valid at the start: {self.named(invalid)} are not; "
                "untangle it first (regularize)"
            )

    # ------------------------------------------------------------------- from the nodes that came, and back
    def marked(self, mask: Mask) -> Mask:
        """(n,) nodes that are worked on, where those that came are marked (k,), by any rank."""
        return mask

    def brought(self, rows: Field, nodes: Ints, to: Ints, problem: str = "") -> Field:
        """Rows (t, 3) at nodes that are worked on, from rows (k, 3) at nodes that came.

        Of a node that came to several ranks they must be the same, or the problem is raised as an OptionError.
        """
        found = np.empty((len(self.normalized.points), 3))
        found[nodes] = rows
        return found[to]

    def given_back(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Rows (n, ...) at the nodes that are worked on, at those that came."""
        return rows

    def rows_of_state(self, rows: Any, ids: Any, nodes: Ints) -> Field:
        """Rows (w, 3) at nodes (w,) of those that came, from what a state has at ids (k,), all ranks together.

        Raises
        ------
        OptionError
            If there are none for one of them, or some for others, or copies of a node have several.
        """
        with agreed(self.comm):
            rows, ids = array_of_numbers("state", rows), np.asarray(ids)
            if ids.ndim != 1 or ids.dtype.kind not in "iu" or rows.shape != (len(ids), 3):
                raise OptionError(_OTHER_STATE)
        wanted, problem = self.node_ids[nodes], "state: copies of a node must be at one place"
        found, there = rows_of_copies(self.comm, wanted, ids.astype(np.int64), rows, problem)
        expected = rows_by_id(self.comm, ids.astype(np.int64), wanted, wanted)[1]
        with agreed(self.comm):
            for what, which in (("nodes without", wanted[~there]), ("others", ids[~expected])):
                if len(which):
                    raise OptionError(f"{_OTHER_STATE}; {what}: {first_ids(which)}")
        return found

    # ------------------------------------------------------------------------------------------- what is told
    def ids(self, cells: Mask) -> Ints:
        """Ids, ascending, of cells (m,) of all ranks: their numbers in the mesh, or what all ranks call them."""
        return np.sort(self.normalized.cell_ids[cells])

    def named(self, ids: Ints) -> str:
        """How many cells these are, and the first of them, in words."""
        return first_ids(ids, self.mesh.cell_labels)

    def wall_normals(self) -> Field:
        """(n, 3, 3) sums of n n^T over the directions n in which nodes must not leave the boundary."""
        return _wall_normals(self.normalized)


class MovingPiece(MovingMesh):
    """The same of a mesh that all ranks hand in together; all must do the same with it.

    Parameters
    ----------
    piece
        The :class:`hexconformal.ranks.MeshPiece` of this rank.
    interfaces
        Which regions there are; see :class:`hexconformal.MeshMotion`.
    comm
        The ranks.
    """

    normalized: NormalizedPiece
    _piece: MeshPiece

    def __init__(self, piece: Any, interfaces: Any, comm: Any) -> None:
        self._distribution = taken_in(piece, comm, interfaces)
        self.mesh = self.hexahedra = self._piece = self._distribution.given
        self.comm, self.notes = comm, ()
        self.node_ids, self.cell_ids = self._piece.node_ids, self._piece.cell_ids
        self.normalized = NormalizedPiece(self._distribution)
        self._require_valid()

    def marked(self, mask: Mask) -> Mask:
        ids = self._piece.node_ids[mask]
        return self._rows(np.empty((len(ids), 0)), ids, self.normalized.mesh.node_ids, "")[1]

    def brought(self, rows: Field, nodes: Ints, to: Ints, problem: str = "") -> Field:
        ids, wanted = self._piece.node_ids[nodes], self.normalized.mesh.node_ids[to]
        return self._rows(rows, ids, wanted, problem)[0]

    def _rows(self, rows: Field, ids: Ints, wanted: Ints, problem: str) -> tuple[Field, Mask]:
        return rows_of_copies(self.comm, wanted, ids, rows, problem)

    def given_back(self, rows: NDArray[Any]) -> NDArray[Any]:
        return self._distribution.to_given_nodes(rows)

    def ids(self, cells: Mask) -> Ints:
        ids = self.normalized.space.distinct(self.normalized.mesh.cell_ids[cells])
        return np.empty(0, np.int64) if ids is None else ids

    def named(self, ids: Ints) -> str:
        return first_ids(ids)

    def wall_normals(self) -> Field:
        gathered, sums = GatheredFaces.of(self.normalized), None
        with agreed(self.comm, named=False):
            if gathered.layer is not None:
                sums = _wall_normals(gathered.layer)
        return gathered.cells.spread(sums, np.zeros((len(self.normalized.points), 3, 3)))


def _wall_normals(normalized: NormalizedMesh) -> Field:
    sums = planar_normal_sums(normalized.points, normalized.quads, normalized.node_labels)
    # Both sides of a slit lie in one plane, in which its front must not slide.
    return sums + line_normal_sums(normalized.points, kept_edges(normalized.points, normalized.quads, normalized.cells))


def moving_ids(moving: Any, mesh: HexMesh) -> Ints:
    """The moving nodes of a mesh in the order given, as :class:`hexconformal.MeshMotion` takes them.

    Raises
    ------
    OptionError
        If they are no nodes of the mesh, or one is named twice.
    """
    mask = as_mask(moving, len(mesh.points), "moving", mesh.named_nodes() if isinstance(moving, str) else None)
    if mask.ndim != 1:
        raise OptionError("moving must be whole nodes: ids, or one boolean per point")
    given = mask if isinstance(moving, str) else np.asarray([] if moving is None else moving)
    ids = np.flatnonzero(mask) if given.dtype == bool else given.astype(np.int64).ravel()
    if len(np.unique(ids)) < len(ids):
        raise OptionError("moving must name every node once")
    return ids
