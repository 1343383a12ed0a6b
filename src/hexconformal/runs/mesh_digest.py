"""A digest of a mesh that is the same on any ranks, in whatever order these have nodes and cells."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh import HexMesh, MixedMesh, blocks_of
from .row_digests import row_digest

__all__ = ["mesh_digest"]


def mesh_digest(
    mesh: HexMesh | MixedMesh, comm: Any = None, at_nodes: NDArray[Any] | None = None
) -> NDArray[np.uint64]:
    """Digest of points and cells by their ids, and of more rows (n, ...) at the nodes.

    Parameters
    ----------
    mesh
        The mesh, or on ranks the :class:`hexconformal.ranks.MeshPiece` of each; all must call it then.
    comm
        The ranks.
    at_nodes
        What else counts; copies of a node have the same.
    """
    from ..ranks import cell_ids_of, each_once, mpi, node_ids_of  # not loaded by commands that need none

    names, cells = node_ids_of(mesh), cell_ids_of(mesh)
    # A node is on all ranks with cells at it, a cell on one.
    nodes = [(names, rows) for rows in (mesh.points, at_nodes) if rows is not None]
    own = [row_digest(*(one if comm is None else each_once(comm, *one))) for one in nodes]
    found = np.concatenate([*own, *(row_digest(cells[block.places], names[block.cells]) for block in blocks_of(mesh))])
    if comm is None:
        return found
    digest = np.empty_like(found)
    comm.Allreduce(found, digest, mpi().SUM)
    return digest
