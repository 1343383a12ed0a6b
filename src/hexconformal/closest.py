"""Closest points on a surface, exactly or by walking from where one was, and on feature curves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .compiled import algebra, loop
from .errors import MeshError, OptionError, first_ids
from .quaternion import combine, cross, dot, subtract
from .threads import parallel_ranges

__all__ = ["Closest", "Polyline", "Surface", "closest_on_segment", "closest_on_triangle", "walk"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Steps of a walk: more than any mesh is wide between two positions of a point.
_STEPS = 1000
# Squared sine below which rounding spoils what is computed from the area of a triangle.
_SLIVER = 1e-10


@dataclass(frozen=True, eq=False)
class Closest:
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
class Surface:
    """A surface of triangles, or of quads that each stand for four triangles around their centre.

    Attributes
    ----------
    points
        (n, 3) coordinates.
    faces
        (f, 3) or (f, 4) nodes in cyclic order.

    Raises
    ------
    MeshError
        If there are no faces, or they have other than three or four nodes.

    Examples
    --------
    >>> square = Surface(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2, 3]]))
    >>> there = square.closest(np.array([[0.5, 0.25, 2.0], [3.0, 0.5, 0.0]]))
    >>> there.positions.tolist(), there.distances
    ([[0.5, 0.25, 0.0], [1.0, 0.5, 0.0]], array([2., 2.]))
    """

    points: Floats
    faces: Ints

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", np.ascontiguousarray(self.points, dtype=np.float64))
        object.__setattr__(self, "faces", np.ascontiguousarray(self.faces, dtype=np.int64))
        if self.faces.ndim != 2 or self.faces.shape[1] not in (3, 4) or len(self.faces) == 0:
            raise MeshError(f"a surface needs faces of three or four nodes each, not {self.faces.shape}")

    @classmethod
    def from_pyvista(cls, source: Any) -> Surface:
        """The surface of anything pyvista can show (of a volume its skin), cut into triangles."""
        import pyvista as pv

        mesh = pv.wrap(source)
        poly = (mesh if isinstance(mesh, pv.PolyData) else mesh.extract_surface(algorithm="dataset_surface")).triangulate()
        faces = np.asarray(poly.faces, dtype=np.int64).reshape(-1, 4)[:, 1:]
        return cls(np.asarray(poly.points, dtype=np.float64), faces)

    def moved(self, points: Floats) -> Surface:
        """The same faces with their nodes elsewhere; what is known of their neighbours is kept."""
        other = replace(self, points=points)
        other.__dict__["neighbours"] = self.neighbours
        return other

    @cached_property
    def triangles(self) -> Floats:
        """(f, t, 3, 3) corners of the one or four triangles of each face."""
        x = self.points[self.faces]
        if x.shape[1] == 3:
            return x[:, None]
        center = np.broadcast_to(x.mean(axis=1)[:, None], x.shape)
        return np.ascontiguousarray(np.stack([x, np.roll(x, -1, axis=1), center], axis=2))

    @cached_property
    def neighbours(self) -> tuple[Ints, Ints]:
        """Faces that share a node with each face, itself among them: (f + 1,) offsets and their ids."""
        from scipy.sparse import csr_array

        count, size = self.faces.shape
        ones = np.ones(count * size, dtype=np.int32)
        shape = (count, len(self.points))
        touch = csr_array((ones, (np.repeat(np.arange(count), size), self.faces.ravel())), shape=shape)
        near = (touch @ touch.T).tocsr()
        near.sort_indices()
        return near.indptr.astype(np.int64), near.indices.astype(np.int64)

    @cached_property
    def boxes(self) -> Floats:
        """(f, 2, 3) lower and upper corner of the box around each face."""
        corners = self.triangles.reshape(len(self.faces), -1, 3)
        return np.ascontiguousarray(np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1))

    @cached_property
    def _tree(self) -> tuple[Ints, Floats]:
        """Faces in the order of a space-filling curve, and the boxes of a binary tree over that order."""
        centers = self.boxes.mean(axis=1)
        low = centers.min(axis=0)
        cells = ((centers - low) / max(float((centers - low).max()), 1e-300) * 1023).astype(np.int64)
        code = np.zeros(len(centers), dtype=np.int64)
        for bit in range(10):
            for axis in range(3):
                code |= (cells[:, axis] >> bit & 1) << (3 * bit + axis)
        order = np.argsort(code, kind="stable")
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

    def closest(self, places: ArrayLike, near: Ints | None = None) -> Closest:
        """The closest point of the whole surface, exactly.

        Parameters
        ----------
        places
            (k, 3) where from.
        near
            (k,) faces that are probably close: with them it goes faster.
        """
        places = np.ascontiguousarray(places, dtype=np.float64)
        start = np.full(len(places), self._tree[0][0]) if near is None else np.ascontiguousarray(near)
        return self._asked(_closest_range, places, start, *self._tree)

    def walked(self, places: ArrayLike, start: Ints) -> Closest:
        """The closest point that is found from a face by going to neighbours as long as that helps.

        Local, and so never on the far side of a thin wall; not farther away than the face it starts from.

        Parameters
        ----------
        places
            (k, 3) where from.
        start
            (k,) the face where each begins, usually where its last walk ended.
        """
        places = np.ascontiguousarray(places, dtype=np.float64)
        return self._asked(_walk_range, places, np.ascontiguousarray(start), self.boxes, *self.neighbours)

    def _asked(self, kernel: Any, places: Floats, start: Ints, *tables: Any) -> Closest:
        count, size = len(places), self.faces.shape[1]
        faces, weights = np.empty(count, dtype=np.int64), np.empty((count, size))
        positions, distances = np.empty((count, 3)), np.empty(count)
        out = (positions, distances, faces, weights)
        parallel_ranges(kernel, count, places, start, self.triangles, *tables, *out)
        return Closest(*out)


@dataclass(frozen=True, eq=False)
class Polyline:
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
    >>> line = Polyline(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]]), np.array([[0, 1], [1, 2]]), np.array([0, 1]))
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
        from scipy.sparse import csr_array

        count = len(self.edges)
        # A node counts once per curve, so that curves do not mix where they meet.
        keys = self.edges * (int(self.curves.max(initial=0)) + 1) + self.curves[:, None]
        names = np.unique(keys, return_inverse=True)[1].ravel()
        rows = np.repeat(np.arange(count), 2)
        touch = csr_array((np.ones(2 * count, dtype=np.int32), (rows, names)), shape=(count, 2 * count))
        near = (touch @ touch.T).tocsr()
        return near.indptr.astype(np.int64), near.indices.astype(np.int64)

    def closest(self, places: ArrayLike, curves: ArrayLike) -> Closest:
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
            raise OptionError(f"there are no such curves: {first_ids(bad)}")
        return self._asked(places, members[offsets[wanted]], offsets, members, wanted)

    def walked(self, places: ArrayLike, start: Ints) -> Closest:
        """The closest point found from an edge by going along its curve as long as that helps.

        Parameters
        ----------
        places
            (k, 3) where from.
        start
            (k,) the edge where each begins.
        """
        return self._asked(places, np.ascontiguousarray(start), *self._neighbours, np.full(len(start), -1))

    def _asked(self, places: ArrayLike, start: Ints, offsets: Ints, ids: Ints, rows: Ints) -> Closest:
        places = np.ascontiguousarray(places, dtype=np.float64)
        count = len(places)
        out = (np.empty((count, 3)), np.empty(count), np.empty(count, dtype=np.int64), np.empty((count, 2)))
        parallel_ranges(_segment_range, count, places, start, self._segments, offsets, ids, rows, *out)
        return Closest(*out)


@algebra
def closest_on_segment(p: Any, a: Any, b: Any) -> Any:
    """Weight of b in the point of segment ab that is closest to p."""
    along = subtract(b, a)
    length = dot(along, along)
    share = dot(subtract(p, a), along)
    return min(max(share / length, 0.0), 1.0) if length > 0.0 else 0.0


@algebra
def closest_on_triangle(p: Any, a: Any, b: Any, c: Any) -> Any:
    """Weights of a, b, c in the point of their triangle that is closest to p.

    After Ericson, Real-Time Collision Detection, section 5.1.5; a triangle without area is its three edges.
    """
    ab, ac, ap = subtract(b, a), subtract(c, a), subtract(p, a)
    bp, cp = subtract(p, b), subtract(p, c)
    normal = cross(ab, ac)
    if dot(normal, normal) <= _SLIVER * dot(ab, ab) * dot(ac, ac):
        u, v, w = closest_on_segment(p, a, b), closest_on_segment(p, b, c), closest_on_segment(p, c, a)
        on_ab, on_bc, on_ca = combine(1.0 - u, ap, u, bp), combine(1.0 - v, bp, v, cp), combine(1.0 - w, cp, w, ap)
        one, two, three = dot(on_ab, on_ab), dot(on_bc, on_bc), dot(on_ca, on_ca)
        if one <= two and one <= three:
            return 1.0 - u, u, 0.0
        return (0.0, 1.0 - v, v) if two <= three else (w, 0.0, 1.0 - w)
    d1, d2, d3, d4, d5, d6 = dot(ab, ap), dot(ac, ap), dot(ab, bp), dot(ac, bp), dot(ab, cp), dot(ac, cp)
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        return 1.0 - v, v, 0.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        return 1.0 - w, 0.0, w
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 0.0, 1.0 - w, w
    total = va + vb + vc
    return va / total, vb / total, vc / total


@loop
def _closer(p, triangles, face, best, found):  # type: ignore[no-untyped-def]
    """Squared distance of a face if it is below `best`; then triangle and weights go to `found`."""
    for t in range(triangles.shape[1]):
        x = triangles[face, t]
        a, b, c = (x[0, 0], x[0, 1], x[0, 2]), (x[1, 0], x[1, 1], x[1, 2]), (x[2, 0], x[2, 1], x[2, 2])
        u, v, w = closest_on_triangle(p, a, b, c)
        # From the differences, so that nothing is lost far away from the origin.
        r = combine(1.0, combine(u, subtract(a, p), v, subtract(b, p)), w, subtract(c, p))
        d = dot(r, r)
        if d < best:
            best = d
            found[0], found[1], found[2], found[3] = t, u, v, w
    return best


@loop
def _box_distance(p, box):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(3):
        outside = max(box[0, i] - p[i], p[i] - box[1, i], 0.0)
        total += outside * outside
    return total


@loop
def walk(p, start, triangles, boxes, offsets, ids, found):  # type: ignore[no-untyped-def]
    """Walk of :meth:`Surface.walked` from one place p, a tuple, for use in compiled loops.

    Returns the squared distance and the face; `found` (4,) takes the triangle of that face and the weights of
    its corners.
    """
    found[0], found[1], found[2], found[3] = 0.0, 1.0, 0.0, 0.0
    face = start
    best = _closer(p, triangles, face, np.inf, found)
    for _ in range(_STEPS):
        here = face
        for i in range(offsets[here], offsets[here + 1]):
            other = ids[i]
            if other != here and _box_distance(p, boxes[other]) < best:
                d = _closer(p, triangles, other, best, found)
                if d < best:
                    best, face = d, other
        if face == here:
            break
    return best, face


@loop
def _keep(k, face, best, found, triangles, positions, distances, faces, weights):  # type: ignore[no-untyped-def]
    t, size = int(found[0]), weights.shape[1]
    x = triangles[face, t]
    for i in range(3):
        positions[k, i] = found[1] * x[0, i] + found[2] * x[1, i] + found[3] * x[2, i]
    distances[k], faces[k] = np.sqrt(best), face
    if size == 3:
        weights[k, 0], weights[k, 1], weights[k, 2] = found[1], found[2], found[3]
    else:
        weights[k, :] = 0.25 * found[3]
        weights[k, t] += found[1]
        weights[k, (t + 1) % 4] += found[2]


@loop
def _walk_range(  # type: ignore[no-untyped-def]
    first, last, places, start, triangles, boxes, offsets, ids, positions, distances, faces, weights
):
    found = np.empty(4)
    for k in range(first, last):
        p = (places[k, 0], places[k, 1], places[k, 2])
        best, face = walk(p, start[k], triangles, boxes, offsets, ids, found)
        _keep(k, face, best, found, triangles, positions, distances, faces, weights)


@loop
def _closest_range(  # type: ignore[no-untyped-def]
    first, last, places, start, triangles, order, tree, positions, distances, faces, weights
):
    leaves = len(tree) // 2
    found, nodes, bounds = np.empty(4), np.empty(64, np.int64), np.empty(64)
    for k in range(first, last):
        p = (places[k, 0], places[k, 1], places[k, 2])
        found[0], found[1], found[2], found[3] = 0.0, 1.0, 0.0, 0.0
        face = start[k]
        best = _closer(p, triangles, face, np.inf, found)
        nodes[0], bounds[0] = 1, 0.0
        size = 1
        while size > 0:
            size -= 1
            node = nodes[size]
            if not bounds[size] < best:
                continue
            if node >= leaves:
                other = order[node - leaves]
                d = _closer(p, triangles, other, best, found)
                if d < best:
                    best, face = d, other
                continue
            one, two = _box_distance(p, tree[2 * node]), _box_distance(p, tree[2 * node + 1])
            # The nearer child comes off the stack first.
            swap = int(one < two)
            nodes[size], bounds[size] = 2 * node + swap, two if swap else one
            nodes[size + 1], bounds[size + 1] = 2 * node + 1 - swap, one if swap else two
            size += 2
        _keep(k, face, best, found, triangles, positions, distances, faces, weights)


@loop
def _segment_range(  # type: ignore[no-untyped-def]
    first, last, places, start, segments, offsets, ids, rows, positions, distances, edges, weights
):
    # rows names the list of edges to look through; where it is -1 the list is that of the edge one is on.
    for k in range(first, last):
        p = (places[k, 0], places[k, 1], places[k, 2])
        edge = start[k]
        best, share = np.inf, 0.0
        for _ in range(_STEPS):
            here = edge
            row = rows[k] if rows[k] >= 0 else here
            for i in range(offsets[row], offsets[row + 1]):
                x = segments[ids[i]]
                a, b = (x[0, 0], x[0, 1], x[0, 2]), (x[1, 0], x[1, 1], x[1, 2])
                s = closest_on_segment(p, a, b)
                r = combine(1.0 - s, subtract(a, p), s, subtract(b, p))
                if dot(r, r) < best:
                    best, share, edge = dot(r, r), s, ids[i]
            if edge == here or rows[k] >= 0:
                break
        x = segments[edge]
        for i in range(3):
            positions[k, i] = (1.0 - share) * x[0, i] + share * x[1, i]
        distances[k], edges[k], weights[k, 0], weights[k, 1] = np.sqrt(best), edge, 1.0 - share, share
