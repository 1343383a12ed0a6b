"""Harmonic fields: what is known at some nodes goes on at the others as smoothly as can be."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ..elements import EDGES
from ..formulation import Formulation
from ..mesh import unique_edges

__all__ = ["extended", "harmonic"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]


def harmonic(formulation: Formulation, points: Field, region: Mask) -> Field:
    """The points, with the inner nodes of a region at the mean of their neighbours (a graph-harmonic map)."""
    from scipy.sparse import csgraph

    inner = region & formulation.inner
    if not inner.any():
        return points
    ends = unique_edges(formulation.cells[:, EDGES].reshape(-1, 2)).nodes
    ones = np.ones(len(ends))
    graph = scipy.sparse.coo_array((ones, (ends[:, 0], ends[:, 1])), shape=(len(points), len(points))).tocsr()
    return extended(csgraph.laplacian(scipy.sparse.csr_array(graph + graph.T)), points, inner)


def extended(laplacian: Any, field: Field, inner: Mask) -> Field:
    """The field (n, 3), with values at some nodes (n,) for which L times it is zero there, to a thousandth.

    Parameters
    ----------
    laplacian
        (n, n) sparse L, positive definite on these nodes.
    field
        (n, 3) values, from which the solution begins.
    inner
        (n,) nodes whose values are found; the others keep theirs.

    Examples
    --------
    Three nodes in a row, the last at 1:

    >>> laplacian = scipy.sparse.csr_array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    >>> field = np.array([[0.0, 0.0, 0.0], [9.0, 9.0, 9.0], [1.0, 1.0, 1.0]])
    >>> extended(laplacian, field, np.array([False, True, False]))[1].tolist()
    [0.5, 0.5, 0.5]
    """
    from scipy.sparse.linalg import cg

    rows = np.flatnonzero(inner)
    field = field.copy()
    if len(rows) == 0:
        return field
    laplacian = laplacian.tocsr()[rows]
    inside, outside = laplacian[:, rows], laplacian[:, np.flatnonzero(~inner)]
    load = -(outside @ field[~inner])
    jacobi = scipy.sparse.diags_array(1.0 / inside.diagonal())
    for k in range(3):
        field[rows, k] = cg(inside, load[:, k], x0=field[rows, k], rtol=1e-3, maxiter=300, M=jacobi)[0]
    return field
