"""Sparse symmetric matrices of 3 x 3 blocks on the graph of a mesh, and a solver for them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..elements import FACES
from ..kernel import algebra, loop
from ..mesh import binary_search, corner_incidences, node_pattern

__all__ = ["BlockMatrix", "block_places"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@loop
def _places(cells, free, indptr, indices, places):  # type: ignore[no-untyped-def]
    for c in range(len(cells)):
        for a in range(8):
            for b in range(a + 1):
                row, column = max(cells[c, a], cells[c, b]), min(cells[c, a], cells[c, b])
                place = -1
                if free[row] and free[column]:
                    place = binary_search(indices, indptr[row], indptr[row + 1], column)
                    # The ends of a diagonal of the whole cell share no face.
                    place = place if indices[place] == column else -1
                places[c, a * (a + 1) // 2 + b] = place


def block_places(cells: Ints, free: NDArray[np.bool_], matrix: BlockMatrix) -> Ints:
    """Places (m, 36) in the matrix of the blocks of the pairs a >= b of every cell's nodes; -1 for none."""
    places = np.empty((len(cells), 36), np.int64)
    _places(cells, free, matrix.indptr, matrix.indices, places)
    return places


@dataclass
class BlockMatrix:
    """A symmetric matrix of 3 x 3 blocks: the lower triangle in compressed rows, the diagonal last in each.

    Attributes
    ----------
    indptr, indices
        (n + 1,) and (nnz,) pattern, columns ascending and not above the row; rows of held nodes are empty.
    data
        (nnz, 3, 3) blocks; fill them, then solve.
    """

    indptr: Ints
    indices: NDArray[np.int32]
    data: Field = field(init=False)

    def __post_init__(self) -> None:
        self.data = np.zeros((len(self.indices), 3, 3))

    @classmethod
    def of_cells(cls, cells: Ints, free: NDArray[np.bool_]) -> BlockMatrix:
        """An empty matrix that joins free nodes (n,) on a common face."""
        quads = np.ascontiguousarray(cells[:, FACES].reshape(-1, 4))
        indptr, indices = node_pattern(quads, *corner_incidences(quads, len(free)))
        rows = np.repeat(np.arange(len(free)), np.diff(indptr))
        kept = (indices <= rows) & free[indices] & free[rows]
        indptr = np.concatenate([[0], np.cumsum(np.bincount(rows[kept], minlength=len(free)))])
        return cls(indptr, indices[kept])

    def solve(
        self, rhs: Field, projectors: Field, tolerance: float, max_iterations: int, shift: float
    ) -> tuple[Field, int]:
        """Solve P A P x = P rhs by conjugate gradients, preconditioned by symmetric block Gauss-Seidel.

        Uses the blocks up: fill them anew before the next solve.

        Parameters
        ----------
        rhs
            (n, 3) right-hand side.
        projectors
            (n, 3, 3) orthogonal projections P onto the admissible directions of every node.
        tolerance
            Stop where |r| <= tolerance |rhs| in the norm of the preconditioner.
        max_iterations
            Stop after so many.
        shift
            Added to the diagonal blocks, relative to their trace.

        Returns
        -------
        (n, 3) admissible solution and the number of iterations. Stops early at a direction of no curvature.

        Notes
        -----
        Matrix and preconditioner share their triangles, so one forward and one backward substitution do for
        both (S. Eisenstat, Efficient implementation of a class of preconditioned conjugate gradient methods,
        SIAM J. Sci. Stat. Comput. 2 (1981)).
        """
        whole = (projectors == np.eye(3)).all(axis=(1, 2))
        _project(self.indptr, self.indices, self.data, projectors, whole, shift)
        b = np.einsum("nij,nj->ni", projectors, rhs)
        solution, iterations = _conjugate_gradients(self.indptr, self.indices, self.data, b, tolerance, max_iterations)
        return np.einsum("nij,nj->ni", projectors, solution), iterations


@loop
def _project(indptr, indices, data, projectors, whole, shift):  # type: ignore[no-untyped-def]
    """Blocks become P_i A_ij P_j; the diagonal gets the shift, and what P takes away as an identity."""
    t = np.empty((3, 3))
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if not (whole[i] and whole[j]):
                for r in range(3):
                    for c in range(3):
                        t[r, c] = 0.0
                        for a in range(3):
                            t[r, c] += data[k, r, a] * projectors[j, a, c]
                for r in range(3):
                    for c in range(3):
                        s = 0.0
                        for a in range(3):
                            s += projectors[i, r, a] * t[a, c]
                        data[k, r, c] = s
            if i == j:
                trace = (data[k, 0, 0] + data[k, 1, 1] + data[k, 2, 2]) / 3.0
                trace = trace if trace > 0.0 else 1.0
                for r in range(3):
                    for c in range(3):
                        data[k, r, c] += trace * ((1.0 if r == c else 0.0) - projectors[i, r, c])
                    data[k, r, r] += shift * trace + 1e-30


