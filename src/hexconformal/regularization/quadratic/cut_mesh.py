"""A mesh of quadratic cells as linear ones that are so small that their surface is its curved one.

Every place on a cell is a mean of its nodes, equation (13d). What the geometry of linear meshes is made of, faces,
features, interfaces and distances, so serves curved ones, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from operator import attrgetter

import numpy as np
import scipy
from numpy.typing import NDArray

from ...common import MeshError
from ...elements import CellParts, CellType, cell_parts, quadratic_shapes
from ...mesh import HexMesh, MixedMesh, boundary_quads, same_rows

__all__ = ["CutMesh", "Parts"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def _quadratics(nodes: Ints) -> Field:
    """(k, 6) the polynomials of second degree at some of the nine nodes."""
    i, j = (part.astype(np.float64) for part in np.divmod(nodes, 3))
    return np.stack([np.ones(len(i)), i, j, i * i, i * j, j * j], axis=1)


_DIGITS = 2.0**20  # shape functions are multiples of one over this where edges are cut into a power of two
_ROWS = 2**16  # nodes whose places are computed at a time

# Of the nine nodes of a square those of the triangle that is half of it, those beyond, and what these are of those.
_TRIANGLE, _BEYOND = np.array([0, 1, 2, 3, 4, 6]), np.array([5, 7, 8])
_CONTINUED = _quadratics(_BEYOND) @ np.linalg.inv(_quadratics(_TRIANGLE))


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of some faces, or edges, of cells, one face after the other.

    Attributes
    ----------
    nodes
        (p, j) their nodes.
    places
        (p, j, 2) where these are in the unit square of which the face is the image, a triangle that of the half at the
        origin; on edges the second is 0.
    grids
        (k, 3, 3) or (k, 3, 1) the nodes of each quadratic face, or edge; -1 where the half of a square has none.
    """

    nodes: Ints
    places: Field
    grids: Ints

    @property
    def each(self) -> int:
        """Number of parts of a face."""
        return len(self.nodes) // max(len(self.grids), 1)

    @property
    def halves(self) -> Mask:
        """(k,) faces that are triangles."""
        return np.asarray(self.grids[:, -1, -1] < 0)

    def grid_points(self, points: Field) -> Field:
        """(k, 3, 3, 3) or (k, 3, 1, 3) where the nodes of each face, or edge, are: of all squares.

        Beyond a triangle the polynomial goes on.
        """
        out, halves = points[self.grids], self.halves
        if halves.any():
            nodes = out.reshape(len(out), 9, 3)
            triangles = np.flatnonzero(halves)[:, None]
            nodes[triangles, _BEYOND] = _CONTINUED @ nodes[triangles, _TRIANGLE]
        return out

    def matching(self, rows: Ints) -> Ints:
        """(k,) the part that has the same nodes as each of some rows (k, j), in whatever order."""
        return same_rows(np.concatenate([self.nodes, rows]))[len(self.nodes) :]


