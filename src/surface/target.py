"""The surface to stay on: closest points on the input, smoothed between its nodes.

A node that slides on flat facets cuts their edges, and the volume shrinks. So the target bulges over each facet as
its corner normals say: p* = p + 1/2 sum_a lambda_a <x_a - p, n_a> n_a (Boubekeur & Alexa 2008, with the factor that
is exact to second order for a smooth surface). It passes through the nodes, and keeps creases.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from hexconformal.compiled import algebra, loop
from hexconformal.sparsity import corner_incidences
from hexconformal.threads import parallel_ranges

from .features import CORNER, CURVE, SMOOTH, Features, curve_tangents
from .geometry import Cells, Floats, Ints, area_vectors, unit_vectors

__all__ = ["Closest", "Target"]

_CANDIDATES = 2  # starts of a search for the closest point of the whole surface
_STEPS = 60  # facets a node may walk over in one projection


@algebra
def _on_triangle(a, b, c, p):  # type: ignore[no-untyped-def]
    """Weights of the closest point of a triangle (Ericson, Real-Time Collision Detection, 5.1.5)."""
    ab, ac, ap = b - a, c - a, p - a
    d1, d2 = ab[0] * ap[0] + ab[1] * ap[1] + ab[2] * ap[2], ac[0] * ap[0] + ac[1] * ap[1] + ac[2] * ap[2]
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    bp = p - b
    d3, d4 = ab[0] * bp[0] + ab[1] * bp[1] + ab[2] * bp[2], ac[0] * bp[0] + ac[1] * bp[1] + ac[2] * bp[2]
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = d1 / (d1 - d3) if d1 > d3 else 0.0
        return 1.0 - t, t, 0.0
    cp = p - c
    d5, d6 = ab[0] * cp[0] + ab[1] * cp[1] + ab[2] * cp[2], ac[0] * cp[0] + ac[1] * cp[1] + ac[2] * cp[2]
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / (d2 - d6) if d2 > d6 else 0.0
        return 1.0 - t, 0.0, t
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6)) if (d4 - d3) + (d5 - d6) > 0.0 else 0.0
        return 0.0, 1.0 - t, t
    s = va + vb + vc
    if not s > 0.0:
        return 1.0, 0.0, 0.0
    return 1.0 - vb / s - vc / s, vb / s, vc / s


@loop
def _walk(first, last, points, facets, normals, labels, offsets, incidences, queries, places, results, weights):  # type: ignore[no-untyped-def]
    """Closest points, from facet to neighbouring facet of the same label; a curve's facets repeat their last node."""
    w = np.empty(3)
    best = np.empty(3)
    shift = np.empty(3)
    for k in range(first, last):
        place = places[k]
        if place < 0:
            results[k] = queries[k]
            continue
        shift[:] = 0.0
        for _ in range(3):
            query = queries[k] - shift
            nearest = np.inf
            here, start = place, -1
            steps = 0
            while here != start and steps < _STEPS:
                start = here
                steps += 1
                for corner in range(3):
                    node = facets[start, corner]
                    for i in range(offsets[node], offsets[node + 1]):
                        facet = incidences[i] // 3
                        if labels[facet] != labels[start]:
                            continue
                        a, b, c = points[facets[facet, 0]], points[facets[facet, 1]], points[facets[facet, 2]]
                        w[0], w[1], w[2] = _on_triangle(a, b, c, query)
                        d = 0.0
                        for x in range(3):
                            d += (w[0] * a[x] + w[1] * b[x] + w[2] * c[x] - query[x]) ** 2
                        if d < nearest * (1.0 - 1e-12):
                            nearest, here = d, facet
                            best[:] = w
            place = here
            bulge = False
            for x in range(3):
                results[k, x] = 0.0
                for corner in range(3):
                    results[k, x] += best[corner] * points[facets[place, corner], x]
            for corner in range(3):
                n = normals[place, corner]
                node = facets[place, corner]
                height = 0.0
                length = n[0] ** 2 + n[1] ** 2 + n[2] ** 2
                if length == 0.0:
                    continue
                if not bulge:
                    shift[:] = 0.0
                    bulge = True
                for x in range(3):
                    height += (points[node, x] - results[k, x]) * n[x]
                curve = facets[place, 1] == facets[place, 2]
                for x in range(3):
                    # On a curve n is its tangent: what is left of it is across.
                    across = (points[node, x] - results[k, x]) - height * n[x] if curve else height * n[x]
                    shift[x] += 0.5 * best[corner] * across
            if not bulge:
                break
        for x in range(3):
            results[k, x] += shift[x]
            weights[k, x] = best[x]
        places[k] = place


