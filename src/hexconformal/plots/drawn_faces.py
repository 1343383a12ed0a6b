"""Faces as they are drawn: in pieces as small as their curvature asks for, with their edges as curves.

Faces of all types of cells are squares, mapped into space by the shape functions of their cell; triangles are squares
two of whose corners are one node. Straight faces are one piece.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..elements import CellType, in_cube, quadratic_shapes
from ..mesh import CellBlock, boundary_quads, collapsed_table, face_edges, unique_edges

__all__ = ["DrawnFaces", "faces_of_cells", "outer_faces"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])  # of a face, in the square
_TOLERANCE = 5e-4  # half a pixel of pictures of 1100
_MOST_PIECES = 12  # along an edge: nodes of tangled meshes are anywhere, and more pieces tell no more of them


@dataclass(frozen=True, eq=False)
class DrawnFaces:
    """Faces, each in pieces of its own.

    Attributes
    ----------
    points
        (f, s, 3) places on each face: a lattice with the same number of pieces along every edge, row by row.
    corners
        (f, 4) nodes of each face, triangles with one of them twice.
    owners
        (f,) cell that each face belongs to.
    """

    points: Floats
    corners: Ints
    owners: Ints

    @classmethod
    def straight(cls, points: Floats, corners: Ints) -> DrawnFaces:
        """Faces with corners (f, 4) among points (n, 3), one piece each, that belong to nothing but themselves."""
        return cls(points[corners[:, [0, 1, 3, 2]]], corners, np.arange(len(corners)))

    @property
    def steps(self) -> int:
        """Pieces along an edge."""
        return round(self.points.shape[1] ** 0.5) - 1

    def pieces(self) -> Ints:
        """(f steps^2, 4) the pieces, face by face, by numbers of points."""
        n = self.steps
        first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
        of_face = first[:, None] + np.array([0, 1, n + 2, n + 1])
        return (self._first[:, None, None] + of_face).reshape(-1, 4)

    def edges(self, different: Ints | None = None) -> Ints:
        """(e, steps + 1) edges between corners, each once, by numbers of points.

        With values of the faces (f,) those edges alone whose faces have different ones.
        """
        pairs = face_edges(self.corners)
        found = unique_edges(pairs)
        shown = found.nodes[:, 0] != found.nodes[:, 1]  # a triangle has a side of no length
        if different is not None:
            of_pairs = np.repeat(different, 4)
            differs = of_pairs != of_pairs[found.first][found.of_pairs]
            shown &= np.bincount(found.of_pairs[differs], minlength=len(shown)) > 0
        faces, sides = np.divmod(found.first[shown], 4)
        n = self.steps
        along = np.arange(n + 1)
        of_sides = np.array([along, along * (n + 1) + n, n * (n + 2) - along, (n - along) * (n + 1)])
        return self._first[faces][:, None] + of_sides[sides]

    @property
    def _first(self) -> Ints:
        return np.arange(len(self.points)) * self.points.shape[1]


def outer_faces(points: Floats, blocks: Sequence[CellBlock], kept: Mask, tolerance: float = _TOLERANCE) -> DrawnFaces:
    """The faces that belong to one of the kept cells only.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    blocks
        The cells by their type.
    kept
        (m,) which of them are there.
    tolerance
        How far pieces may be from the curved faces, as a share of the diagonal of the box around their corners; further
        only where cells are curved beyond all measure.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON20
    >>> bent = HEXAHEDRON20.ideal.copy()
    >>> bent[16:, 0] += 0.1  # the middles of all vertical edges
    >>> cell = CellBlock(HEXAHEDRON20, np.arange(20)[None], np.arange(1))
    >>> faces = outer_faces(bent, [cell], np.ones(1, dtype=bool), 0.01)
    >>> faces.steps, faces.pieces().shape, faces.edges().shape
    (4, (96, 4), (12, 5))
    """
    corners, owners = boundary_quads(collapsed_table(blocks)[kept])
    return faces_of_cells(points, blocks, corners, np.flatnonzero(kept)[owners], tolerance)


def faces_of_cells(
    points: Floats, blocks: Sequence[CellBlock], corners: Ints, owners: Ints, tolerance: float = _TOLERANCE
) -> DrawnFaces:
    """Some faces, with corners (f, 4), of the cells (f,) that own them; see :func:`outer_faces`."""
    lattice = _on_lattice(points, blocks, corners, owners, 2).reshape(-1, 3, 3, 3)
    # By so much a chord misses what is quadratic along it; half as long, a quarter of that.
    bends = [np.linalg.norm(np.diff(lattice, 2, axis=axis), axis=-1).max(initial=0.0) / 2 for axis in (1, 2)]
    allowed = tolerance * np.linalg.norm(np.ptp(points[corners].reshape(-1, 3), axis=0)) if len(corners) else 1.0
    wanted = np.sqrt(np.divide(sum(bends), allowed)) if allowed > 0.0 else 1.0
    steps = int(np.ceil(np.clip(np.nan_to_num(wanted), 1.0, _MOST_PIECES) - 1e-9))
    return DrawnFaces(_on_lattice(points, blocks, corners, owners, steps), corners, owners)


def _on_lattice(points: Floats, blocks: Sequence[CellBlock], corners: Ints, owners: Ints, steps: int) -> Floats:
    """(f, (steps + 1)^2, 3) places on each face."""
    t = np.linspace(0.0, 1.0, steps + 1)
    square = np.stack(np.meshgrid(t, t), axis=-1).reshape(-1, 1, 2)
    weights = np.where(_CORNERS, square, 1.0 - square).prod(axis=2)
    out = np.empty((len(corners), len(weights), 3))
    for block in blocks:
        rows_of = np.full(int(owners.max(initial=-1)) + 1, -1)
        mine = block.places < len(rows_of)
        rows_of[block.places[mine]] = np.flatnonzero(mine)
        faces = np.flatnonzero(rows_of[owners] >= 0)
        cells = block.cells[rows_of[owners[faces]]]
        # Of each cell a face has the corners at one of a few sets of places.
        local = (corners[faces][:, :, None] == cells[:, None]).argmax(axis=2)
        for places in np.unique(local, axis=0):
            alike = (local == places).all(axis=1)
            nodes = points[cells[alike]]
            out[faces[alike]] = np.einsum("qk,fki->fqi", _shapes(block.cell_type, places, weights), nodes)
    return out


def _shapes(cell_type: CellType, corners: Ints, weights: Floats) -> Floats:
    """(q, k) shape functions of a type where a face with such corners has these weights (q, 4)."""
    if cell_type.straight:
        return quadratic_shapes(in_cube(weights @ cell_type.reference_corners[corners], cell_type), cell_type)
    return weights @ np.eye(len(cell_type.nodes))[corners]