class CutMesh:
    """A mesh of quadratic cells that are cut into n parts along each edge.

    Parameters
    ----------
    mesh
        Quadratic cells, and linear ones beside them.
    parts
        n, a power of two from 2 on, so that the nodes of the mesh are among those of the parts.

    Attributes
    ----------
    cells
        (p, 8) the parts, those of a cell one after the other, cells in the order of their places; other types than
        hexahedra collapsed.
    owners
        (p,) the cell that each is a part of.
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
        self.mesh, self.parts, size = mesh, parts, len(mesh.points)
        self._cut = [cell_parts(block.cell_type, parts) for block in mesh.blocks]
        # Places are the same where the same nodes have the same shares: sums that wrap around lose nothing.
        names = np.random.default_rng(0).integers(2**63, size=size, dtype=np.uint64)
        sums = []
        for block, cut in zip(mesh.blocks, self._cut, strict=True):
            shares = np.rint(_DIGITS * quadratic_shapes(cut.places, block.cell_type))
            sums.append(names[block.cells] @ shares.astype(np.int64).astype(np.uint64).T)
        every = np.concatenate([np.uint64(_DIGITS) * names, *(one.ravel() for one in sums)])
        _, first, which = np.unique(every, return_index=True, return_inverse=True)
        # Nodes of the mesh keep their numbers.
        further = np.flatnonzero(first >= size)
        numbers = np.where(first < size, first, 0)
        numbers[further] = size + np.arange(len(further))
        self._starts = size + np.cumsum([0, *(one.size for one in sums)])
        found = numbers[which.ravel()]
        self._ids = [
            found[start : start + one.size].reshape(one.shape) for start, one in zip(self._starts, sums, strict=False)
        ]
        self._further, self.count = first[further], size + len(further)
        owners = [np.repeat(one.places, len(cut.cells)) for one, cut in zip(mesh.blocks, self._cut, strict=True)]
        cells = [ids[:, cut.cells].reshape(-1, 8) for ids, cut in zip(self._ids, self._cut, strict=True)]
        order = np.argsort(np.concatenate(owners), kind="stable")
        self.owners, self.cells = np.concatenate(owners)[order], np.concatenate(cells)[order]
        if len(boundary_quads(self.cells)[0]) != len(boundary_quads(mesh.table)[0]) * parts**2:
            raise MeshError(
                "faces of cells do not fit, as neighbours have other nodes in their middles, or none: give all cells "
                "the same, or work on their corners, linearize=True (--linearize)"
            )

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
        first = self._further[nodes[others] - size]
        for block, cut, (start, end) in zip(self.mesh.blocks, self._cut, pairwise(self._starts), strict=True):
            mine = np.flatnonzero((first >= start) & (first < end))
            cells, places = np.divmod(first[mine] - start, len(cut.places))
            weights = quadratic_shapes(cut.places, block.cell_type)[places]
            rows.append(np.repeat(others[mine], weights.shape[1]))
            columns.append(block.cells[cells].ravel())
            shares.append(weights.ravel())
        entries = np.concatenate(shares), (np.concatenate(rows), np.concatenate(columns))
        matrix = scipy.sparse.csr_array(scipy.sparse.coo_array(entries, shape=(len(nodes), size)))
        matrix.eliminate_zeros()
        return matrix

    def faces(self, quads: Ints) -> Parts:
        """Parts of faces (k, 4) of cells that are given by their corners, triangles with their last twice: n^2 each."""
        return self._of(quads, lambda cell_type: np.array(cell_type.quads), attrgetter("faces", "on_faces"))

    def edges(self, pairs: Ints) -> Parts:
        """Parts of edges (k, 2) of cells that are given by their corners: n of each."""
        return self._of(pairs, lambda cell_type: cell_type.edges, attrgetter("edges", "on_edges"))

    def _of(
        self, wanted: Ints, table: Callable[[CellType], Ints], tables: Callable[[CellParts], tuple[Ints, Ints]]
    ) -> Parts:
        rows = [block.cells[:, table(block.cell_type)].reshape(-1, wanted.shape[1]) for block in self.mesh.blocks]
        ends = np.cumsum([len(one) for one in rows])
        found = same_rows(np.concatenate([*rows, wanted]))[ends[-1] :]
        which_block = np.searchsorted(ends, found, side="right")
        parts, on_all = tables(self._cut[0])
        nodes = np.empty((len(wanted), *parts.shape[1:]), dtype=np.int64)
        places = np.empty((*nodes.shape, 2))
        grids = np.empty((len(wanted), *on_all.shape[1:]), dtype=np.int64)
        for number, (cut, ids, own) in enumerate(zip(self._cut, self._ids, rows, strict=True)):
            mine = np.flatnonzero(which_block == number)
            parts, on_all = tables(cut)
            cells, which = np.divmod(found[mine] - ends[number] + len(own), len(parts))
            grid = on_all[which]
            nodes[mine] = ids[cells[:, None, None], parts[which]]
            grids[mine] = np.where(grid < 0, -1, ids[cells[:, None, None], grid])
            # Coordinates on a face run along the first and the last line of its grid.
            origin = cut.reference[grid[:, 0, 0]]
            along = np.stack([cut.reference[grid[:, -1, 0]], cut.reference[grid[:, 0, -1]]], axis=1) - origin[:, None]
            away = cut.reference[parts[which]] - origin[:, None, None]
            places[mine] = np.rint(self.parts * np.einsum("kpjr,krd->kpjd", away, np.linalg.pinv(along))) / self.parts
        return Parts(nodes.reshape(-1, nodes.shape[2]), places.reshape(-1, nodes.shape[2], 2), grids)
