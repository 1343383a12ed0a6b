"""Sheets and wires inside a mesh, which may meet in threes and more: their sides, their curves, and those of all."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...mesh import connected_components, turned_over
from ..edges import EdgeTable, edge_table
from ..faces import Faces
from .chains import chains
from .feature_curves import CORNER, CURVE, SMOOTH, Features, find_features, nonmanifold_nodes
from .schedules import FeatureSchedule

__all__ = ["InnerSheets", "find_inner_sheets", "joined_features", "wire_features", "with_one_side_out"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class InnerSheets:
    """Faces inside a mesh, cut into sheets where more than two meet, they end, or they become others.

    Attributes
    ----------
    quads
        (k, 4) nodes; those of one sheet have the same side out, if it has two.
    sheets
        (k,) sheet of each, numbers from 0 on.
    features
        Curves, corners and smooth patches; curves where sheets meet are there even if others are soft.
    """

    quads: Ints
    sheets: Ints
    features: Features


def find_inner_sheets(
    points: Floats,
    quads: Ints,
    kinds: Ints,
    *,
    mode: str = "auto",
    tolerance: float = 0.0,
    schedule: FeatureSchedule | None = None,
) -> InnerSheets:
    """Find the sheets that faces inside a mesh make up, and their features.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    quads
        (k, 4) nodes, either side out.
    kinds
        (k,) what they are; between faces of two kinds is a curve.
    mode, tolerance, schedule
        See :func:`find_features`.

    Examples
    --------
    A cross of two planes: four sheets that meet along a line.

    >>> points = np.array([[x, y, z] for x, y in ((0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)) for z in (0, 1)], float)
    >>> wings = np.array([[0, 1, k + 1, k] for k in (2, 4, 6, 8)])
    >>> inner = find_inner_sheets(points, wings, np.zeros(4, int))
    >>> inner.sheets, len(inner.features.corners)
    (array([0, 1, 2, 3]), 10)
    """
    schedule = FeatureSchedule() if schedule is None else schedule
    edges = edge_table(quads)
    quads = with_one_side_out(quads, edges)
    faces, edges = Faces.of(quads), edge_table(quads)
    same = kinds[edges.sides[:, 0]] == kinds[edges.sides[:, 1]]
    sheets = connected_components(edges.sides[same], len(quads))
    features = find_features(points, faces, tags=kinds, mode=mode, tolerance=tolerance, schedule=schedule)
    if features.soft:
        # What is between sheets stays, as near as the sheets do; within them nothing is sharp.
        ends = np.union1d(edges.nonmanifold, edges.manifold[~same])
        stops = nonmanifold_nodes(faces, edges, len(points))
        along = Features.along(points, faces, edges, ends, stops, schedule.turn)
        features = replace(along, reason=features.reason, slack_curves=np.unique(along.curves))
    return InnerSheets(quads, sheets, features)


def with_one_side_out(quads: Ints, edges: EdgeTable | None = None) -> Ints:
    """Faces (k, 3) or (k, 4), turned over where they have another side out than those beside."""
    edges = edge_table(quads) if edges is None else edges
    # Each quad is there twice, once with either side out; those that go together are connected.
    count, (one, other) = len(quads), edges.sides.T
    twin = np.where(edges.opposed, 0, count)
    pairs = np.concatenate([[one, other + twin], [one + count, other + count - twin]], axis=1)
    side = connected_components(pairs.T, 2 * count)
    turned = side[:count] > side[count:]
    return np.where(turned[:, None], turned_over(quads), quads)


def wire_features(points: Floats, edges: Ints, kinds: Ints, schedule: FeatureSchedule | None = None) -> Features:
    """Curves of edges that need belong to no face: bars, rebars, lines of the geometry.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    edges
        (e, 2) nodes.
    kinds
        (e,) what they are; where kinds meet is a corner.
    schedule
        The turn that makes a corner.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0]])
    >>> wires = wire_features(points, np.array([[0, 1], [1, 2], [2, 3], [3, 4]]), np.zeros(4, int))
    >>> wires.corners, wires.curves
    (array([0, 2, 4]), array([0, 0, 1, 1]))
    """
    schedule = FeatureSchedule() if schedule is None else schedule
    first, last = np.full(len(points), np.iinfo(np.int64).max), np.full(len(points), -1)
    for end in edges.T:
        np.minimum.at(first, end, kinds)
        np.maximum.at(last, end, kinds)
    curves = chains(points, edges, (last >= 0) & (first != last), schedule.turn)
    kind = np.full(len(points), SMOOTH, dtype=np.int8)
    kind[edges] = CURVE
    kind[(last >= 0) & (curves.corners | (first != last))] = CORNER
    return Features(kind, edges, curves.labels, np.empty(0, np.int64))


def joined_features(points: Floats, *parts: Features) -> Features:
    """The features of a skin, of sheets inside, and of wires: nodes where curves of different ones cross are corners.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    *parts
        Those of each; their patches come in the same order. Curves of soft ones are none.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh import boundary_quads
    >>> points, cells = box((2, 2, 2))
    >>> skin = find_features(points, boundary_quads(cells)[0])
    >>> half = find_inner_sheets(points, cells[:4, 4:], np.zeros(4, int)).features
    >>> both = joined_features(points, skin, half)
    >>> len(skin.corners), len(half.corners), len(both.corners), both.patches.max() + 1
    (8, 4, 12, np.int64(7))
    """
    none = np.zeros(len(points), dtype=np.int8)
    gone = (replace(part, kind=none, edges=part.edges[:0], curves=part.curves[:0]) for part in parts)
    parts = tuple(one if part.soft else part for one, part in zip(gone, parts, strict=True))
    edges = np.concatenate([part.edges for part in parts])
    kind = np.maximum.reduce([part.kind for part in parts])
    degree = np.bincount(np.unique(np.sort(edges, axis=1), axis=0).ravel(), minlength=len(points))
    kind[(kind == CURVE) & (degree != 2)] = CORNER
    curves, slack, patches = ([np.empty(0, np.int64)] for _ in range(3))
    for part in parts:
        known = 1 + max(int(found.max(initial=-1)) for found in curves)
        curves.append(part.curves + known)
        slack.append(part.slack_curves + known)
        patches.append(part.patches + 1 + max(int(found.max(initial=-1)) for found in patches))
    joined = (np.concatenate(numbers) for numbers in (curves, patches, slack))
    return Features(kind, edges, next(joined), next(joined), slack_curves=next(joined))
