"""Groups of nodes that move together, of pairs of them: chains of pairs are one group."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ..mesh import NormalizedMesh, connected_components, find_couplings
from .coupled_nodes import UNCOUPLED, CoupledNodes

__all__ = ["coupled_groups", "coupled_nodes"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_TURNED = 1e-4  # of a matrix, from which on a rotation is one


def coupled_nodes(
    normalized: NormalizedMesh, couplings: Any, among: Mask | None = None
) -> tuple[CoupledNodes, tuple[str, ...]]:
    """The groups of nodes that move together, in the order of a normalized mesh, and notes on them.

    Parameters
    ----------
    normalized
        The mesh.
    couplings, among
        As of :func:`hexconformal.mesh.find_couplings`, in ids of the mesh that was normalized.

    Raises
    ------
    OptionError
        If pairs that are given make no sense.
    """
    found = find_couplings(normalized.mesh, couplings, among)
    return coupled_groups(np.argsort(normalized.node_ids)[found.pairs], found.rotations), found.notes


def coupled_groups(pairs: Ints, rotations: Field) -> CoupledNodes:
    """The groups of pairs of nodes whose displacements are d_first = R d_second.

    The rotation of every node is composed along the way from the root of its group. Where another way leads to another
    rotation, C instead of R, displacements must have (C^T R - 1) d = 0.

    Parameters
    ----------
    pairs
        (k, 2) ids of nodes.
    rotations
        (k, 3, 3) orthogonal matrices R.

    Examples
    --------
    >>> quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    >>> groups = coupled_groups(np.array([[4, 2], [7, 4], [5, 5]]), np.array([quarter, quarter, quarter]))
    >>> groups.nodes, groups.starts
    (array([2, 4, 7, 5]), array([0, 3]))
    >>> groups.rotations[2] @ [1.0, 0.0, 0.0]  # a half turn
    array([-1.,  0.,  0.])
    >>> groups.normals[3]  # on the axis a node may move along it
    array([[2., 0., 0.],
           [0., 2., 0.],
           [0., 0., 0.]])
    """
    if len(pairs) == 0:
        return UNCOUPLED
    nodes, places = np.unique(pairs, return_inverse=True)
    ends, count = places.reshape(-1, 2), len(nodes)
    labels = connected_components(ends, count)
    order = np.argsort(labels, kind="stable")
    starts = np.flatnonzero(np.diff(labels[order], prepend=-1))
    composed = _composed(ends, rotations, order[starts][labels])
    first, second = ends.T
    turned = np.einsum("kji,kjl,klm->kim", composed[first], rotations, composed[second]) - np.eye(3)
    turned[np.abs(turned).max(axis=(1, 2)) < _TURNED] = 0.0
    # In the frame of the root; that of the first node is what it has been composed to.
    own = composed[first] @ np.einsum("kji,kjl->kil", turned, turned) @ composed[first].transpose(0, 2, 1)
    normals = np.zeros((count, 3, 3))
    np.add.at(normals, first, own)
    return CoupledNodes(nodes[order], starts, composed[order], normals[order])


def _composed(ends: Ints, rotations: Field, roots: Ints) -> Field:
    """(n, 3, 3) rotation of every node from its root, along the shortest way over the pairs."""
    from scipy.sparse import csgraph

    count = len(roots)
    both = np.concatenate([ends, ends[:, ::-1]])
    maps = np.concatenate([rotations, rotations.transpose(0, 2, 1)])
    keys, kept = np.unique(both @ np.array([count + 1, 1]), return_index=True)
    # One more vertex is joined to all roots: a single search finds the way from each.
    joined = np.column_stack([np.full(count, count), roots])
    rows, columns = np.concatenate([both, joined]).T
    graph = scipy.sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(count + 1, count + 1))
    before = csgraph.breadth_first_order(graph, count, directed=False)[1].astype(np.int64)[:count]
    is_root = roots == np.arange(count)
    before[is_root] = np.flatnonzero(is_root)
    composed = np.tile(np.eye(3), (count, 1, 1))
    ways = np.flatnonzero(~is_root)
    composed[ways] = maps[kept[np.searchsorted(keys, ways * (count + 1) + before[ways])]]
    # Ways of twice the length every time.
    while (before != before[before]).any():
        composed = composed @ composed[before]
        before = before[before]
    return composed
