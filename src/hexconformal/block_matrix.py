"""Sparse symmetric matrices of 3 x 3 blocks on the graph of a mesh, and a solver for them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .compiled import loop
from .sparsity import corner_incidences, find, node_pattern

__all__ = ["BlockMatrix", "cell_places"]

Field = NDArray[np.float64]


@loop
def _places(first, last, cells, indptr, indices, places):  # type: ignore[no-untyped-def]
    width = cells.shape[1]
    for c in range(first, last):
        for a in range(width):
            row = cells[c, a]
            for b in range(width):
                places[c, width * a + b] = find(indices, indptr[row], indptr[row + 1], cells[c, b])


def cell_places(cells: NDArray[np.int64], indptr: NDArray[np.int64], indices: NDArray[np.int32]) -> NDArray[np.int64]:
    """Where the blocks (a, b) of every cell are stored: (m, k * k) places in the compressed rows."""
    places = np.empty((len(cells), cells.shape[1] ** 2), np.int64)
    _places(0, len(cells), np.ascontiguousarray(cells), indptr, indices, places)
    return places


@dataclass
class BlockMatrix:
    """A symmetric matrix of 3 x 3 blocks in compressed rows.

    Attributes
    ----------
    indptr, indices
        (n + 1,) and (nnz,) pattern, columns ascending.
    data
        (nnz, 3, 3) blocks; fill them, then solve.
    """

    indptr: NDArray[np.int64]
    indices: NDArray[np.int32]
    data: Field = field(init=False)

    def __post_init__(self) -> None:
        self.data = np.zeros((len(self.indices), 3, 3))

    @classmethod
    def of_cells(cls, cells: NDArray[np.int64], count: int) -> BlockMatrix:
        """An empty matrix that joins the nodes of every cell."""
        return cls(*node_pattern(cells, *corner_incidences(cells, count)))

    def solve(
        self, rhs: Field, projectors: Field, tolerance: float, max_iterations: int, shift: float
    ) -> tuple[Field, int]:
        """Solve P A P x = P rhs by conjugate gradients, preconditioned by symmetric block Gauss-Seidel.

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
        """
        _project(self.indptr, self.indices, self.data, projectors, shift)
        b = np.einsum("nij,nj->ni", projectors, rhs)
        solution, iterations = _conjugate_gradients(self.indptr, self.indices, self.data, b, tolerance, max_iterations)
        return np.einsum("nij,nj->ni", projectors, solution), iterations


@loop
def _project(indptr, indices, data, projectors, shift):  # type: ignore[no-untyped-def]
    """Blocks become P_i A_ij P_j; the diagonal gets the shift, and what P takes away as an identity."""
    t = np.empty((3, 3))
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
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


@loop
def _inverse(data, k, out, i):  # type: ignore[no-untyped-def]
    """out[i] = data[k]^-1, or the inverse of its diagonal where it is not definite."""
    c0 = data[k, 1, 1] * data[k, 2, 2] - data[k, 1, 2] * data[k, 2, 1]
    c1 = data[k, 1, 2] * data[k, 2, 0] - data[k, 1, 0] * data[k, 2, 2]
    c2 = data[k, 1, 0] * data[k, 2, 1] - data[k, 1, 1] * data[k, 2, 0]
    det = data[k, 0, 0] * c0 + data[k, 0, 1] * c1 + data[k, 0, 2] * c2
    if det <= 0.0:
        for r in range(3):
            for c in range(3):
                out[i, r, c] = 1.0 / max(data[k, r, r], 1e-30) if r == c else 0.0
        return
    for r in range(3):
        r1, r2 = (r + 1) % 3, (r + 2) % 3
        for c in range(3):
            c1, c2 = (c + 1) % 3, (c + 2) % 3
            out[i, c, r] = (data[k, r1, c1] * data[k, r2, c2] - data[k, r1, c2] * data[k, r2, c1]) / det


@loop
def _sweep(indptr, indices, data, inverses, r, z):  # type: ignore[no-untyped-def]
    """z = M^-1 r, one symmetric block Gauss-Seidel sweep from zero."""
    n = len(indptr) - 1
    for i in range(n):
        a0, a1, a2 = r[i, 0], r[i, 1], r[i, 2]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if j >= i:
                break
            a0 -= data[k, 0, 0] * z[j, 0] + data[k, 0, 1] * z[j, 1] + data[k, 0, 2] * z[j, 2]
            a1 -= data[k, 1, 0] * z[j, 0] + data[k, 1, 1] * z[j, 1] + data[k, 1, 2] * z[j, 2]
            a2 -= data[k, 2, 0] * z[j, 0] + data[k, 2, 1] * z[j, 1] + data[k, 2, 2] * z[j, 2]
        for c in range(3):
            z[i, c] = inverses[i, c, 0] * a0 + inverses[i, c, 1] * a1 + inverses[i, c, 2] * a2
    for i in range(n - 1, -1, -1):
        a0, a1, a2 = 0.0, 0.0, 0.0
        for k in range(indptr[i + 1] - 1, indptr[i] - 1, -1):
            j = indices[k]
            if j <= i:
                break
            a0 += data[k, 0, 0] * z[j, 0] + data[k, 0, 1] * z[j, 1] + data[k, 0, 2] * z[j, 2]
            a1 += data[k, 1, 0] * z[j, 0] + data[k, 1, 1] * z[j, 1] + data[k, 1, 2] * z[j, 2]
            a2 += data[k, 2, 0] * z[j, 0] + data[k, 2, 1] * z[j, 1] + data[k, 2, 2] * z[j, 2]
        for c in range(3):
            z[i, c] -= inverses[i, c, 0] * a0 + inverses[i, c, 1] * a1 + inverses[i, c, 2] * a2


@loop
def _conjugate_gradients(indptr, indices, data, b, tolerance, max_iterations):  # type: ignore[no-untyped-def]
    n = len(indptr) - 1
    inverses = np.empty((n, 3, 3))
    for i in range(n):
        _inverse(data, find(indices, indptr[i], indptr[i + 1], i), inverses, i)
    x, p, q, z = np.zeros((n, 3)), np.zeros((n, 3)), np.empty((n, 3)), np.zeros((n, 3))
    r = b.copy()
    first = old = 1.0
    for iteration in range(max_iterations + 1):
        _sweep(indptr, indices, data, inverses, r, z)
        rz = (r * z).sum()
        if iteration == 0:
            first = rz
        if iteration == max_iterations or rz <= tolerance * tolerance * first or rz <= 0.0:
            return x, iteration
        beta = rz / old if iteration > 0 else 0.0
        old = rz
        curvature = 0.0
        for i in range(n):
            for c in range(3):
                p[i, c] = z[i, c] + beta * p[i, c]
        for i in range(n):
            a0, a1, a2 = 0.0, 0.0, 0.0
            for k in range(indptr[i], indptr[i + 1]):
                j = indices[k]
                a0 += data[k, 0, 0] * p[j, 0] + data[k, 0, 1] * p[j, 1] + data[k, 0, 2] * p[j, 2]
                a1 += data[k, 1, 0] * p[j, 0] + data[k, 1, 1] * p[j, 1] + data[k, 1, 2] * p[j, 2]
                a2 += data[k, 2, 0] * p[j, 0] + data[k, 2, 1] * p[j, 1] + data[k, 2, 2] * p[j, 2]
            q[i, 0], q[i, 1], q[i, 2] = a0, a1, a2
            curvature += a0 * p[i, 0] + a1 * p[i, 1] + a2 * p[i, 2]
        if curvature <= 0.0:
            return x, iteration
        step = rz / curvature
        for i in range(n):
            for c in range(3):
                x[i, c] += step * p[i, c]
                r[i, c] -= step * q[i, c]
    return x, max_iterations
