"""The input surface: how far others are from it, and which of their cells are turned over against it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hexconformal.geometry import (
    ClosestPoints,
    Faces,
    SurfaceLocator,
    edge_table,
    face_area_vectors,
    fan_triangles,
    unit_vectors,
)
from hexconformal.mesh import corner_incidences, face_edges, unique_edges

from ..mesh import Floats, Ints

__all__ = ["InputSurface", "corner_normals"]

_MARGIN = 0.08  # of the bound
_ON_EDGE = 1e-7  # weight of a corner below which a place lies on the edge opposite


class InputSurface:
    """The input surface, to measure others against.

    Parameters
    ----------
    points, cells
        The input.

    Attributes
    ----------
    forbid_turning
        Whether a cell is out of bounds, too, that turns over.
    forbid_sheet_change
        Whether at least one is that turns over because it comes closer to another sheet of the input than to its own.
    """

    def __init__(self, points: Floats, cells: Faces) -> None:
        self._cells = cells
        vertices, self._faces, self._owners = fan_triangles(points, cells)
        self._surface = SurfaceLocator(vertices, self._faces)
        self._vectors = face_area_vectors(vertices, self._faces)
        self._corners = corner_incidences(self._faces, len(vertices))
        self._samples = samples(points, cells)
        # Where closest points were found last is where to look next.
        self._centre_faces = self._accepted_faces = np.arange(len(cells))
        # Nodes and edge midpoints of the input, and a face each lies on.
        ends = face_edges(self._faces)
        place = np.repeat(np.arange(len(self._faces)), 3)
        vertex, node = np.unique(self._faces.ravel(), return_index=True)
        edge = unique_edges(ends).first
        self._places = np.concatenate([vertices[self._faces.ravel()[node]], vertices[ends[edge]].mean(axis=1)])
        self._backward_faces = np.concatenate([place[node], place[edge]])
        self._nodes = vertex[vertex < len(points)]
        self._node_faces = place[node][: len(self._nodes)]
        self._distances = self._accepted = (
            np.zeros(len(cells)),
            np.zeros(len(self._places)),
            np.zeros(len(self._nodes)),
        )
        self.forbid_turning = self.forbid_sheet_change = False
        self._measured: Floats | None = None
        self._turned = self._accepted_turned = np.zeros(len(cells), dtype=bool)

    def distances(self, points: Floats) -> tuple[Floats, Floats]:
        """From samples (vertices, edge midpoints, centres) of a surface to the input, and from the input's to it."""
        there = self._surface.closest(samples(points, self._cells)).distances
        back = self._moved(points).closest(self._samples).distances
        return there, back

    def hausdorff(self, points: Floats) -> float:
        """Symmetric Hausdorff distance of the samples."""
        there, back = self.distances(points)
        return float(max(there.max(initial=0.0), back.max(initial=0.0)))

    def nodes_out_of_bounds(self, points: Floats, bound: float) -> NDArray[np.bool_]:
        """(n,) nodes of cells with samples farther than `bound` from the input, or closest to such samples of it."""
        result = np.zeros(len(points), dtype=bool)
        far = self._surface.closest(samples(points, self._cells)).distances > bound
        nodes, edges = self._cells.nodes(), edge_table(self._cells).nodes
        at, between, *inside = np.split(far, np.cumsum([len(nodes), len(edges)]))
        result[nodes[at]] = True
        result[edges[between]] = True
        there = self._moved(points).closest(self._samples)
        cells = np.concatenate(inside)
        cells[self._owners[there.faces[there.distances > bound]]] = True
        result[self._cells.corners_of(cells)] = True
        return result

    def cells_out_of_bounds(self, points: Floats, bound: float, still: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(m,) cells with centres or nodes farther than `bound` from the input, or closest to a part that is uncovered.

        Parameters
        ----------
        points
            (n, 3) the surface to measure.
        bound
            Largest distance.
        still
            (m,) cells of which no node moves by itself: they have a margin, since all move a little with the rest; so
            have all nodes.
        """
        found = self._closest_to_centres(points)
        ahead = found.distances
        self._backward_faces, behind, below = _walked(self._moved(points), self._places, self._backward_faces, bound)
        self._node_faces, above, _ = _walked(self._surface, points[self._nodes], self._node_faces, bound)
        self._distances = (ahead, behind, above)
        # What is out of bounds may stay there, but not go farther; what moves with the rest has a margin.
        limit = bound * (1 + _MARGIN * still)
        bad = ahead > np.maximum(limit, self._accepted[0])
        # A part of the input that no cell comes near counts against the closest cell.
        owners = self._owners[below]
        bad[owners[behind > np.maximum(limit[owners], self._accepted[1])]] = True
        out = np.zeros(len(points), dtype=bool)
        out[self._nodes] = above > np.maximum(bound * (1 + _MARGIN), self._accepted[2])
        bad |= self._cells.any_of(out)
        self._measured, self._turned = points, self._against(points, found)
        over = self._turned & ~self._accepted_turned
        if not self.forbid_turning:
            over = self._on_other_sheets(points, over) if self.forbid_sheet_change else np.zeros_like(over)
        return np.asarray(bad | over)

    def accept(self) -> None:
        """Go on from the surface that was measured last."""
        self._accepted, self._accepted_turned, self._accepted_faces = self._distances, self._turned, self._centre_faces

    @property
    def largest_distance(self) -> float:
        """Largest distance, both ways, of the surface that was accepted last, at the samples of a step."""
        return float(max(distances.max(initial=0.0) for distances in self._accepted))

    def turned_over(self, points: Floats) -> NDArray[np.bool_]:
        """(m,) cells whose normal points against the input's below their centre, on an edge against either side's."""
        return self._turned if points is self._measured else self._against(points, self._closest_to_centres(points))

    def _on_other_sheets(self, points: Floats, over: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(m,) cells turned over only because another sheet of the input is closest, not the one they came from."""
        ids = np.flatnonzero(over)
        below = self._surface.closest_by_walk(self._cells.centres(points)[ids], self._accepted_faces[ids])
        result = np.zeros_like(over)
        result[ids] = (face_area_vectors(points, self._cells)[ids] * self._vectors[below.faces]).sum(axis=1) > 0
        return result

    def _against(self, points: Floats, below: ClosestPoints) -> NDArray[np.bool_]:
        """(m,) cells whose normal points against that of the input, of which the closest points are given."""
        own = face_area_vectors(points, self._cells)
        turned = (own * self._vectors[below.faces]).sum(axis=1) <= 0
        # All facets that share the corners between which a place on an edge or at a node lies.
        offsets, incidences = self._corners
        cells = np.flatnonzero(below.weights.min(axis=1) < _ON_EDGE)
        nodes, near = self._faces[below.faces[cells]], below.weights[cells] >= _ON_EDGE
        first = nodes[np.arange(len(cells)), below.weights[cells].argmax(axis=1)]
        count = offsets[first + 1] - offsets[first]
        each = np.repeat(np.arange(len(cells)), count)
        facets = incidences[np.arange(count.sum()) + np.repeat(offsets[first] - count.cumsum() + count, count)] // 3
        shared = (self._faces[facets][:, :, None] == nodes[each][:, None, :]).any(axis=1) | ~near[each]
        against = shared.all(axis=1) & ((own[cells[each]] * self._vectors[facets]).sum(axis=1) <= 0)
        turned[cells[each[against]]] = True
        return np.asarray(turned)

    def _closest_to_centres(self, points: Floats) -> ClosestPoints:
        found = self._surface.closest(self._cells.centres(points), self._centre_faces)
        self._centre_faces = found.faces
        return found

    def _moved(self, points: Floats) -> SurfaceLocator:
        return self._surface.with_points(fan_triangles(points, self._cells)[0])


def _walked(surface: SurfaceLocator, places: Floats, start: Ints, bound: float) -> tuple[Ints, Floats, Ints]:
    """Faces where walks end; distances, exact beyond a bound, and the faces they are measured from."""
    found = surface.closest_by_walk(places, start)
    distances, faces = found.distances, found.faces.copy()
    far = np.flatnonzero(distances > bound)
    exact = surface.closest(places[far], faces[far])
    distances[far], faces[far] = exact.distances, exact.faces
    return found.faces, distances, faces


def corner_normals(points: Floats, faces: Ints, patches: Ints) -> Floats:
    """(f, 3, 3) normal of the patch at each corner of triangles: the same for all of a patch around a node."""
    vectors = face_area_vectors(points, faces)
    key = faces + len(points) * patches[:, None]
    _, inverse = np.unique(key.ravel(), return_inverse=True)
    weights = (np.repeat(vectors[:, i], 3) for i in range(3))
    sums = np.stack([np.bincount(inverse.ravel(), w).astype(np.float64) for w in weights], axis=1)
    return unit_vectors(sums)[inverse.ravel()].reshape(-1, 3, 3)


def samples(points: Floats, cells: Faces) -> Floats:
    """Nodes, edge midpoints and cell centres of a surface."""
    return np.concatenate([points[cells.nodes()], points[edge_table(cells).nodes].mean(axis=1), cells.centres(points)])
