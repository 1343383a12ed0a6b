"""A mesh of quadratic hexahedra as linear ones that are so small that their surface is its curved one.

Every place on a cell is a mean of its nodes, equation (13d). What the geometry of linear meshes is made of, faces,
features, interfaces and distances, so serves curved ones, too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from ...common import MeshError
from ...elements import EDGES, FACES, CellType, cell_parts, quadratic_shapes
from ...mesh import HexMesh, MixedMesh, boundary_quads, same_rows

__all__ = ["CutMesh", "Parts"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_DIGITS = 2.0**20  # shape functions are multiples of one over this where edges are cut into a power of two
_ROWS = 2**16  # nodes whose places are computed at a time


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of some faces, or edges, of cells, one face after the other.

    Attributes
    ----------
    nodes
        (p, j) their nodes.
    places
        (p, j, 2) where these are in the unit square of which the face is the image; on edges the second is 0.
    grids
        (k, 3, 3) or (k, 3, 1) the nodes of each quadratic face, or edge.
    """

    nodes: Ints
    places: Field
    grids: Ints

    @property
    def each(self) -> int:
        """Number of parts of a face."""
        return len(self.nodes) // max(len(self.grids), 1)

    def matching(self, rows: Ints) -> Ints:
        """(k,) the part that has the same nodes as each of some rows (k, j), in whatever order."""
        return same_rows(np.concatenate([self.nodes, rows]))[len(self.nodes) :]


class CutMesh:
    """A mesh of quadratic hexahedra that are cut into n parts along each edge.

    Parameters
    ----------
    mesh
        Quadratic hexahedra alone.
    parts
        n, a power of two from 2 on, so that the nodes of the mesh are among those of the parts.

    Attributes
    ----------
    cells
        (m n^3, 8) the parts, those of a cell one after the other, cells in the order of their places.
    count
        Number of nodes: first those of the mesh, then further ones.

    Raises
    ------
    MeshError
        If neighbours have other nodes in the middles of their faces and edges.

    Examples
    --------
    >>> from hexconformal import elevated
    >>> from hexconformal.generate import box
    >>> cut = CutMesh(elevated(box((2, 1, 1)), 20), 2)
    >>> cut.cells.shape, cut.count, len(cut.linear().points)
    ((16, 8), 45, 45)
    """

    def __init__(self, mesh: MixedMesh, parts: int) -> None:
        self.mesh, self._parts = mesh, cell_parts(parts)
        size, count = len(mesh.points), sum(len(block.cells) for block in mesh.blocks)
        # Places are the same where the same nodes have the same shares: sums that wrap around lose nothing.
        names = np.random.default_rng(0).integers(2**63, size=size, dtype=np.uint64)
        sums = np.empty((count, len(self._parts.places)), dtype=np.uint64)
        for block in mesh.blocks:
            shares = np.rint(_DIGITS * self._shapes(block.cell_type)).astype(np.int64).astype(np.uint64)
            sums[block.places] = names[block.cells] @ shares.T
        every = np.concatenate([np.uint64(_DIGITS) * names, sums.ravel()])
        _, first, which = np.unique(every, return_index=True, return_inverse=True)
        # Nodes of the mesh keep their numbers.
        further = np.flatnonzero(first >= size)
        numbers = np.where(first < size, first, 0)
        numbers[further] = size + np.arange(len(further))
        self._ids = numbers[which.ravel()[size:]].reshape(sums.shape)
        self._further, self.count = first[further] - size, size + len(further)
        self.cells = self._ids[:, self._parts.cells].reshape(-1, 8)
        if len(boundary_quads(self.cells)[0]) != len(boundary_quads(mesh.table)[0]) * self._parts.faces.shape[1]:
            raise MeshError(
                "faces of cells do not fit, as neighbours have other nodes in their middles, or none: give all cells "
                "the same, or work on their corners, linearize=True (--linearize)"
            )

    @property
    def per_cell(self) -> int:
        """Number of parts of a cell."""
        return len(self._parts.cells)

    def linear(self) -> HexMesh:
        """The parts as a mesh of linear hexahedra, the nodes of which have the names that the file gives them."""
        return HexMesh(self.places(self.mesh.points), self.cells, origin=self.mesh.origin)

    def places(self, points: Field) -> Field:
        """(count, 3) where all nodes are if those of the mesh are at points (n, 3)."""
        out = np.empty((self.count, 3))
        out[: len(points)] = points
        for start in range(len(points), self.count, _ROWS):
            some = np.arange(start, min(start + _ROWS, self.count))
            out[some] = self.matrix(some) @ points
        return out

    def matrix(self, nodes: Ints) -> scipy.sparse.csr_array:
        """(k, n) shares of the nodes of the mesh in some nodes (k,) of the parts."""
        size = len(self.mesh.points)
        own, others = np.flatnonzero(nodes < size), np.flatnonzero(nodes >= size)
        rows, columns, shares = [own], [nodes[own]], [np.ones(len(own))]
        cells, places = np.divmod(self._further[nodes[others] - size], len(self._parts.places))
        for block in self.mesh.blocks:
            row_of = np.full(len(self._ids), -1)
            row_of[block.places] = np.arange(len(block.cells))
            mine = np.flatnonzero(row_of[cells] >= 0)
            weights = self._shapes(block.cell_type)[places[mine]]
            rows.append(np.repeat(others[mine], weights.shape[1]))
            columns.append(block.cells[row_of[cells[mine]]].ravel())
            shares.append(weights.ravel())
        entries = np.concatenate(shares), (np.concatenate(rows), np.concatenate(columns))
        matrix = scipy.sparse.csr_array(scipy.sparse.coo_array(entries, shape=(len(nodes), size)))
        matrix.eliminate_zeros()
        return matrix

    def faces(self, quads: Ints) -> Parts:
        """Parts of faces (k, 4) of cells that are given by their corners: n^2 of each."""
        return self._of(quads, FACES, self._parts.faces, self._parts.on_faces)

    def edges(self, pairs: Ints) -> Parts:
        """Parts of edges (k, 2) of cells that are given by their corners: n of each."""
        return self._of(pairs, EDGES, self._parts.edges, self._parts.on_edges)

    def _of(self, wanted: Ints, table: Ints, parts: Ints, grids: Ints) -> Parts:
        known = self.mesh.table[:, table].reshape(-1, table.shape[1])
        cells, which = np.divmod(same_rows(np.concatenate([known, wanted]))[len(known) :], len(table))
        grid, size = grids[which], parts.shape[2]
        # Coordinates on a face run along the first and the last line of its grid.
        origin = self._parts.places[grid[:, 0, 0]]
        along = np.stack([self._parts.places[grid[:, -1, 0]], self._parts.places[grid[:, 0, -1]]], axis=1)
        away = self._parts.places[parts[which]] - origin[:, None, None]
        places = np.einsum("kpjr,kdr->kpjd", away, along - origin[:, None])
        nodes = self._ids[cells[:, None, None], parts[which]]
        return Parts(nodes.reshape(-1, size), places.reshape(-1, size, 2), self._ids[cells[:, None, None], grid])

    def _shapes(self, cell_type: CellType) -> Field:
        return quadratic_shapes(self._parts.places, cell_type)
