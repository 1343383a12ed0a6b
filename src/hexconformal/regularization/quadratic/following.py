"""Middles of edges inside and along end faces follow those that a curved boundary has moved, as thin layers need."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import scipy
from numpy.typing import NDArray

from ...elements import BETWEEN
from ...geometry import unit_vectors

__all__ = ["followed"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

# Opposite edges of the faces of a cell, by their middles.
_MIDDLES = {frozenset(corners): 8 + number for number, corners in enumerate(BETWEEN[:12])}
_OPPOSITE = np.array(
    [
        [_MIDDLES[frozenset((face[k], face[k + 1]))], _MIDDLES[frozenset((face[k + 2], face[(k + 3) % 4]))]]
        for face in BETWEEN[12:18]
        for k in (0, 1)
    ]
)
_RANK = 1e-6  # of squared sines between normals, above which they are of different planes
_AFLOAT = 1e-9  # of weights: holds the edges that no chain of opposite ones leads from to the boundary


def followed(cells: Ints, points: Field, ways: Field, sides: Iterable[tuple[Ints, Field]]) -> Field:
    """Ways (n, 3) of the middles of all edges, given those of edges of the boundary along the normals of their faces.

    They minimize the sum over opposite edges of faces of |u_a - u_b|^2 / d^2, for middles at a distance d: in a stack
    of layers what is behind goes along, the thinner the layers the more closely. None moves along its own edge but as
    it is given; across that, and along their faces, middles of the boundary are as free as those inside.

    Parameters
    ----------
    cells
        (m, 20 or more) quadratic hexahedra.
    points
        (n, 3) with straight edges.
    ways
        (n, 3) of the middles of edges of the boundary.
    sides
        Middles (k,) of edges of the boundary, and the unit normals (k, 3) of faces that they are on.

    Examples
    --------
    Of three layers, the first a tenth of the last, the bottom is moved.

    >>> from hexconformal.mesh import middle_nodes, with_middles
    >>> from hexconformal.generate import box
    >>> points, cells = box((1, 1, 3))
    >>> points[:, 2] = np.interp(points[:, 2], [0.0, 1 / 3, 2 / 3, 1.0], [0.0, 0.1, 0.3, 1.3])
    >>> cells, corners = middle_nodes(cells, len(points), 20)
    >>> points = with_middles(points, corners)
    >>> ends = np.unique(cells[[0, 2]][:, [8, 9, 10, 11, 12, 13, 14, 15]])
    >>> ends = ends[np.isin(points[ends, 2], [0.0, 1.3])]
    >>> up = np.array([[0.0, 0.0, 1.0]])
    >>> ways = np.where(points[:, 2:] == 0.0, up, 0.0)
    >>> found = followed(cells, points, ways, [(ends, np.repeat(up, len(ends), axis=0))])
    >>> found[[cells[2, 8], cells[1, 8], cells[0, 8]], 2].round(3).tolist()
    [0.952, 0.99, 1.0]
    """
    edges, flat = np.unique(cells[:, 8:20], return_inverse=True)
    local = flat.reshape(-1, 12)
    links = np.unique(np.sort(local[:, _OPPOSITE - 8].reshape(-1, 2), axis=1), axis=0)
    weights = 1.0 / ((points[edges[links[:, 0]]] - points[edges[links[:, 1]]]) ** 2).sum(axis=1)
    count = len(edges)
    rows, columns = links.T
    graph = scipy.sparse.coo_array((weights, (rows, columns)), shape=(count, count))
    sums = np.bincount(links.ravel(), np.repeat(weights, 2), minlength=count)
    laplacian = scipy.sparse.kron(
        scipy.sparse.diags_array((1.0 + _AFLOAT) * sums) - graph - graph.T, scipy.sparse.eye_array(3), format="csr"
    )
    ends = np.array(BETWEEN[:12])
    along = np.zeros((count, 3))
    along[local] = unit_vectors(points[cells[:, ends[:, 1]]] - points[cells[:, ends[:, 0]]])
    held = along[:, :, None] * along[:, None, :]
    for nodes, normals in sides:
        np.add.at(held, np.searchsorted(edges, nodes), normals[:, :, None] * normals[:, None, :])
    values, axes = np.linalg.eigh(held)
    free = values <= _RANK
    given = np.einsum("eij,ej,ekj,ek->ei", axes, ~free, axes, ways[edges]).ravel()
    which, axis = np.nonzero(free)
    places = np.repeat(3 * which, 3) + np.tile(np.arange(3), len(which)), np.repeat(np.arange(len(which)), 3)
    basis = scipy.sparse.csr_array((axes[which, :, axis].ravel(), places), shape=(3 * count, len(which)))
    out = np.zeros_like(points)
    matrix = scipy.sparse.csc_array(basis.T @ laplacian @ basis)
    moved = scipy.sparse.linalg.spsolve(matrix, -(basis.T @ (laplacian @ given))) if len(which) else np.empty(0)
    out[edges] = (given + basis @ moved).reshape(-1, 3)
    return out
