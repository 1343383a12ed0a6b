"""Projection onto the input surface, smoothed between its nodes.

A node that slides on flat facets cuts their edges, and the volume shrinks. So the target bulges over each facet as
its corner normals say: p* = p + 1/2 sum_a lambda_a <x_a - p, n_a> n_a (Boubekeur & Alexa 2008, with the factor that
is exact to second order for a smooth surface). It passes through the nodes, and keeps creases. Equation (20) of
docs/mathematics.md.
"""

from __future__ import annotations

import numpy as np

from hexconformal.geometry import (
    CORNER,
    CURVE,
    SMOOTH,
    Faces,
    Features,
    SurfaceLocator,
    fan_triangles,
    unit_vectors,
    walk,
)
from hexconformal.kernel import add, algebra, combine, dot, loop, parallel_ranges, scale, subtract

from ..mesh import Floats, Ints
from .features import curve_tangents
from .input_surface import corner_normals

__all__ = ["SmoothProjection"]


@algebra
def _row(array, i):  # type: ignore[no-untyped-def]
    return (array[i, 0], array[i, 1], array[i, 2])


@loop
def _bulging(  # type: ignore[no-untyped-def]
    first, last, triangles, boxes, curves, normals, offsets, ids, queries, places, results, upright
):
    """Closest points of the target; a facet of a curve repeats its last node and has tangents for normals."""
    found = np.empty(4)
    for k in range(first, last):
        place = places[k]
        query = _row(queries, k)
        if place < 0:
            results[k, 0], results[k, 1], results[k, 2] = query
            upright[k, :] = 0.0
            continue
        shift, flat, up = (0.0, 0.0, 0.0), query, (0.0, 0.0, 0.0)
        # The bulge moves the closest point sideways: ask again from where the facet would see it.
        for _ in range(3):
            _, place = walk(subtract(query, shift), place, triangles, boxes, offsets, ids, found)
            x, w = triangles[place, 0], found[1:]
            flat = combine(1.0, combine(w[0], _row(x, 0), w[1], _row(x, 1)), w[2], _row(x, 2))
            shift = up = (0.0, 0.0, 0.0)
            for corner in range(3):
                n = _row(normals[place], corner)
                up = combine(1.0, up, w[corner], n)
                across = subtract(_row(x, corner), flat)
                height = dot(across, n)
                # On a curve n is the tangent: what is left of it is across.
                across = combine(1.0, across, -height, n) if place >= curves else scale(height, n)
                shift = combine(1.0, shift, 0.5 * w[corner], across)
        results[k, 0], results[k, 1], results[k, 2] = add(flat, shift)
        upright[k, 0], upright[k, 1], upright[k, 2] = up
        places[k] = place


class SmoothProjection:
    """The input surface with its feature curves, to project nodes onto it.

    Parameters
    ----------
    points, cells
        The input; a quadrilateral counts as four triangles around its centre.
    features
        Its curves and patches: a node on a curve stays on it, a smooth node in its patch.

    Attributes
    ----------
    facets
        (f, 3) triangles of the input, and behind them the edges of its curves, whose last node comes twice.
    node_facets
        (n,) the facet that each node lies on, where its next projection begins; -1 for nodes without a cell.
    """

    def __init__(self, points: Floats, cells: Faces, features: Features) -> None:
        count = len(points)
        self.points, faces, owners = fan_triangles(points, cells)
        patches = features.patches[owners]
        normals = corner_normals(self.points, faces, patches)
        # Curves are facets of two nodes behind the faces, with labels of their own and tangents for normals.
        curves = features.edges[:, [0, 1, 1]]
        tangents = self._curve_tangents(features)
        self.facets = np.concatenate([faces, curves])
        self._faces, self._normals = len(faces), np.concatenate([normals, tangents])
        self._locator = SurfaceLocator(self.points, self.facets)
        # Nodes stay in their patch, or on their curve.
        labels = np.concatenate([patches, features.curves + patches.max(initial=0) + 1])
        self._neighbours = self._locator.neighbours_of_same(labels)
        self._kind = features.kind
        self.node_facets = self._first_facets(count, len(faces))
        self._base: Floats | None = None

    def project(self, queries: Floats) -> tuple[Floats, Ints, Floats]:
        """Closest points of all nodes (n, 3), found by walking from where they are, their facets, and normals there."""
        results, places, normals = np.empty_like(queries), self.node_facets.copy(), np.empty_like(queries)
        parallel_ranges(
            _bulging, len(queries), self._locator.triangles, self._locator.boxes, self._faces, self._normals,
            *self._neighbours, np.ascontiguousarray(queries), places, results, normals,
        )  # fmt: skip
        results[self._kind == CORNER] = self.points[: len(queries)][self._kind == CORNER]
        return results, places, normals

    def foot_points(self, base: Floats) -> tuple[Floats, Floats]:
        """Closest points of all nodes (n, 3) and normals there, kept until they are wanted of another array."""
        if self._base is not base:
            results, _, normals = self.project(base)
            self._base, self._foot_points = base, (results, normals)
        return self._foot_points

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

    def _first_facets(self, count: int, faces: int) -> Ints:
        """A facet at each node, of a curve where it lies on one; -1 for nodes without a cell."""
        places = np.full(count, -1)
        for facets, start, kinds in ((slice(0, faces), 0, (SMOOTH, CORNER)), (slice(faces, None), faces, (CURVE,))):
            table = self.facets[facets]
            node, first = np.unique(table.ravel(), return_index=True)
            mine = (node < count) & np.isin(self._kind[np.minimum(node, count - 1)], kinds)
            places[node[mine]] = start + first[mine] // 3
        return places
