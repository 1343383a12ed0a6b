"""Nodes that move together: the displacement of each is that of one of them, turned."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ..energy import BlockMatrix
from ..kernel import loop

__all__ = ["UNCOUPLED", "CoupledNodes"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CoupledNodes:
    """Groups of nodes with displacements d_i = R_i d_root, a linear space; nodes in no group are free of each other.

    With T the map from the displacements of roots, and of nodes in no group, to all of them, T^T T is diagonal: the
    size of each group. So T (T^T T)^-1 T^T, the mean over a group, projects orthogonally, and T^T A T is the matrix
    that is left of A.

    Attributes
    ----------
    nodes
        (k,) ids of the nodes in groups, group by group, the root first in each.
    starts
        (g,) place of each root in `nodes`.
    rotations
        (k, 3, 3) orthogonal matrices R_i, those of roots the identity.
    normals
        (k, 3, 3) sums of n n^T over directions in which the nodes may not move, since a chain of couplings leads back
        to a node with another rotation: nodes on an axis.

    Examples
    --------
    >>> pair = CoupledNodes(np.array([0, 2]), np.array([0]), np.tile(np.eye(3), (2, 1, 1)), np.zeros((2, 3, 3)))
    >>> pair.averaged(np.array([[1.0, 0, 0], [5.0, 0, 0], [3.0, 0, 0]]))[:, 0]
    array([2., 5., 2.])
    """

    nodes: Ints
    starts: Ints
    rotations: Field
    normals: Field

    @cached_property
    def roots(self) -> Ints:
        """(k,) root of each node in a group."""
        return self.nodes[self.starts][self._groups]

    @cached_property
    def _sizes(self) -> Ints:
        return np.diff(np.append(self.starts, len(self.nodes)))

    @cached_property
    def _groups(self) -> Ints:
        return np.repeat(np.arange(len(self.starts)), self._sizes)

    # -------------------------------------------------------------------------------------------- fields
    def gathered(self, field: Field) -> Field:
        """T^T times a field (n, 3): roots have the sums of their groups, turned back, the other members zero."""
        if len(self.nodes) == 0:
            return field
        out = field.copy()
        out[self.nodes] = 0.0
        out[self.nodes[self.starts]] = self._sums(field)
        return out

    def spread(self, field: Field) -> Field:
        """T times a field (n, 3): every member has what its root has, turned."""
        return self._with_members(field, field[self.nodes[self.starts]])

    def averaged(self, field: Field) -> Field:
        """The orthogonal projection of a field (n, 3) onto the coupled ones: every member has the mean, turned."""
        if len(self.nodes) == 0:
            return field
        return self._with_members(field, self._sums(field) / self._sizes[:, None])

    def together(self, points: Field, start: Field) -> Field:
        """Points (n, 3) at which members have moved from the start as their roots have, to the last digit."""
        if len(self.nodes) == 0:
            return points
        out = points.copy()
        out[self.nodes] = (start + self.spread(points - start))[self.nodes]
        return out

    def _sums(self, field: Field) -> Field:
        return np.add.reduceat(np.einsum("kji,kj->ki", self.rotations, field[self.nodes]), self.starts)

    def _with_members(self, field: Field, of_roots: Field) -> Field:
        if len(self.nodes) == 0:
            return field
        out = field.copy()
        out[self.nodes] = np.einsum("kij,kj->ki", self.rotations, of_roots[self._groups])
        return out

    # ------------------------------------------------------------------------------------- values at nodes
    def least(self, values: NDArray[Any]) -> NDArray[Any]:
        """The values (n,), every member with the least of its group."""
        return self._reduced(np.minimum, values)

    def closed(self, nodes: Mask) -> Mask:
        """The nodes (n,), and all that are coupled to one of them."""
        return self._reduced(np.logical_or, nodes)

    def whole(self, nodes: Mask) -> Mask:
        """The nodes (n,) without groups of which only some members are among them."""
        return self._reduced(np.logical_and, nodes)

    def _reduced(self, operation: np.ufunc, values: NDArray[Any]) -> NDArray[Any]:
        if len(self.nodes) == 0:
            return values
        out = values.copy()
        out[self.nodes] = operation.reduceat(values[self.nodes], self.starts)[self._groups]
        return out

    def common_normals(self, sums: Field) -> Field:
        """Sums (n, 3, 3) of n n^T over what a whole group is forbidden, in the frame of each member."""
        if len(self.nodes) == 0:
            return sums
        own = np.einsum("kji,kjl,klm->kim", self.rotations, sums[self.nodes] + self.normals, self.rotations)
        out = sums.copy()
        out[self.nodes] = self._turned(np.add.reduceat(own, self.starts)[self._groups])
        return out

    def common_projectors(self, projectors: Field) -> Field:
        """Projectors (n, 3, 3), those of members that of their root, turned."""
        if len(self.nodes) == 0:
            return projectors
        out = projectors.copy()
        out[self.nodes] = self._turned(projectors[self.roots])
        return out

    def _turned(self, tensors: Field) -> Field:
        return np.asarray(np.einsum("kij,kjl,kml->kim", self.rotations, tensors, self.rotations))

    # ------------------------------------------------------------------------------------ parts, matrices
    def restricted(self, nodes: Mask, local: Ints) -> CoupledNodes:
        """The groups all of whose members are among some nodes (n,), with local ids (n,)."""
        return self._of_groups(nodes[self.nodes], local)

    def translated(self) -> CoupledNodes:
        """The groups of which no member is turned."""
        same = (self.rotations == np.eye(3)).all(axis=(1, 2))
        return self._of_groups(same, np.arange(self.nodes.max(initial=-1) + 1))

    def _of_groups(self, members: Mask, local: Ints) -> CoupledNodes:
        """The groups all of whose members (k,) are wanted."""
        if len(self.nodes) == 0:
            return self
        kept = np.logical_and.reduceat(members, self.starts)
        members, sizes = kept[self._groups], self._sizes[kept]
        starts = (np.cumsum(sizes) - sizes).astype(np.int64)
        return CoupledNodes(local[self.nodes[members]], starts, self.rotations[members], self.normals[members])

    def condensed_scalar(self, matrix: scipy.sparse.csr_matrix) -> scipy.sparse.csr_matrix:
        """T^T A T of a matrix (n, n) that is the same for all components, where no member is turned."""
        if len(self.nodes) == 0:
            return matrix
        columns = np.arange(matrix.shape[0])
        columns[self.nodes] = self.roots
        rows = np.arange(len(columns))
        spread = scipy.sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), shape=matrix.shape)
        return scipy.sparse.csr_matrix(spread.T @ matrix @ spread)

    def condensed(self, matrix: BlockMatrix) -> BlockMatrix:
        """T^T A T; the rows of members that are no roots are empty. The matrix itself, where there are no groups."""
        if len(self.nodes) == 0:
            return matrix
        count = len(matrix.indptr) - 1
        roots, rotations = np.arange(count), np.tile(np.eye(3), (count, 1, 1))
        roots[self.nodes], rotations[self.nodes] = self.roots, self.rotations
        rows = np.repeat(np.arange(count), np.diff(matrix.indptr))
        ends = np.sort(np.column_stack([roots[rows], roots[matrix.indices]]), axis=1)
        keys, places = np.unique(ends[:, 1] * count + ends[:, 0], return_inverse=True)
        indptr = np.concatenate([[0], np.cumsum(np.bincount(keys // count, minlength=count))]).astype(np.int64)
        left = BlockMatrix(indptr, (keys % count).astype(np.int32))
        _condense(rows, matrix.indices, matrix.data, roots, rotations, places.ravel(), left.data)
        return left


UNCOUPLED = CoupledNodes(np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 3, 3)), np.empty((0, 3, 3)))


@loop
def _condense(rows, columns, data, roots, rotations, places, out):  # type: ignore[no-untyped-def]
    """Add R_i^T A_ij R_j, or its transpose where the roots are in the other order, both where they are one."""
    half, block = np.empty((3, 3)), np.empty((3, 3))
    for k in range(len(rows)):
        i, j, place = rows[k], columns[k], places[k]
        for r in range(3):
            for c in range(3):
                half[r, c] = 0.0
                for a in range(3):
                    half[r, c] += data[k, r, a] * rotations[j, a, c]
        for r in range(3):
            for c in range(3):
                block[r, c] = 0.0
                for a in range(3):
                    block[r, c] += rotations[i, a, r] * half[a, c]
        for r in range(3):
            for c in range(3):
                if roots[i] > roots[j] or i == j:
                    out[place, r, c] += block[r, c]
                elif roots[i] < roots[j]:
                    out[place, r, c] += block[c, r]
                else:
                    out[place, r, c] += block[r, c] + block[c, r]
