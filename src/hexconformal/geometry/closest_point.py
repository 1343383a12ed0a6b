"""Closest points on a surface, exactly or by walking from where one was, and on feature curves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import MeshError, OptionError, first_ids
from ..kernel import parallel_ranges
from ..mesh import morton_codes
from .closest_point_kernels import boxes_range, closest_range, face_range, segment_range, triangles_range, walk_range

__all__ = ["ClosestPoints", "CurveLocator", "SurfaceLocator"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ClosestPoints:
    """Closest points of k places.

    Attributes
    ----------
    positions
        (k, 3) where they are.
    distances
        (k,) how far away, in units of length.
    faces
        (k,) the face (or the edge of a polyline) they lie on.
    weights
        (k, j) weights of the nodes of that face (or edge), which add up to one.
    """

    positions: Floats
    distances: Floats
    faces: Ints
    weights: Floats


@dataclass(frozen=True, eq=False)
class SurfaceLocator:
    """A surface of triangles, or of quads that each stand for four triangles around their centre.

    Attributes
    ----------
    points
        (n, 3) coordinates.
    faces
        (f, 3) or (f, 4) nodes in cyclic order.
    sheets
        (f,) numbers from 0 on of the sheets that each face belongs to: points are closest on one sheet, whatever else
        is there. None where there is one.

    Raises
    ------
    MeshError
        If there are no faces, or they have other than three or four nodes.

    Examples
    --------
    >>> square = SurfaceLocator(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2, 3]]))
    >>> there = square.closest(np.array([[0.5, 0.25, 2.0], [3.0, 0.5, 0.0]]))
    >>> there.positions.tolist(), there.distances
    ([[0.5, 0.25, 0.0], [1.0, 0.5, 0.0]], array([2., 2.]))
    """

    points: Floats
    faces: Ints
    sheets: Ints | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", np.ascontiguousarray(self.points, dtype=np.float64))
        object.__setattr__(self, "faces", np.ascontiguousarray(self.faces, dtype=np.int64))
        if self.faces.ndim != 2 or self.faces.shape[1] not in (3, 4) or len(self.faces) == 0:
            raise MeshError(f"faces of a surface must have three or four nodes each, not {self.faces.shape}")

    @classmethod
    def from_pyvista(cls, source: Any) -> SurfaceLocator:
        """The surface of anything pyvista can show (of a volume its skin), as triangles without coincident points.

        Raises
        ------
        MeshError
            If this is nothing pyvista can wrap, has no faces, or points that are not finite.
        """
        from ..io import triangles_of

        poly = triangles_of(source)
        return cls(np.asarray(poly.points), np.asarray(poly.faces).reshape(-1, 4)[:, 1:])

    def with_points(self, points: Floats) -> SurfaceLocator:
        """The same faces with other points (n, 3); their neighbours are not looked for again."""
        other = replace(self, points=points)
        for name in ("neighbours", "_labels"):
            other.__dict__[name] = getattr(self, name)
        return other

    def part(self, faces: Ints, local: Ints, points: Floats) -> SurfaceLocator:
        """Some of the faces, of a patch: its points, and the number there of every node."""
        return SurfaceLocator(points, local[self.faces[faces]], None if self.sheets is None else self.sheets[faces])

    def prepared(self) -> SurfaceLocator:
        """Itself, with all that queries need made now."""
        for name in ("triangles", "boxes", "neighbours", "_labels", "_extent", "_tree"):
            getattr(self, name)
        return self

    @cached_property
    def _labels(self) -> Ints:
        return np.zeros(len(self.faces), dtype=np.int64) if self.sheets is None else np.ascontiguousarray(self.sheets)

    def any_of_sheet(self, other: SurfaceLocator, faces: Ints) -> Ints | None:
        """(k,) a face of the sheet that each of some faces (k,) of another surface is on; None without sheets."""
        if self.sheets is None or other.sheets is None:
            return None
        return np.unique(self.sheets, return_index=True)[1][other.sheets[faces]]

    @cached_property
    def nodes_of_sheets(self) -> Ints:
        """(f, k) the nodes of the faces, numbered anew so that a node has a number for each sheet that it is on."""
        if self.sheets is None:
            return self.faces
        keys = self.faces * (int(self.sheets.max()) + 1) + self.sheets[:, None]
        return np.unique(keys, return_inverse=True)[1].reshape(keys.shape)

    @cached_property
    def triangles(self) -> Floats:
        """(f, t, 3, 3) corners of the one or four triangles of each face."""
        out = np.empty((len(self.faces), 4 if self.faces.shape[1] == 4 else 1, 3, 3))
        parallel_ranges(triangles_range, len(out), self.points, self.faces, out)
        return out

    @cached_property
    def neighbours(self) -> tuple[Ints, Ints]:
        """Faces of its sheet that share a node with each face, itself among them: (f + 1,) offsets and their ids."""
        nodes = self.nodes_of_sheets
        return _sharing_a_node(nodes, max(len(self.points), int(nodes.max()) + 1), ascending=True)

    def neighbours_of_same(self, labels: Ints) -> tuple[Ints, Ints]:
        """The neighbours that have the same label (f,) as each face: (f + 1,) offsets and their ids."""
        offsets, ids = self.neighbours
        same = labels[ids] == np.repeat(labels, np.diff(offsets))
        return np.concatenate([[0], np.cumsum(same)])[offsets], ids[same]

    @cached_property
    def boxes(self) -> Floats:
        """(f, 2, 3) lower and upper corner of the box around each face."""
        out = np.empty((len(self.faces), 2, 3))
        parallel_ranges(boxes_range, len(out), self.points, self.faces, out)
        return out

    def _codes(self, places: Floats) -> Ints:
        """Places on the space-filling curve (Morton's) through the box of the centres of the faces."""
        low, size = self._extent
        return morton_codes((places - low) / size)

    @cached_property
    def _extent(self) -> tuple[Floats, float]:
        centers = self.boxes.mean(axis=1)
        low = centers.min(axis=0)
        return low, max(float((centers - low).max()), 1e-300)

    @cached_property
    def _sorted(self) -> tuple[Ints, Ints]:
        """Faces in the order of the curve, and their places on it."""
        code = self._codes(self.boxes.mean(axis=1))
        order = np.argsort(code, kind="stable")
        return order, code[order]

    @cached_property
    def _tree(self) -> tuple[Ints, Floats]:
        """Faces in the order of a space-filling curve, and the boxes of a binary tree over that order."""
        order, _ = self._sorted
        leaves = 1 << (len(order) - 1).bit_length()
        # Node i has the children 2 i and 2 i + 1; the faces are the last level.
        tree = np.empty((2 * leaves, 2, 3))
        tree[:, 0], tree[:, 1] = np.inf, -np.inf
        tree[leaves : leaves + len(order)] = self.boxes[order]
        while leaves > 1:
            pairs = tree[leaves : 2 * leaves].reshape(-1, 2, 2, 3)
            leaves //= 2
            tree[leaves : 2 * leaves, 0] = pairs[:, :, 0].min(axis=1)
            tree[leaves : 2 * leaves, 1] = pairs[:, :, 1].max(axis=1)
        return order, tree

    def closest(self, places: ArrayLike, near: Ints | None = None) -> ClosestPoints:
        """The closest point of the whole surface, or of one sheet of it, exactly.

        Parameters
        ----------
        places
            (k, 3) where from.
        near
            (k,) faces that are probably close: with them it goes faster. Where there are sheets they tell which one.
        """
        places = np.ascontiguousarray(places, dtype=np.float64)
        if near is None:
            order, codes = self._sorted
            near = order[np.minimum(np.searchsorted(codes, self._codes(places)), len(order) - 1)]
        return self.query(closest_range, places, near, self._labels, *self._tree)

    def closest_by_walk(self, places: ArrayLike, start: Ints) -> ClosestPoints:
        """The closest point that is found from a face by going to neighbours as long as that helps.

        Local, and so never on the far side of a thin wall; not farther away than the face it starts from.

        Parameters
        ----------
        places
            (k, 3) where from.
        start
            (k,) the face where each begins, usually where its last walk ended.
        """
        return self.query(walk_range, places, start, self.boxes, *self.neighbours)

    def distances_to(self, places: ArrayLike, faces: Ints) -> Floats:
        """(k,) distances of places (k, 3) from given faces (k,)."""
        places = np.ascontiguousarray(places, dtype=np.float64)
        distances = np.empty(len(places))
        parallel_ranges(face_range, len(places), places, np.ascontiguousarray(faces), self.triangles, distances)
        return distances

    def query(self, kernel: Any, places: ArrayLike, start: Ints, *tables: Any) -> ClosestPoints:
        """The closest points that a compiled loop finds from faces, or what else it starts from, with its tables."""
        places, start = np.ascontiguousarray(places, dtype=np.float64), np.ascontiguousarray(start)
        count, size = len(places), self.faces.shape[1]
        faces, weights = np.empty(count, dtype=np.int64), np.empty((count, size))
        positions, distances = np.empty((count, 3)), np.empty(count)
        out = (positions, distances, faces, weights)
        parallel_ranges(kernel, count, places, start, self.triangles, *tables, *out)
        return ClosestPoints(*out)


@dataclass(frozen=True, eq=False)
class CurveLocator:
    """Curves made of straight edges.

    Attributes
    ----------
    points
        (n, 3) coordinates.
    edges
        (e, 2) nodes.
    curves
        (e,) the curve of each edge, numbers from 0 on.

    Examples
    --------
    >>> line = CurveLocator(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]]), np.array([[0, 1], [1, 2]]), np.array([0, 1]))
    >>> place = np.array([[0.9, 0.5, 0.0]])
    >>> line.closest(place, [0]).positions.tolist(), line.closest(place, [1]).positions.tolist()
    ([[0.9, 0.0, 0.0]], [[1.0, 0.5, 0.0]])
    """

    points: Floats
    edges: Ints
    curves: Ints

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", np.ascontiguousarray(self.points, dtype=np.float64))
        object.__setattr__(self, "edges", np.ascontiguousarray(self.edges, dtype=np.int64).reshape(-1, 2))
        object.__setattr__(self, "curves", np.ascontiguousarray(self.curves, dtype=np.int64))

    @cached_property
    def _segments(self) -> Floats:
        return np.ascontiguousarray(self.points[self.edges])

    @cached_property
    def _members(self) -> tuple[Ints, Ints]:
        # The edges of each curve: offsets and ids.
        sizes = np.bincount(self.curves)
        return np.concatenate([[0], np.cumsum(sizes)]), np.argsort(self.curves, kind="stable")

    @cached_property
    def _neighbours(self) -> tuple[Ints, Ints]:
        # The edges of the same curve that share a node with each edge, itself among them.
        # A node counts once per curve, so that curves do not mix where they meet.
        keys = self.edges * (int(self.curves.max(initial=0)) + 1) + self.curves[:, None]
        names = np.unique(keys, return_inverse=True)[1].ravel()
        return _sharing_a_node(names.reshape(-1, 2), 2 * len(self.edges))

    def closest(self, places: ArrayLike, curves: ArrayLike) -> ClosestPoints:
        """The closest point on a given curve, exactly.

        Parameters
        ----------
        places
            (k, 3) where from.
        curves
            (k,) the curve for each.

        Raises
        ------
        OptionError
            If there is no such curve.
        """
        wanted = np.ascontiguousarray(curves, dtype=np.int64)
        offsets, members = self._members
        bad = wanted[~np.isin(wanted, self.curves)]
        if len(bad):
            raise OptionError(f"curves must be numbers that edges have, these are not: {first_ids(bad)}")
        return self._query(places, members[offsets[wanted]], offsets, members, wanted)

    def closest_by_walk(self, places: ArrayLike, start: Ints) -> ClosestPoints:
        """The closest point found from an edge by going along its curve as long as that helps.

        Parameters
        ----------
        places
            (k, 3) where from.
        start
            (k,) the edge where each begins.
        """
        return self._query(places, np.ascontiguousarray(start), *self._neighbours, np.full(len(start), -1))

    def _query(self, places: ArrayLike, start: Ints, offsets: Ints, ids: Ints, rows: Ints) -> ClosestPoints:
        places = np.ascontiguousarray(places, dtype=np.float64)
        count = len(places)
        out = (np.empty((count, 3)), np.empty(count), np.empty(count, dtype=np.int64), np.empty((count, 2)))
        parallel_ranges(segment_range, count, places, start, self._segments, offsets, ids, rows, *out)
        return ClosestPoints(*out)


def _sharing_a_node(table: Ints, count: int, ascending: bool = False) -> tuple[Ints, Ints]:
    """Rows of a table of nodes that share one with each row, itself among them: (r + 1,) offsets and their ids."""
    from scipy.sparse import csr_array

    rows, size = table.shape
    ones = np.ones(rows * size, dtype=np.int32)
    touch = csr_array((ones, (np.repeat(np.arange(rows), size), table.ravel())), shape=(rows, count))
    near = (touch @ touch.T).tocsr()
    if ascending:
        near.sort_indices()
    return near.indptr.astype(np.int64), near.indices.astype(np.int64)
