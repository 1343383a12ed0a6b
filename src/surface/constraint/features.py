"""Feature curves and corners of a surface: sharp edges and boundaries, along which nodes slide, and where they stay.

A node is *smooth* (moves in its tangent plane), on a *curve* (moves along it) or a *corner* (stays).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexconformal.common import OptionError, first_ids
from hexconformal.geometry import (
    CORNER,
    CURVE,
    EdgeTable,
    Faces,
    Features,
    edge_table,
    find_creases,
    nonmanifold_nodes,
    unit_vectors,
)

from ..mesh import Floats, Ints

__all__ = ["curve_tangents", "find_features", "held_projectors"]


def find_features(
    points: Floats,
    cells: Faces,
    angle: float | None = 50.0,
    edges: ArrayLike | None = None,
    fixed: NDArray[np.bool_] | None = None,
    boundary: str = "slide",
    interfaces: Ints | None = None,
) -> Features:
    """Find the feature curves and corners.

    Parameters
    ----------
    points, cells
        The surface.
    angle
        Edges whose two cells meet at more than this (degrees between their normals) are sharp, unless they are noise
        (:func:`hexconformal.geometry.find_creases`); None: none are.
    edges
        (k, 2) sharp edges given besides.
    fixed
        (n,) nodes that stay.
    boundary
        "slide": nodes of open boundaries move along them, "fixed": they stay.
    interfaces
        (k, 2) edges between regions, which are feature edges, too.

    Raises
    ------
    OptionError
        If a given edge is no edge of the surface.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(3.0), np.arange(3.0))
    >>> grid = Faces(np.empty((0, 3), np.int64), np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]]))
    >>> find_features(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), grid).kind
    array([2, 1, 2, 1, 0, 1, 2, 1, 2], dtype=int8)
    """
    table = edge_table(cells)
    sharp = table.counts != 2
    stops = nonmanifold_nodes(cells, table, len(points))
    if boundary == "fixed":
        stops[table.nodes[sharp]] = True
    if fixed is not None:
        stops |= fixed
    if angle is not None:
        sharp |= find_creases(points, cells, table, angle)
    for given in (edges, interfaces):
        if given is not None:
            sharp |= _given(table, given, len(points))
    return Features.along(points, cells, table, np.flatnonzero(sharp), stops)


def _given(table: EdgeTable, edges: ArrayLike, count: int) -> NDArray[np.bool_]:
    """(e,) edges of a table that a user gives as features."""
    given = np.asarray(edges)
    if given.ndim != 2 or given.shape[1] != 2 or given.dtype.kind not in "iu":
        raise OptionError(f"feature edges must be an integer array (k, 2), not {given.dtype} {given.shape}")
    keys, wanted = table.nodes @ [count, 1], np.sort(given.astype(np.int64), axis=1) @ [count, 1]
    bad = np.flatnonzero(~np.isin(wanted, keys))
    if len(bad):
        raise OptionError(f"feature edges must be edges of the surface, these are not: {first_ids(bad)}")
    return np.isin(keys, wanted)


def held_projectors(vectors: Floats, points: Floats, features: Features) -> Floats:
    """(n, 3, 3) orthogonal projector onto the directions each node may not move in, from (n, 3) nodal area vectors.

    A smooth node is held along its normal (one multiplier), one on a curve across its tangent (two), a corner
    altogether (three).
    """
    n = unit_vectors(vectors)
    result = n[:, :, None] * n[:, None, :]
    result[features.kind == CORNER] = np.eye(3)
    on_curve = features.kind == CURVE
    if on_curve.any():
        t = curve_tangents(points, features)[on_curve]
        result[on_curve] = np.eye(3) - t[:, :, None] * t[:, None, :]
    return result


def curve_tangents(points: Floats, features: Features) -> Floats:
    """(n, 3) unit tangent at nodes that lie inside a curve, zero elsewhere."""
    edges = features.edges
    # Edges run either way along a curve: their directions are turned to agree before they are added.
    d = unit_vectors(points[edges[:, 1]] - points[edges[:, 0]])
    first = np.zeros((len(points), 3))
    first[edges.ravel()] = np.repeat(d, 2, axis=0)
    result = np.zeros((len(points), 3))
    for end in (0, 1):
        node = edges[:, end]
        alike = np.where((d * first[node]).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
        np.add.at(result, node, alike * d)
    return unit_vectors(result) * (features.kind == CURVE)[:, None]
