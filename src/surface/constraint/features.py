"""Feature curves and corners of a surface: sharp edges and boundaries, along which nodes slide, and where they stay.

A node is *smooth* (moves in its tangent plane), on a *curve* (moves along it) or a *corner* (stays).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexconformal.common import OptionError, first_ids
from hexconformal.geometry import EdgeTable, Faces, edge_table, unit_vectors
from hexconformal.mesh import connected_components

from ..mesh import Floats, Ints
from .creases import curve_ends, find_creases

__all__ = ["CORNER", "CURVE", "SMOOTH", "Features", "curve_tangents", "find_features", "held_projectors"]

SMOOTH, CURVE, CORNER = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Features:
    """Feature curves and corners of a surface, and its smooth patches.

    Attributes
    ----------
    kind
        (n,) SMOOTH, CURVE or CORNER.
    edges
        (e, 2) edges of all feature curves, boundaries included.
    curves
        (e,) the curve each belongs to; curves end at corners.
    patches
        (m,) smooth patch of each cell; patches end at curves.
    """

    kind: NDArray[np.int8]
    edges: Ints
    curves: Ints
    patches: Ints


def find_features(
    points: Floats,
    cells: Faces,
    angle: float | None = 50.0,
    edges: ArrayLike | None = None,
    fixed: NDArray[np.bool_] | None = None,
    boundary: str = "slide",
    turn: float = 40.0,
) -> Features:
    """Find the feature curves and corners.

    Parameters
    ----------
    points, cells
        The surface.
    angle
        Edges whose two cells meet at more than this (degrees between their normals) are sharp, unless they are noise
        (:func:`surface.constraint.creases.find_creases`); None: none are.
    edges
        (k, 2) sharp edges given besides.
    fixed
        (n,) nodes that stay.
    boundary
        "slide": nodes of open boundaries move along them, "fixed": they stay.
    turn
        A curve that turns by more than this (degrees) has a corner there.

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
    count = len(points)
    border = table.counts != 2
    sharp = border.copy()
    if angle is not None:
        sharp |= find_creases(points, cells, table, angle, turn)
    if edges is not None:
        sharp |= _given(table, edges, count)
    kind = np.full(count, SMOOTH, dtype=np.int8)
    feature = table.nodes[sharp]
    kind[feature] = CURVE
    kind[curve_ends(points, feature, turn)] = CORNER
    if boundary == "fixed":
        kind[table.nodes[border]] = CORNER
    if fixed is not None:
        kind[fixed] = CORNER
    return Features(kind, feature, _curves(feature, kind), _patches(table, sharp, len(cells)))


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


def _curves(edges: Ints, kind: NDArray[np.int8]) -> Ints:
    """(e,) curve of each edge: edges are joined at nodes that are no corners."""
    if len(edges) == 0:
        return np.empty(0, dtype=np.int64)
    owner = np.tile(np.arange(len(edges)), 2)
    node = edges.T.ravel()
    free = kind[node] == CURVE
    # A graph of the edges, and of the nodes behind them.
    return connected_components(np.stack([owner[free], len(edges) + node[free]]).T, len(edges) + len(kind))[
        : len(edges)
    ]


def _patches(table: EdgeTable, sharp: NDArray[np.bool_], count: int) -> Ints:
    """(m,) patch of each cell: cells are joined across edges that are not sharp."""
    return connected_components(table.sides[~sharp[table.manifold]], count)


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
