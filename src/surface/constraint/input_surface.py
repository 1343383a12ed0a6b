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
    faces_beyond,
    fan_triangles,
    hausdorff,
    mean_distance,
    unit_vectors,
)
from hexconformal.mesh import corner_incidences

from ..mesh import Floats, Ints
from .interfaces import Interfaces

__all__ = ["InputSurface", "corner_normals"]

_MARGIN = 0.08  # of the bound
_ACCURACY, _TOLERANCE = 1e-3, 2e-5  # of distances between all places: relative, or in diagonals, what is more
# Where edges of the input are looked at, and how much more than the bound is left there: the quarters are for edges so
# long that more than their midpoints may be uncovered.
_ON_EDGES = ((0.5, 1.0), (0.25, 1.08), (0.75, 1.08))
_ON_EDGE = 1e-7  # weight of a corner below which a place lies on the edge opposite


class InputSurface:
    """The input surface, to measure others against.

    Parameters
    ----------
    points, cells
        The input.
    interfaces
        Lines between its regions, to measure those of others against: on a smooth surface nothing else tells where they
        are.

    Attributes
    ----------
    forbid_turning
        Whether a cell is out of bounds, too, that turns over.
    forbid_sheet_change
        Whether at least one is that turns over because it comes closer to another sheet of the input than to its own.
    """

    def __init__(self, points: Floats, cells: Faces, interfaces: Interfaces | None = None) -> None:
        self._points, self._cells = points, cells
        interfaces = Interfaces() if interfaces is None else interfaces
        # An edge is a triangle that has one of its nodes twice.
        lines, self._beside_lines = interfaces.edges[:, [0, 1, 1]], interfaces.sides
        self._lines = SurfaceLocator(points, lines) if len(lines) else None
        self._tolerance = _TOLERANCE * float(np.linalg.norm(np.ptp(points[cells.nodes()], axis=0)))
        vertices, self._faces, self._owners = fan_triangles(points, cells)
        self._surface = SurfaceLocator(vertices, self._faces)
        self._vectors = face_area_vectors(vertices, self._faces)
        self._corners = corner_incidences(self._faces, len(vertices))
        # Where closest points were found last is where to look next.
        self._centre_faces = self._accepted_faces = np.arange(len(cells))
        # Nodes of the input, places on its edges, a face on which each lies, and what share of the bound holds there.
        node = np.unique(self._faces, return_index=True)[1]
        edges = edge_table(self._faces)
        beside = np.unique(edges.of_corners, return_index=True)[1] // 3
        a, b = np.moveaxis(vertices[edges.nodes], 1, 0)
        on_edges = [(1 - share) * a + share * b for share, _ in _ON_EDGES]
        self._places = np.concatenate([vertices[self._faces.ravel()[node]], *on_edges])
        self._backward_faces = np.concatenate([node // 3, *([beside] * len(_ON_EDGES))])
        self._room = np.repeat([1.0, *(room for _, room in _ON_EDGES)], [len(node), *([len(a)] * len(_ON_EDGES))])
        self._nodes = self._faces.ravel()[node]
        self._nodes = self._nodes[self._nodes < len(points)]
        self._node_faces = self._backward_faces[: len(self._nodes)]
        self._distances = self._accepted = (
            np.zeros(len(cells)),
            np.zeros(len(self._places)),
            np.zeros(len(self._nodes)),
        )
        self.forbid_turning = self.forbid_sheet_change = False
        self._measured: Floats | None = None
        self._turned = self._accepted_turned = np.zeros(len(cells), dtype=bool)

    def hausdorff(self, points: Floats) -> float:
        """Hausdorff distance of a surface from the input, both ways, and of the lines between its regions."""
        of_surface = hausdorff(points, self._points, self._cells, self._tolerance, relative=_ACCURACY)
        if self._lines is None:
            return of_surface
        return max(of_surface, hausdorff(points, self._points, self._lines.faces, self._tolerance, relative=_ACCURACY))

    def mean_distance(self, points: Floats) -> float:
        """Mean distance between a surface and the input, of both directions."""
        return mean_distance(self._moved(points), self._surface, near=True)

    def cells_beyond(self, points: Floats, bound: float) -> NDArray[np.bool_]:
        """(m,) cells with places farther than `bound` from the input, or closest to such places of it; lines alike."""
        own = np.arange(len(self._cells))
        moved, given = (SurfaceLocator(x, self._cells.table) for x in (points, self._points))
        beyond = faces_beyond(moved, given, bound, (own, own), self._tolerance)
        return np.asarray(beyond | self._beside_lines_beyond(points, bound))

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
        bad[owners[behind > np.maximum(self._room * limit[owners], self._accepted[1])]] = True
        out = np.zeros(len(points), dtype=bool)
        out[self._nodes] = above > np.maximum(bound * (1 + _MARGIN), self._accepted[2])
        bad |= self._cells.any_of(out)
        self._measured, self._turned = points, self._against(points, found)
        over = self._turned & ~self._accepted_turned
        if not self.forbid_turning:
            over = self._on_other_sheets(points, over) if self.forbid_sheet_change else np.zeros_like(over)
        return np.asarray(bad | over | self._beside_lines_beyond(points, bound))

    def _beside_lines_beyond(self, points: Floats, bound: float) -> NDArray[np.bool_]:
        """(m,) cells beside lines that are farther than `bound` from those of the input, or leave them uncovered.

        There are few edges of lines, so they are measured between all places at once.
        """
        result = np.zeros(len(self._cells), dtype=bool)
        if self._lines is not None:
            moved, own = SurfaceLocator(points, self._lines.faces), np.arange(len(self._lines.faces))
            beyond = faces_beyond(moved, self._lines, bound, (own, own), self._tolerance)
            result[self._beside_lines[beyond]] = True
        return result

    def accept(self) -> None:
        """Go on from the surface that was measured last."""
        self._accepted, self._accepted_turned, self._accepted_faces = self._distances, self._turned, self._centre_faces

    @property
    def largest_distance(self) -> float:
        """Largest distance, both ways, of the surface that was accepted last, at the samples of a step."""
        return float(max(distances.max(initial=0.0) for distances in self._accepted))

    @property
    def centre_distance(self) -> float:
        """Root mean square distance of the centres of the cells of that surface."""
        return float(np.sqrt((self._accepted[0] ** 2).mean()))

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
    if len(far):  # without any, the tree of the surface need not be made
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
