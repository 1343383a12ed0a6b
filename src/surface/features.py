"""Sharp edges, corners and boundary curves of a surface: where nodes may not leave.

A node is *smooth* (moves in its tangent plane), on a *curve* (moves along it) or a *corner* (stays).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from hexconformal.errors import OptionError, first_ids

from .geometry import Cells, Floats, Ints, area_vectors, slivers, unit_vectors

__all__ = ["CORNER", "CURVE", "SMOOTH", "EdgeTable", "Features", "curve_tangents", "detect_features"]
__all__ += ["edge_table", "holding"]

SMOOTH, CURVE, CORNER = 0, 1, 2

_SMALLEST_GROUP = 12  # edges


@dataclass(frozen=True, eq=False)
class EdgeTable:
    """Every edge once.

    Attributes
    ----------
    nodes
        (e, 2) the lower id first.
    cells
        (e, 2) the cell that runs from the lower to the higher id and the one that runs back; -1 where there is none.
    uses
        (e,) number of cells that share it: 1 on a boundary, 2 inside, more where the surface is no manifold.
    """

    nodes: Ints
    cells: Ints
    uses: Ints


def edge_table(cells: Cells) -> EdgeTable:
    """Edges of a surface, with the cells beside them."""
    tails, heads, owners, start = [], [], [], 0
    for table in (cells.triangles, cells.quads):
        tails.append(table.ravel())
        heads.append(np.roll(table, -1, axis=1).ravel())
        owners.append(start + np.repeat(np.arange(len(table)), table.shape[1]))
        start += len(table)
    tail, head, owner = (np.concatenate(parts) for parts in (tails, heads, owners))
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    key = low * (int(high.max(initial=0)) + 1) + high
    _, first, inverse, uses = np.unique(key, return_index=True, return_inverse=True, return_counts=True)
    sides = np.full((len(first), 2), -1)
    forward = tail < head
    sides[inverse[forward], 0] = owner[forward]
    sides[inverse[~forward], 1] = owner[~forward]
    return EdgeTable(np.stack([low[first], high[first]], axis=1), sides, uses)


@dataclass(frozen=True, eq=False)
class Features:
    """What holds the nodes.

    Attributes
    ----------
    kind
        (n,) SMOOTH, CURVE or CORNER.
    edges
        (e, 2) edges of all feature curves, boundaries included.
    chains
        (e,) the curve each belongs to; curves end at corners.
    patches
        (m,) smooth part of the surface each cell belongs to; parts end at curves.
    """

    kind: NDArray[np.int8]
    edges: Ints
    chains: Ints
    patches: Ints


def detect_features(
    points: Floats,
    cells: Cells,
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
        Edges whose two cells meet at more than this (degrees between their normals) are sharp; None: none are.
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
    >>> grid = Cells(np.empty((0, 3), np.int64), np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]]))
    >>> detect_features(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), grid).kind
    array([2, 1, 2, 1, 0, 1, 2, 1, 2], dtype=int8)
    """
    table = edge_table(cells)
    count = len(points)
    rim = table.uses != 2
    sharp = rim.copy()
    if angle is not None:
        creased = _creased(points, cells, table, angle)
        sharp |= _without_whiskers(table.nodes, creased | rim, count) & creased
    if edges is not None:
        sharp |= _given(table, edges, count)
    kind = np.full(count, SMOOTH, dtype=np.int8)
    feature = table.nodes[sharp]
    kind[feature] = CURVE
    kind[_corners(points, feature, count, turn)] = CORNER
    if boundary == "fixed":
        kind[table.nodes[rim]] = CORNER
    if fixed is not None:
        kind[fixed] = CORNER
    return Features(kind, feature, _chains(feature, kind), _patches(table, sharp, len(cells)))


def _creased(points: Floats, cells: Cells, table: EdgeTable, angle: float) -> NDArray[np.bool_]:
    """Edges whose two sides meet at more than the angle."""
    vectors = area_vectors(points, cells)
    inside = (table.uses == 2) & (table.cells >= 0).all(axis=1)
    a, b = table.cells[inside].T
    around = np.zeros_like(vectors)
    np.add.at(around, a, vectors[b])
    np.add.at(around, b, vectors[a])
    # The normal of a sliver is noise: it takes that of its neighbours.
    sliver = np.concatenate([slivers(points, table) for table in (cells.triangles, cells.quads)])
    normals = unit_vectors(np.where(sliver[:, None], around, vectors))
    cosine = np.ones(len(table.nodes))
    cosine[inside] = (normals[a] * normals[b]).sum(axis=1)
    return np.asarray(cosine < np.cos(np.radians(angle)))


