"""Nodes that slide on a curved surface: where they are brought back to, and which way they may go from there.

A face of a quadratic cell is the image of a square, or of half of one. The place of a node on it is found on flat
parts, by walking, and then on the face itself, by the method of Gauss and Newton.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...elements import quadratic_polynomials
from ...geometry import ClosestPoints, DistanceBarrier
from ...mesh import Space
from ...solver import AdmissibleDirections, count_free_directions
from .cut_mesh import CutMesh, Parts

__all__ = ["Sliding", "SlidingNodes", "sliding_nodes"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Walk = Callable[[Field, Ints], ClosestPoints]

_CORRECTIONS = 3  # steps of Gauss and Newton, which begin within a part of a face


@dataclass(frozen=True, eq=False)
class SlidingNodes:
    """Nodes that slide on faces, or along edges, of the mesh as it was.

    Attributes
    ----------
    nodes
        (k,) their ids.
    near
        (k,) part that each is on, where walks begin.
    walk
        Finds the closest of the parts from those near.
    places
        (p, j, 2) as of :class:`Parts`, of the parts in the order that walks know.
    grids
        (p, 3, 3, 3) or (p, 3, 1, 3) points of the face, or edge, of each part.
    halves
        (p,) parts of triangles, the images of half of the square.
    """

    nodes: Ints
    near: Ints
    walk: Walk
    places: Field
    grids: Field
    halves: Mask

    def found(self, places: Field) -> tuple[Field, Field, Ints]:
        """Closest points (k, 3) to some places, tangents (k, d, 3) there, and the parts (k,) that they are near to."""
        there = self.walk(places, self.near)
        uv = np.einsum("kj,kjd->kd", there.weights, self.places[there.faces])
        grids = self.grids[there.faces]
        positions, tangents = _on_grids(grids, uv)
        for _ in range(_CORRECTIONS):
            metric = tangents @ tangents.transpose(0, 2, 1)
            metric += 1e-12 * np.trace(metric, axis1=1, axis2=2)[:, None, None] * np.eye(metric.shape[1])
            away = np.einsum("kdr,kr->kd", tangents, places - positions)
            size = metric.shape[1]
            uv[:, :size] += np.linalg.solve(metric, away[..., None])[..., 0]
            _keep_inside(uv, self.halves[there.faces])
            positions, tangents = _on_grids(grids, uv)
        return positions, tangents, there.faces


def _keep_inside(uv: Field, halves: Mask) -> None:
    """Bring places (k, 2) into the unit square, those on halves of it to these, in place."""
    np.clip(uv, 0.0, 1.0, out=uv)
    beyond = np.where(halves, 0.5 * np.maximum(uv.sum(axis=1) - 1.0, 0.0), 0.0)
    uv -= beyond[:, None]
    np.clip(uv, 0.0, 1.0, out=uv)


def _on_grids(grids: Field, uv: Field) -> tuple[Field, Field]:
    """Points (k, 3) of quadratic faces, or edges, at places (k, 2), and derivatives (k, d, 3)."""
    u, du = quadratic_polynomials(uv[:, 0])
    if grids.shape[2] == 1:
        lines = grids[:, :, 0]
        return np.einsum("ki,kir->kr", u, lines), np.einsum("ki,kir->kr", du, lines)[:, None]
    v, dv = quadratic_polynomials(uv[:, 1])
    across = np.einsum("kj,kijr->kir", v, grids)
    slopes = np.einsum("ki,kir->kr", du, across), np.einsum("ki,kj,kijr->kr", u, dv, grids, optimize=True)
    return np.einsum("ki,kir->kr", u, across), np.stack(slopes, axis=1)


def sliding_nodes(
    cut: CutMesh, barrier: DistanceBarrier, faces: Parts, edges: Parts, admissible: AdmissibleDirections
) -> tuple[SlidingNodes, ...]:
    """The nodes that slide on the surface that a barrier keeps, and those that slide along its curves.

    Parameters
    ----------
    cut
        The mesh cut into parts.
    barrier
        That of the parts.
    faces, edges
        Parts of all faces and edges that the barrier is about.
    admissible
        What nodes may do besides: those that keep to the surface by that alone do not need to be brought back.
    """
    free = count_free_directions(np.eye(3) - admissible.all_projectors(len(cut.mesh.points)))
    curves, count = barrier.curves, len(cut.mesh.points)
    points = barrier.measured_at
    taken = np.zeros(cut.count, dtype=bool)
    taken[count:], taken[curves.corners] = True, True
    out = []
    if curves.locator is not None:
        # Samples at nodes have all of one node; the others are between two.
        at_nodes = np.flatnonzero((curves.weights[:, 0] == 1.0) & (curves.nodes[:, 0] < count))
        _, first = np.unique(curves.nodes[at_nodes, 0], return_index=True)
        at_nodes = at_nodes[first]
        taken[curves.nodes[at_nodes, 0]] = True
        at_nodes = at_nodes[free[curves.nodes[at_nodes, 0]] > 1]
        tables = _of_edges(edges, curves.locator.edges, points)
        nodes, walk = curves.nodes[at_nodes, 0], curves.locator.closest_by_walk
        out.append(SlidingNodes(nodes, curves.near[at_nodes], walk, *tables))
    surface = barrier.original
    quads = surface.faces
    ends, first = np.unique(quads, return_index=True)
    own = ~taken[ends]
    own[own] = free[ends[own]] > 2
    tables = _in_order(faces, quads, points)
    out.append(SlidingNodes(ends[own], first[own] // quads.shape[1], surface.closest_by_walk, *tables))
    return tuple(out)


def _of_edges(parts: Parts, rows: Ints, points: Field) -> tuple[Field, Field, Mask]:
    """The same as of faces; what is found to be sharp though it is within a face is straight."""
    known = parts.matching(rows) < len(parts.nodes)
    ends = points[rows]
    places = np.tile([[0.0, 0.0], [1.0, 0.0]], (len(rows), 1, 1))
    grids = np.stack([ends[:, 0], ends.mean(axis=1), ends[:, 1]], axis=1)[:, :, None]
    places[known], grids[known], _ = _in_order(parts, rows[known], points)
    return places, grids, np.zeros(len(rows), dtype=bool)


def _in_order(parts: Parts, rows: Ints, points: Field) -> tuple[Field, Field, Mask]:
    """Places (k, j, 2) of the nodes of rows (k, j), which are parts, in their order.

    Points of what they are on, and which of these are triangles.
    """
    whole = rows if rows.shape[1] == parts.nodes.shape[1] else rows[:, [0, 1, 2, 2]]
    which = parts.matching(whole)
    order = (parts.nodes[which][:, None] == rows[:, :, None]).argmax(axis=2)[..., None]
    faces = which // parts.each
    return np.take_along_axis(parts.places[which], order, axis=1), parts.grid_points(points)[faces], parts.halves[faces]


class Sliding(Space):
    """The space of points whose sliding nodes lie on the surface; trials are brought back to it.

    Parameters
    ----------
    kinds
        The nodes that slide, those of faces and of edges.
    held
        Nodes at ends of curves, which stay.
    admissible
        What nodes may do besides.
    start
        (n, 3) the points at first, on the surface, in edges.
    parts
        Parts of an edge.
    """

    def __init__(
        self,
        kinds: tuple[SlidingNodes, ...],
        held: Ints,
        admissible: AdmissibleDirections,
        start: Field,
        parts: int,
    ) -> None:
        self._kinds, self._held, self._start, self._parts = kinds, held, start, parts
        self._projectors, self._base = admissible.all_projectors(len(start)), admissible

    def seen_from(self, points: Field) -> Sliding:
        """The same with walks that begin where the nodes are at points (n, 3)."""
        kinds = tuple(replace(kind, near=kind.found(self._parts * points[kind.nodes])[2]) for kind in self._kinds)
        return Sliding(kinds, self._held, self._base, self._start, self._parts)

    def with_held(self, nodes: Ints) -> Sliding:
        """The same with further nodes (ids) held, where they are."""
        return Sliding(self._kinds, np.union1d(self._held, nodes), self._base, self._start, self._parts)

    def update(self, field: Field) -> Field:  # type: ignore[override]
        """Points (n, 3) with sliding nodes brought back to the surface; what has not moved stays to the last bit."""
        out = field.copy()
        for kind in self._kinds:
            moved = (field[kind.nodes] != self._start[kind.nodes]).any(axis=1)
            some = replace(kind, near=kind.near[moved])
            nodes = kind.nodes[moved]
            shift = some.found(self._parts * field[nodes])[0] / self._parts - self._start[nodes]
            out[nodes] = self._start[nodes] + np.einsum("kij,kj->ki", self._projectors[nodes], shift)
        return self._base.coupled.together(out, self._start)

    def admissible(self, points: Field) -> AdmissibleDirections:
        """The directions in which nodes may go from points (n, 3): along the surface, and as before."""
        sums = np.eye(3) - self._projectors
        for kind in self._kinds:
            tangents = kind.found(self._parts * points[kind.nodes])[1]
            # Orthonormal, so that what is left is the projection onto the normals.
            basis = np.linalg.qr(tangents.transpose(0, 2, 1))[0]
            normals = np.eye(3) - basis @ basis.transpose(0, 2, 1)
            sums[kind.nodes] += normals
        sums[self._held] = np.eye(3)
        return AdmissibleDirections.from_normal_sums(sums, None, self._base.coupled)
