"""The feature curves of a surface in pieces, each from one of its nodes to another one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..closest_point import SurfaceLocator
from ..edges import edge_table
from ..faces import Faces
from ..features import Features

__all__ = ["Piece", "curve_pieces"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Piece:
    """Part of a feature curve.

    Attributes
    ----------
    curve
        The curve it belongs to.
    nodes
        (k,) its nodes in their order; the ends are different ones.
    sectors
        Quarters of a turn that the solid takes up around it: 1 at a right edge, 3 at a right notch.
    tags
        Those of the faces on both sides, the lower one first, where they differ; None else.
    """

    curve: int
    nodes: Ints
    sectors: float
    tags: tuple[int, int] | None = None

    @property
    def ends(self) -> tuple[int, int]:
        """The first node and the last."""
        return int(self.nodes[0]), int(self.nodes[-1])


def curve_pieces(
    surface: SurfaceLocator, features: Features, direct: float = 0.7, tags: Ints | None = None
) -> list[Piece]:
    """Cut the feature curves of a surface into pieces that lead from one end to another without much of a detour.

    Parameters
    ----------
    surface
        Triangles with the outside on the same side.
    features
        Its curves and corners.
    direct
        Distance of the ends of a piece over its length, at least: the shortest way between them is along it.
    tags
        (f,) of the faces.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.geometry import find_features
    >>> from hexconformal.mesh import boundary_quads
    >>> points, cells = box((2, 2, 2))
    >>> surface = SurfaceLocator(points, boundary_quads(cells)[0])
    >>> pieces = curve_pieces(surface, find_features(points, surface.faces))
    >>> len(pieces), pieces[0].nodes.tolist(), round(pieces[0].sectors, 9)
    (12, [0, 1, 2], 1.0)
    """
    sectors, beside = _sectors(surface, features), _tags_beside(surface, features, tags)
    order = np.argsort(features.curves, kind="stable")
    starts = np.flatnonzero(np.diff(features.curves[order], prepend=-1))
    pieces = []
    for which in np.split(order, starts[1:]) if len(order) else ():
        chain = _in_order(features.edges[which], features.corners)
        curve, mean = int(features.curves[which[0]]), float(sectors[which].mean())
        both = np.unique(beside[which], axis=0)
        pair = (int(both[0, 0]), int(both[0, 1])) if len(both) == 1 and both[0, 0] != both[0, 1] else None
        pieces += [Piece(curve, part, mean, pair) for part in _direct(surface.points, chain, direct)]
    return pieces


def _in_order(edges: Ints, corners: Ints) -> Ints:
    """The nodes of the edges (k, 2) of one curve in their order, from a corner on if it has one."""
    near: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        near.setdefault(a, []).append(b)
        near.setdefault(b, []).append(a)
    ends = [node for node in near if len(near[node]) == 1] or np.intersect1d(list(near), corners).tolist()
    chain = [ends[0] if ends else int(edges[0, 0])]
    while near[chain[-1]]:
        following = near[chain[-1]].pop()
        near[following].remove(chain[-1])
        chain.append(following)
    return np.array(chain)


def _direct(points: Floats, chain: Ints, share: float) -> list[Ints]:
    """Parts of a chain whose ends are at least that share of their length apart, by halving."""
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points[chain], axis=0), axis=1)))
    apart = float(np.linalg.norm(points[chain[-1]] - points[chain[0]]))
    if len(chain) == 2 or apart >= share * along[-1]:
        return [chain]
    half = int(np.clip(np.searchsorted(along, 0.5 * along[-1]), 1, len(chain) - 2))
    return _direct(points, chain[: half + 1], share) + _direct(points, chain[half:], share)


def _tags_beside(surface: SurfaceLocator, features: Features, tags: Ints | None) -> Ints:
    """(k, 2) tags on both sides of each feature edge, the lower one first; the same where there are none."""
    table = edge_table(surface.faces)
    every = np.zeros((len(table.nodes), 2), dtype=np.int64)
    if tags is not None:
        every[table.manifold] = np.sort(tags[table.sides], axis=1)
    width = [len(surface.points), 1]
    return np.asarray(every[np.searchsorted(table.nodes @ width, np.sort(features.edges, axis=1) @ width)])


def _sectors(surface: SurfaceLocator, features: Features) -> Floats:
    """(k,) quarters of a turn that the solid takes up at each feature edge; 2 where it has other than two faces."""
    faces = Faces.of(surface.faces)
    table, x = edge_table(faces), surface.points
    corners = x[surface.faces]
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    a, b = table.sides.T
    turn = np.arccos(np.clip(np.einsum("ij,ij->i", normals[a], normals[b]), -1.0, 1.0))
    beyond = faces.centres(x)[b] - x[table.nodes[table.manifold, 0]]
    every = np.full(len(table.nodes), 2.0)
    # The other face falls away behind the plane of this one at a ridge, and rises from it in a notch.
    every[table.manifold] += np.sign(np.einsum("ij,ij->i", normals[a], beyond)) * turn / (0.5 * np.pi)
    width = len(x)
    keys = np.sort(features.edges, axis=1) @ [width, 1]
    return np.asarray(every[np.searchsorted(table.nodes @ [width, 1], keys)])
