"""The distribution of a mesh: which rank owns which nodes and cells, and how arrays come there and back.

Nodes are numbered along Morton's curve, and every rank owns a range of numbers. A cell belongs to the owner of its
lowest node; it is on that rank alone, and what it adds to the nodes of others is sent to these. No rank ever has more
than its share, but for copies of the nodes around it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, OptionError, agreed, first_ids
from ..mesh import Regions, curve_positions, find_regions
from ..quality import cell_errors
from .halo import Halo
from .kept_faces import FacesBeside, KeptFaces, faces_beside, kept_faces
from .mesh_piece import MeshPiece
from .mpi import mpi, petsc, without_petsc
from .rank_space import RankSpace
from .routes import Routes, homes_of

__all__ = ["Distribution", "distributed", "taken_in", "with_all_arrays"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Data = dict[str, NDArray[Any]]

_SAMPLES = 256  # of the nodes, for each rank, by which their numbers are made even


@dataclass(frozen=True, eq=False)
class Distribution:
    """A mesh as it is shared out for work.

    Attributes
    ----------
    given
        What this rank has handed in, with the arrays that others have where it has nothing.
    piece
        The own cells, and the nodes here [own | ghosts].
    space
        The space of fields on these nodes.
    faces
        Faces of own cells on the boundary of the whole mesh, and between its regions.
    beside
        Faces of other ranks around these, whose nodes are here, too.
    regions
        The regions of the whole mesh, with the labels of own cells; None where it has none.
    referenced
        (n,) nodes that belong to a cell of any rank.
    """

    given: MeshPiece
    piece: MeshPiece
    space: RankSpace
    faces: KeptFaces
    beside: FacesBeside
    regions: Regions | None
    referenced: NDArray[np.bool_]
    _homes: Routes
    _copies: Ints
    _owners: Routes
    _order: Ints

    def to_given_nodes(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Rows (n, ...), one for each node here, on the ranks and in the order in which the nodes were handed in."""
        sorted_back = np.empty_like(self.space.own(rows))
        sorted_back[self._order] = self.space.own(rows)
        return self._homes.backward(self._owners.backward(sorted_back)[self._copies])


def taken_in(piece: Any, comm: Any, interfaces: Any, rings: int = 0) -> Distribution:
    """Check the piece of every rank, and share out the mesh; all must call it.

    Parameters
    ----------
    piece
        The :class:`hexconformal.ranks.MeshPiece` of this rank.
    comm
        The ranks.
    interfaces, rings
        See :func:`hexconformal.ranks.distributed`.

    Raises
    ------
    MeshError
        If there are errors in the mesh, or there are no cells.
    OptionError
        If something else than a piece is handed in, `interfaces` makes no sense, or PETSc is not there.
    """
    beginning = without_petsc(comm)
    with agreed(comm):
        petsc(beginning)
        _require_sound(MeshPiece.of(piece))
        if not isinstance(interfaces, str):
            find_regions(piece, interfaces)
    found = distributed(piece, comm, rings, interfaces)
    with agreed(comm):
        _require_sound(found.piece)
    return found


def distributed(piece: MeshPiece, comm: Any, rings: int = 0, interfaces: Any = "ignore") -> Distribution:
    """Share out a mesh that all ranks hand in, each its piece; all must call it.

    Each has copies of the nodes of so many rings of kept faces around its own, too. Which faces are kept inside is told
    as :func:`hexconformal.mesh.find_regions` takes it, numbers by every rank for its cells.

    Raises
    ------
    MeshError
        If there are no cells, pieces do not fit together, or their arrays are not the same.
    OptionError
        If `interfaces` makes no sense.
    """
    if comm.allreduce(len(piece.cells)) == 0:
        raise MeshError("there are no hexahedra on any rank")
    piece = with_all_arrays(piece, comm)
    _require_single_cells(comm, piece)
    regions = _regions(piece, interfaces, comm)
    labels = np.zeros(len(piece.cells), np.int64) if regions is None else regions.labels
    # Each id has a home, where the copies of its node meet.
    homes = Routes(comm, homes_of(comm, piece.node_ids))
    ids, places = homes.forward(piece.node_ids), homes.forward(piece.points)
    ids, first, copies = np.unique(ids, return_index=True, return_inverse=True)
    copies = copies.ravel()
    with agreed(comm):
        apart = (places != places[first][copies]).any(axis=1)
        if apart.any():
            nodes = np.unique(ids[copies[apart]])
            raise MeshError(f"copies of a node must be at one place; those at several: {first_ids(nodes)}")
    points = places[first]
    # From home to the owner, in the order of the curve.
    keys, heights = _along_curve(comm, points)
    owners = Routes(comm, np.searchsorted(_cuts(comm, keys), keys, side="right"))
    here = [owners.forward(values) for values in (ids, points, keys, heights)]
    order = np.lexsort((here[0], *here[1].T, here[3], here[2]))
    ranges = np.concatenate([[0], np.cumsum(comm.allgather(len(order)))]).astype(np.int64)
    numbers = np.empty(len(order), dtype=np.int64)
    numbers[order] = ranges[comm.rank] + np.arange(len(order))
    of_given = homes.backward(owners.backward(numbers)[copies])
    # Cells to the owners of their lowest nodes.
    cells = of_given[piece.cells].reshape(-1, 8)
    to = Routes(comm, np.searchsorted(ranges, cells.min(axis=1, initial=ranges[-1]), side="right") - 1)
    sums = to.forward(homes.backward(heights[copies])[piece.cells].reshape(-1, 8).sum(axis=1))
    cells, cell_ids, labels = to.forward(cells), to.forward(piece.cell_ids), to.forward(labels)
    # As mesh.spatial_order has them: what is closest to a place that is as close to several depends on it.
    in_order = np.lexsort((cell_ids, *cells.T, sums, cells.min(axis=1, initial=ranges[-1])))
    cells, cell_ids, labels = cells[in_order], cell_ids[in_order], labels[in_order]
    outside = (cells < ranges[comm.rank]) | (cells >= ranges[comm.rank + 1])
    halo = Halo(comm, ranges, np.unique(cells[outside]))
    faces = kept_faces(halo, halo.local(cells), labels)
    beside, faces = faces_beside(halo, faces.quads, rings), faces.at(lambda nodes: halo.numbers[nodes])
    around = beside.nodes[(beside.nodes < ranges[comm.rank]) | (beside.nodes >= ranges[comm.rank + 1])]
    halo = Halo(comm, ranges, np.union1d(halo.ghosts, around))
    space = RankSpace(halo)

    def at_nodes(rows: NDArray[Any]) -> NDArray[Any]:
        out = np.zeros((halo.count, *rows.shape[1:]), rows.dtype)
        out[: halo.owned] = owners.forward(homes.forward(rows)[first])[order]
        return halo.update(out)

    mine = MeshPiece(
        at_nodes(piece.points),
        halo.local(cells),
        {name: at_nodes(rows) for name, rows in piece.point_data.items()},
        {name: to.forward(rows)[in_order] for name, rows in piece.cell_data.items()},
        node_ids=at_nodes(piece.node_ids),
        cell_ids=cell_ids,
    )
    used = np.zeros(halo.count, dtype=bool)
    used[mine.cells] = True
    faces, referenced = faces.at(halo.local), space.joined(used)
    regions = None if regions is None else replace(regions, labels=labels)
    return Distribution(piece, mine, space, faces, beside, regions, referenced, homes, copies, owners, order)