def _without_whiskers(edges: Ints, sharp: NDArray[np.bool_], count: int, rounds: int = 3) -> NDArray[np.bool_]:
    """Take away sharp edges that lead nowhere, and small groups: a crease is long, or joins others; noise is not."""
    kept = sharp.copy()
    for _ in range(rounds):
        degree = np.bincount(edges[kept].ravel(), minlength=count)
        loose = kept & (degree[edges] == 1).any(axis=1)
        if not loose.any():
            break
        kept &= ~loose
    a, b = edges[kept].T
    links = sparse.coo_matrix((np.ones(len(a)), (a, b)), shape=(count, count))
    group = connected_components(links, directed=False)[1][a]
    kept[np.flatnonzero(kept)[np.bincount(group)[group] < _SMALLEST_GROUP]] = False
    return kept


def _given(table: EdgeTable, edges: ArrayLike, count: int) -> NDArray[np.bool_]:
    asked = np.asarray(edges)
    if asked.ndim != 2 or asked.shape[1] != 2 or asked.dtype.kind not in "iu":
        raise OptionError(f"feature edges must be an integer array (k, 2), not {asked.dtype} {asked.shape}")
    asked = np.sort(asked.astype(np.int64), axis=1)
    keys, wanted = table.nodes @ [count, 1], asked @ [count, 1]
    bad = np.flatnonzero(~np.isin(wanted, keys))
    if len(bad):
        raise OptionError(f"feature edges that are no edges of the surface: {first_ids(bad)}")
    return np.isin(keys, wanted)


def _corners(points: Floats, edges: Ints, count: int, turn: float) -> NDArray[np.bool_]:
    """Nodes where a curve ends, branches, or turns sharply."""
    degree = np.bincount(edges.ravel(), minlength=count)
    result = (degree > 0) & (degree != 2)
    outward = np.zeros((count, 3))
    direction = unit_vectors(points[edges[:, 1]] - points[edges[:, 0]])
    np.add.at(outward, edges[:, 0], direction)
    np.add.at(outward, edges[:, 1], -direction)
    # Two unit vectors at the angle pi - t have a sum of length 2 sin(t / 2).
    sharp = np.linalg.norm(outward, axis=1) > 2 * np.sin(np.radians(turn) / 2)
    return np.asarray(result | ((degree == 2) & sharp))


def _chains(edges: Ints, kind: NDArray[np.int8]) -> Ints:
    """(e,) label of the curve of each edge: edges are joined at nodes that are no corners."""
    if len(edges) == 0:
        return np.empty(0, dtype=np.int64)
    owner = np.tile(np.arange(len(edges)), 2)
    node = edges.T.ravel()
    free = kind[node] == CURVE
    size = len(edges) + len(kind)
    links = sparse.coo_matrix((np.ones(free.sum()), (owner[free], len(edges) + node[free])), shape=(size, size))
    return np.asarray(connected_components(links, directed=False)[1][: len(edges)], dtype=np.int64)


def _patches(table: EdgeTable, sharp: NDArray[np.bool_], count: int) -> Ints:
    """(m,) label of the part of the surface each cell lies in: cells are joined across edges that are not sharp."""
    inside = ~sharp & (table.cells >= 0).all(axis=1)
    a, b = table.cells[inside].T
    links = sparse.coo_matrix((np.ones(len(a)), (a, b)), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def holding(vectors: Floats, points: Floats, features: Features) -> Floats:
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
    # Squares of directions do not care which way an edge runs: the tangent is the main axis of their sum.
    d = unit_vectors(points[edges[:, 1]] - points[edges[:, 0]])
    first = np.zeros((len(points), 3))
    first[edges.ravel()] = np.repeat(d, 2, axis=0)
    result = np.zeros((len(points), 3))
    for end in (0, 1):
        node = edges[:, end]
        alike = np.where((d * first[node]).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
        np.add.at(result, node, alike * d)
    return unit_vectors(result) * (features.kind == CURVE)[:, None]
