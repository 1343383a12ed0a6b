"""How near a surface is to the input, as an energy of its nodes.

Nodes may lie on the input and the cells between them far away, since these cut across what is curved. So distances are
those of places all over the cells; and, so that no cell leaves a part of the input uncovered, of places all over the
input. Equation (20a) of docs/mathematics.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from hexconformal.geometry import (
    ClosestPoints,
    EdgeTable,
    Faces,
    SurfaceLocator,
    edge_table,
    face_area_vectors,
    fan_triangles,
    unit_vectors,
)

from ..mesh import Floats, Ints

__all__ = ["Nearness"]

_SHARES = (0.25, 0.5, 0.75)  # where edges are looked at
_TINY = 1e-9  # a shorter distance has no direction


@dataclass(frozen=True, eq=False)
class _Measured:
    """The moved surface, what is closest to places on it and on the input, and the (p, 3) vectors from the input."""

    moved: SurfaceLocator
    ahead: ClosestPoints
    behind: ClosestPoints
    vectors: Floats


class Nearness:
    """The energy k/2 sum_p w_p (d_p^2 + d_p^4 / s^2) of the distances d_p of places p.

    Parameters
    ----------
    start, cells
        The input.
    points
        (n, 3) the surface that is measured first.
    stiffness, knee
        k and s: from s on a place counts more than its square.

    Attributes
    ----------
    stiffness
        k, which may change.
    """

    def __init__(self, start: Floats, cells: Faces, points: Floats, stiffness: float, knee: float) -> None:
        self.stiffness, self._knee, self._count = stiffness, knee, len(cells)
        vertices, faces, _ = fan_triangles(start, cells)
        self._input, self._fan = SurfaceLocator(vertices, faces), _fan(cells, len(start))
        moved, table = self._input.with_points(self._fan @ points), edge_table(faces)
        self._places = scipy.sparse.csr_array(_places(faces, table, len(vertices)) @ self._fan)
        # A face on which each place lies.
        owners = np.unique(faces, return_index=True)[1] // 3
        beside = np.unique(table.of_corners, return_index=True)[1] // 3
        self._owners = np.concatenate([owners, *[beside] * len(_SHARES), np.arange(len(faces))])
        # A cell of mean size has the weight 1.
        areas = [np.linalg.norm(face_area_vectors(x.points, faces), axis=1) for x in (moved, self._input)]
        weights = np.concatenate([_shared(area, faces, table) for area in areas])
        self._weights = weights * len(cells) / areas[1].sum()
        self._on_input = self._places @ start
        self._below = (
            self._first(moved, self._input, self._places @ points),
            self._first(self._input, moved, self._on_input),
        )

    def _first(self, this: SurfaceLocator, that: SurfaceLocator, places: Floats) -> Ints:
        """A face of one surface for each place on the other, from where to look for what is closest."""
        faces = that.closest(places, self._owners).faces
        own, other = (face_area_vectors(x.points, x.faces) for x in (this, that))
        across = (own[self._owners] * other[faces]).sum(axis=1) < 0
        # Behind a thin wall lies another sheet; a walk stays on its own.
        faces[across] = that.closest_by_walk(places[across], self._owners[across]).faces
        return faces

    def _measured(self, points: Floats) -> _Measured:
        moved, places = self._input.with_points(self._fan @ points), self._places @ points
        ahead = self._input.closest_by_walk(places, self._below[0])
        behind = moved.closest_by_walk(self._on_input, self._below[1])
        vectors = np.concatenate([places - ahead.positions, behind.positions - self._on_input])
        return _Measured(moved, ahead, behind, vectors)

    def mean_square(self, points: Floats) -> float:
        """Mean of d^2 + d^4 / s^2 over the places."""
        squares = (self._measured(points).vectors ** 2).sum(axis=1)
        return float((self._weights * (squares + squares**2 / self._knee**2)).sum() / self._weights.sum())

    def value(self, points: Floats) -> float:
        """The energy."""
        return 0.5 * self.stiffness * float(self._weights.sum()) * self.mean_square(points)

    def derivatives(self, points: Floats) -> tuple[Floats, scipy.sparse.csr_array]:
        """(n, 3) gradient, and (3 n, 3 n) second derivative, along the distances only.

        What is closest is looked for from here in what follows.
        """
        at = self._measured(points)
        self._below = at.ahead.faces, at.behind.faces
        rows, size = len(self._owners), len(self._input.points)
        corners = at.moved.faces[at.behind.faces]
        behind = scipy.sparse.csr_array(
            (at.behind.weights.ravel(), corners.ravel(), 3 * np.arange(rows + 1)), (rows, size)
        )
        matrix = scipy.sparse.csr_array(scipy.sparse.vstack([self._places, behind @ self._fan]))
        lengths = np.linalg.norm(at.vectors, axis=1)
        sides = [
            face_area_vectors(x.points, x.faces)[found.faces]
            for x, found in ((self._input, at.ahead), (at.moved, at.behind))
        ]
        normals = unit_vectors(np.where((lengths > _TINY)[:, None], at.vectors, np.concatenate(sides)))
        stiffness, relative = self.stiffness * self._weights, (lengths / self._knee) ** 2
        gradient = matrix.T @ ((stiffness * (1 + 2 * relative))[:, None] * at.vectors)
        # Rows of the derivatives of the distances, times the square root of their stiffness.
        factors = np.sqrt(stiffness * (1 + 6 * relative))[:, None] * normals
        entries = matrix.data[:, None] * np.repeat(factors, np.diff(matrix.indptr), axis=0)
        columns = 3 * matrix.indices[:, None] + np.arange(3)
        along = scipy.sparse.csr_array((entries.ravel(), columns.ravel(), 3 * matrix.indptr), (2 * rows, points.size))
        return np.asarray(gradient), scipy.sparse.csr_array(along.T @ along)


def _fan(cells: Faces, count: int) -> scipy.sparse.csr_array:
    """The nodes, and behind them the centres of the quadrilaterals, from the nodes."""
    q = len(cells.quads)
    weights = np.full(4 * q, 0.25), cells.quads.ravel(), 4 * np.arange(q + 1)
    return scipy.sparse.csr_array(
        scipy.sparse.vstack([scipy.sparse.eye_array(count, format="csr"), scipy.sparse.csr_array(weights, (q, count))])
    )


def _places(faces: Ints, table: EdgeTable, count: int) -> scipy.sparse.csr_array:
    """Places at the nodes, on the edges and in the centres of triangles, from their nodes."""
    node = scipy.sparse.eye_array(count, format="csr")
    first, second = node[table.nodes[:, 0]], node[table.nodes[:, 1]]
    on_edges = [(1 - share) * first + share * second for share in _SHARES]
    centres = (node[faces[:, 0]] + node[faces[:, 1]] + node[faces[:, 2]]) / 3
    return scipy.sparse.csr_array(scipy.sparse.vstack([node[np.unique(faces)], *on_edges, centres]))


def _shared(areas: Floats, faces: Ints, table: EdgeTable) -> Floats:
    """The area that each place stands for: triangles share theirs out evenly among the places on them."""
    share = areas / (4 + 3 * len(_SHARES))
    of_corners = np.repeat(share, 3)
    at_nodes = np.bincount(faces.ravel(), of_corners)[np.unique(faces)]
    on_edges = np.bincount(table.of_corners, of_corners)
    return np.concatenate([at_nodes, *[on_edges] * len(_SHARES), share])
