"""The boundary faces of a mesh that is shared out, and those of other ranks beside a rank's own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mesh import boundary_quads
from .halo import Halo
from .routes import Routes

__all__ = ["FacesBeside", "faces_beside", "skin_faces"]

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class FacesBeside:
    """Boundary faces of other ranks in some rings around a rank's own.

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


def skin_faces(halo: Halo, cells: Ints) -> tuple[Ints, Ints]:
    """Faces (k, 4) of own cells (m, 8) that no cell of any rank has beside them, and the cell (k,) of each."""
    quads, owners = boundary_quads(cells)
    nodes = np.sort(halo.numbers[quads], axis=1)
    # Whoever has a face here alone asks the owner of its lowest node whether others have it, too.
    routes = Routes(halo.comm, halo.owners(nodes[:, 0]))
    _, which, counts = np.unique(routes.forward(nodes), axis=0, return_inverse=True, return_counts=True)
    alone = routes.backward(counts[which.ravel()]) == 1
    return quads[alone], owners[alone]


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
