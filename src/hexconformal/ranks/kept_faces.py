"""The faces of a mesh that is shared out which are kept: its boundary, those between regions; others' beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..mesh import Interfaces, boundary_quads, find_interfaces
from .halo import Halo
from .routes import Routes

__all__ = ["FacesBeside", "KeptFaces", "faces_beside", "kept_faces"]

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class KeptFaces:
    """Faces of own cells, each of which one rank has.

    Attributes
    ----------
    skin, owners
        (s, 4) those that no cell of any rank has beside them, and the own cell (s,) of each.
    between
        Those between regions; of two ranks with a cell at such a face the lower one has it.
    """

    skin: Ints
    owners: Ints
    between: Interfaces

    @property
    def quads(self) -> Ints:
        """(k, 4) all of them."""
        return np.concatenate([self.skin, self.between.quads])

    def at(self, places: Callable[[Ints], Ints]) -> KeptFaces:
        """The same with nodes by other numbers."""
        return replace(self, skin=places(self.skin), between=replace(self.between, quads=places(self.between.quads)))


@dataclass(frozen=True, eq=False)
class FacesBeside:
    """Kept faces of other ranks in some rings around a rank's own.

    Attributes
    ----------
    nodes
        (k, 4) numbers of their nodes.
    ranks, places
        (k,) rank that each belongs to, and its place among the faces of that rank.
    """

    nodes: Ints
    ranks: Ints
    places: Ints


def kept_faces(halo: Halo, cells: Ints, labels: Ints) -> KeptFaces:
    """The faces of own cells (m, 8) on the boundary of the whole mesh, and between regions (m,)."""
    quads, owners = boundary_quads(cells)
    nodes, own = np.sort(halo.numbers[quads], axis=1), labels[owners]
    # Whoever has a face here alone asks the owner of its lowest node whether others have it, and in which region.
    routes = Routes(halo.comm, halo.owners(nodes[:, 0]))
    come, regions = routes.forward(nodes), routes.forward(own)
    _, first, which, counts = np.unique(come, axis=0, return_index=True, return_inverse=True, return_counts=True)
    which = which.ravel()
    last = np.empty_like(first)
    last[which] = np.arange(len(which))
    has_it = (counts[which] == 2) & (np.arange(len(which)) == first[which])
    alone = routes.backward(counts[which]) == 1
    across = routes.backward(np.where(has_it, regions[last[which]], -1))
    shared, inside = (across >= 0) & (across != own), find_interfaces(cells, labels)
    one, other = np.concatenate([inside.sides, np.column_stack([own, across])[shared]]).T
    between = Interfaces.of(np.concatenate([inside.quads, quads[shared]]), one, other)
    return KeptFaces(quads[alone], owners[alone], between)


def faces_beside(halo: Halo, quads: Ints, rings: int) -> FacesBeside:
    """The faces of others in so many rings around own ones (f, 4); faces are in one ring that share a node."""
    comm, own = halo.comm, halo.numbers[quads]
    found = np.column_stack([own, np.full(len(own), comm.rank), np.arange(len(own))])
    # The owner of a node knows all faces at it.
    routes = Routes(comm, halo.owners(own.ravel()))
    nodes, faces = routes.forward(own.ravel()), routes.forward(np.repeat(found, 4, axis=0))
    order = np.argsort(nodes, kind="stable")
    nodes, faces = nodes[order], faces[order]
    for _ in range(rings):
        asked = np.unique(found[:, :4])
        to = Routes(comm, halo.owners(asked))
        wanted, by = to.forward(asked), to.forward(np.full(len(asked), comm.rank))
        first, last = (np.searchsorted(nodes, wanted, side=side) for side in ("left", "right"))
        counts = last - first
        which = np.repeat(first - np.cumsum(counts) + counts, counts) + np.arange(counts.sum())
        answers = Routes(comm, np.repeat(by, counts)).forward(faces[which])
        found = np.unique(np.concatenate([found, answers]), axis=0)
    found = found[found[:, 4] != comm.rank]
    return FacesBeside(found[:, :4], found[:, 4], found[:, 5])