@algebra
def _inverse(data, k, out, i):  # type: ignore[no-untyped-def]
    """out[i] = data[k]^-1; where rounding has spoiled a block, its diagonal replaces it."""
    c0 = data[k, 1, 1] * data[k, 2, 2] - data[k, 1, 2] * data[k, 2, 1]
    c1 = data[k, 1, 2] * data[k, 2, 0] - data[k, 1, 0] * data[k, 2, 2]
    c2 = data[k, 1, 0] * data[k, 2, 1] - data[k, 1, 1] * data[k, 2, 0]
    det = data[k, 0, 0] * c0 + data[k, 0, 1] * c1 + data[k, 0, 2] * c2
    if det <= 0.0:
        for r in range(3):
            for c in range(3):
                data[k, r, c] = max(data[k, r, r], 1e-30) if r == c else 0.0
                out[i, r, c] = 1.0 / data[k, r, r] if r == c else 0.0
        return
    for r in range(3):
        r1, r2 = (r + 1) % 3, (r + 2) % 3
        for c in range(3):
            c1, c2 = (c + 1) % 3, (c + 2) % 3
            out[i, c, r] = (data[k, r1, c1] * data[k, r2, c2] - data[k, r1, c2] * data[k, r2, c1]) / det


@algebra
def _forward(indptr, indices, data, inverses, b, x):  # type: ignore[no-untyped-def]
    """Solve (D + L) x = b."""
    for i in range(len(indptr) - 1):
        a0, a1, a2 = b[i, 0], b[i, 1], b[i, 2]
        for k in range(indptr[i], indptr[i + 1] - 1):
            j = indices[k]
            a0 -= data[k, 0, 0] * x[j, 0] + data[k, 0, 1] * x[j, 1] + data[k, 0, 2] * x[j, 2]
            a1 -= data[k, 1, 0] * x[j, 0] + data[k, 1, 1] * x[j, 1] + data[k, 1, 2] * x[j, 2]
            a2 -= data[k, 2, 0] * x[j, 0] + data[k, 2, 1] * x[j, 1] + data[k, 2, 2] * x[j, 2]
        for c in range(3):
            x[i, c] = inverses[i, c, 0] * a0 + inverses[i, c, 1] * a1 + inverses[i, c, 2] * a2


@algebra
def _backward(indptr, indices, data, inverses, b, x):  # type: ignore[no-untyped-def]
    """Solve (D + L^T) x = b; b becomes D x."""
    for i in range(len(indptr) - 2, -1, -1):
        for c in range(3):
            x[i, c] = inverses[i, c, 0] * b[i, 0] + inverses[i, c, 1] * b[i, 1] + inverses[i, c, 2] * b[i, 2]
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        for k in range(indptr[i], indptr[i + 1] - 1):
            j = indices[k]
            b[j, 0] -= data[k, 0, 0] * x0 + data[k, 1, 0] * x1 + data[k, 2, 0] * x2
            b[j, 1] -= data[k, 0, 1] * x0 + data[k, 1, 1] * x1 + data[k, 2, 1] * x2
            b[j, 2] -= data[k, 0, 2] * x0 + data[k, 1, 2] * x1 + data[k, 2, 2] * x2


@loop
def _conjugate_gradients(indptr, indices, data, b, tolerance, max_iterations):  # type: ignore[no-untyped-def]
    """Of the matrix (D + L)^-1 A (D + L^T)^-1 = T + (D + L)^-1 (1 - D T), T = (D + L^T)^-1, in the metric D."""
    n = len(indptr) - 1
    inverses = np.zeros((n, 3, 3))
    for i in range(n):
        if indptr[i + 1] > indptr[i]:
            _inverse(data, indptr[i + 1] - 1, inverses, i)
    x, p, r = np.zeros((n, 3)), np.zeros((n, 3)), np.empty((n, 3))
    t, w, q = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    _forward(indptr, indices, data, inverses, b, r)
    first = old = 1.0
    for iteration in range(max_iterations + 1):
        rz = 0.0
        for i in range(n):
            if indptr[i + 1] > indptr[i]:
                k = indptr[i + 1] - 1
                for c in range(3):
                    w[i, c] = data[k, c, 0] * r[i, 0] + data[k, c, 1] * r[i, 1] + data[k, c, 2] * r[i, 2]
                    rz += w[i, c] * r[i, c]
            else:
                for c in range(3):
                    w[i, c] = 0.0
        if iteration == 0:
            first = rz
        if iteration == max_iterations or rz <= tolerance * tolerance * first or rz <= 0.0:
            return x, iteration
        beta = rz / old if iteration > 0 else 0.0
        old = rz
        for i in range(n):
            for c in range(3):
                p[i, c] = w[i, c] + beta * p[i, c]
                w[i, c] = p[i, c]
        _backward(indptr, indices, data, inverses, w, t)
        for i in range(n):
            for c in range(3):
                w[i, c] = p[i, c] - w[i, c]
        _forward(indptr, indices, data, inverses, w, q)
        curvature = 0.0
        for i in range(n):
            for c in range(3):
                q[i, c] += t[i, c]
                curvature += q[i, c] * p[i, c]
        if curvature <= 0.0:
            return x, iteration
        step = rz / curvature
        for i in range(n):
            for c in range(3):
                x[i, c] += step * t[i, c]
                r[i, c] -= step * q[i, c]
    return x, max_iterations