def _regions(piece: MeshPiece, interfaces: Any, comm: Any) -> Regions | None:
    """The regions of the whole mesh, with the labels of the cells of this piece."""
    found, problem = None, None
    try:
        found = find_regions(piece, interfaces, space=RankSpace.of_cells(comm))
    except OptionError as raised:  # by all ranks at the same place
        problem = raised
    with agreed(comm):
        if problem is not None:
            raise problem
    return found


def _along_curve(comm: Any, points: Field) -> tuple[Ints, Field]:
    """Positions (n,) of points along the curve through the box around the points of all ranks, and their heights."""
    low, high = np.empty(3), np.empty(3)
    comm.Allreduce(points.min(axis=0, initial=np.inf), low, mpi().MIN)
    comm.Allreduce(points.max(axis=0, initial=-np.inf), high, mpi().MAX)
    return curve_positions(points - low, float((high - low).max()))


def _cuts(comm: Any, keys: Ints) -> Ints:
    """Positions (p - 1,) along the curve at which it is cut, so that all ranks own about as many nodes."""
    stride = max(int(comm.allreduce(len(keys))) // (_SAMPLES * comm.size), 1)
    sample = np.sort(np.concatenate(comm.allgather(np.sort(keys)[stride // 2 :: stride])))
    if len(sample) == 0:
        return np.zeros(comm.size - 1, dtype=np.int64)
    return sample[len(sample) * np.arange(1, comm.size) // comm.size]


def with_all_arrays(piece: MeshPiece, comm: Any) -> MeshPiece:
    """The piece with the arrays that others have where it has nothing; all must call it.

    Raises
    ------
    MeshError
        If arrays are not the same on all ranks, or not of numbers.
    """
    point_data = _all_arrays(comm, piece.point_data, len(piece.points), "point_data")
    return replace(
        piece, point_data=point_data, cell_data=_all_arrays(comm, piece.cell_data, len(piece.cells), "cell_data")
    )


def _all_arrays(comm: Any, data: Mapping[str, NDArray[Any]], count: int, name: str) -> Data:
    """The arrays of a piece, with those that others have where this one is empty."""
    kinds = {key: (array.dtype.str, array.shape[1:]) for key, array in data.items()}
    known = [kinds for kinds, rows in comm.allgather((kinds, count)) if rows]
    first = known[0] if known else {}
    with agreed(comm):
        if count and kinds != first:
            differ = sorted({key for key in {*kinds, *first} if kinds.get(key) != first.get(key)})
            raise MeshError(f"{name} must be of the same names, types and shapes on all ranks: {', '.join(differ)}")
        text = sorted(key for key, (dtype, _) in first.items() if np.dtype(dtype).kind not in "biuf")
        if text:
            raise MeshError(f"{name} must be numbers on ranks: leave out {', '.join(text)}")
    if count:
        return {key: data[key] for key in first}
    return {key: np.empty((0, *shape), dtype) for key, (dtype, shape) in first.items()}


def _require_single_cells(comm: Any, piece: MeshPiece) -> None:
    ids = Routes(comm, homes_of(comm, piece.cell_ids)).forward(piece.cell_ids)
    with agreed(comm):
        names, counts = np.unique(ids, return_counts=True)
        if len(names) < len(ids):
            raise MeshError(f"cells must be on one rank each; on several: {first_ids(names[counts > 1])}")


def _require_sound(piece: MeshPiece) -> None:
    errors = cell_errors(piece)
    if errors:
        raise MeshError("; ".join(errors))