class Target:
    """The input surface with its feature curves, and where on it each node is.

    Parameters
    ----------
    points, cells
        The input; a quadrilateral counts as four triangles around its centre.
    features
        Its curves and patches: a node on a curve stays on it, a smooth node in its patch.
    """

    def __init__(self, points: Floats, cells: Cells, features: Features) -> None:
        count, t = len(points), len(cells.triangles)
        centres = count + np.arange(len(cells.quads))
        fans = [np.stack([cells.quads[:, i], cells.quads[:, (i + 1) % 4], centres], axis=1) for i in range(4)]
        self.points = np.concatenate([points, points[cells.quads].mean(axis=1)])
        faces = np.concatenate([cells.triangles, *fans])
        patches = np.concatenate([features.patches[:t], *([features.patches[t:]] * 4)])
        normals = self._corner_normals(faces, patches)
        self.face_normals = unit_vectors(area_vectors(self.points, Cells(faces, np.empty((0, 4), np.int64))))
        # Curves are facets of two nodes behind the faces, with labels of their own and tangents for normals.
        curves = features.edges[:, [0, 1, 1]]
        tangents = self._curve_tangents(features)
        self.facets = np.concatenate([faces, curves])
        self._labels = np.concatenate([patches, features.chains + patches.max(initial=0) + 1])
        self._normals = np.concatenate([normals, tangents])
        self._offsets, self._incidences = corner_incidences(self.facets, len(self.points))
        self._kind = features.kind
        self.places = self._first_places(count, len(faces))

    def project(self, queries: Floats) -> tuple[Floats, Ints]:
        """Closest points of all nodes (n, 3), found by walking from where they are, and their facets."""
        results, weights, places = np.empty_like(queries), np.empty_like(queries), self.places.copy()
        parallel_ranges(
            _walk, len(queries), self.points, self.facets, self._normals, self._labels, self._offsets,
            self._incidences, np.ascontiguousarray(queries), places, results, weights,
        )  # fmt: skip
        results[self._kind == CORNER] = self.points[: len(queries)][self._kind == CORNER]
        return results, places

    def _corner_normals(self, faces: Ints, patches: Ints) -> Floats:
        """(f, 3, 3) normal of the patch at each corner: the same for all faces of a patch around a node."""
        x = self.points[faces]
        vectors = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        key = faces + len(self.points) * patches[:, None]
        _, inverse = np.unique(key.ravel(), return_inverse=True)
        sums = np.stack([np.bincount(inverse.ravel(), np.repeat(vectors[:, i], 3)) for i in range(3)], axis=1)
        return unit_vectors(sums)[inverse.ravel()].reshape(-1, 3, 3)

    def _curve_tangents(self, features: Features) -> Floats:
        """(e, 3, 3) tangent of the curve at both ends of each of its edges, the last one twice."""
        edges = features.edges
        if len(edges) == 0:
            return np.empty((0, 3, 3))
        direction = unit_vectors(self.points[edges[:, 1]] - self.points[edges[:, 0]])
        tangents = curve_tangents(self.points[: len(features.kind)], features)
        inside = features.kind == CURVE
        ends = [np.where(inside[edges[:, i], None], tangents[edges[:, i]], direction) for i in (0, 1)]
        return np.stack([ends[0], ends[1], ends[1]], axis=1)

    def _first_places(self, count: int, faces: int) -> Ints:
        """A facet at each node, of a curve where it lies on one; -1 for nodes without a cell."""
        places = np.full(count, -1)
        for facets, start, kinds in ((slice(0, faces), 0, (SMOOTH, CORNER)), (slice(faces, None), faces, (CURVE,))):
            table = self.facets[facets]
            node, first = np.unique(table.ravel(), return_index=True)
            mine = (node < count) & np.isin(self._kind[np.minimum(node, count - 1)], kinds)
            places[node[mine]] = start + first[mine] // 3
        return places



class Closest:
    """Closest points of facets without bulge, from the nearest centre on: for measuring.

    Parameters
    ----------
    points
        (n, 3).
    faces
        (f, 3) triangles.
    """

    def __init__(self, points: Floats, faces: Ints) -> None:
        self.points, self.faces = np.ascontiguousarray(points), faces
        self._offsets, self._incidences = corner_incidences(faces, len(points))
        self._tree = cKDTree(points[faces].mean(axis=1))
        self._flat = np.zeros((len(faces), 3, 3))
        self._labels = np.zeros(len(faces), dtype=np.int64)

    def __call__(self, queries: Floats) -> tuple[Floats, Ints]:
        """Distance of each query (k, 3) and the facet that is closest."""
        queries = np.ascontiguousarray(queries)
        nearest = self._tree.query(queries, k=min(_CANDIDATES, len(self.faces)))[1].reshape(len(queries), -1)
        best, found = np.full(len(queries), np.inf), np.zeros(len(queries), dtype=np.int64)
        for places in np.ascontiguousarray(nearest.T, dtype=np.int64):
            results, weights = np.empty_like(queries), np.empty_like(queries)
            parallel_ranges(
                _walk, len(queries), self.points, self.faces, self._flat, self._labels, self._offsets,
                self._incidences, queries, places, results, weights,
            )  # fmt: skip
            distance = np.linalg.norm(results - queries, axis=1)
            closer = distance < best
            best[closer], found[closer] = distance[closer], places[closer]
        return best, found
