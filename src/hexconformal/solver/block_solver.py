"""A solver for sparse symmetric matrices of 3 x 3 blocks in the admissible displacements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..energy import BlockMatrix
from ..kernel import algebra, loop
from .conjugate_gradients import conjugate_gradients
from .coupled_nodes import UNCOUPLED, CoupledNodes
from .space import SERIAL, Space

__all__ = ["BlockPreconditioner", "solve_blocks"]

Field = NDArray[np.float64]


def solve_blocks(
    matrix: BlockMatrix,
    rhs: Field,
    projectors: Field,
    tolerance: float,
    max_iterations: int,
    shift: float,
    space: Space = SERIAL,
    coupled: CoupledNodes = UNCOUPLED,
) -> Field:
    """Solve P A P x = P rhs by conjugate gradients, preconditioned by symmetric block Gauss-Seidel.

    Uses the blocks up: fill them anew before the next solve.

    Parameters
    ----------
    matrix
        The matrix A.
    rhs
        (n, 3) right-hand side.
    projectors
        (n, 3, 3) orthogonal projections P onto the admissible directions of every node.
    tolerance, max_iterations
        See :func:`hexconformal.solver.conjugate_gradients.conjugate_gradients`.
    shift
        Added to the diagonal blocks, relative to their trace.
    space
        Where the fields live.
    coupled
        Nodes that move together, with projections that are alike: T P A P T is what is solved then, T being the map
        from roots to all nodes.

    Returns
    -------
    (n, 3) admissible solution.

    Notes
    -----
    Matrix and preconditioner share their triangles, A = L + D + L^T. What is solved is

        (D + L)^-1 A (D + L^T)^-1 y = (D + L)^-1 rhs,    x = (D + L^T)^-1 y,

    preconditioned by D; since A = (D + L) + (D + L^T) - D, one forward and one backward substitution make a product
    (S. Eisenstat, Efficient implementation of a class of preconditioned conjugate gradient methods, SIAM J. Sci. Stat.
    Comput. 2 (1981)).
    """
    sweeps = BlockPreconditioner(matrix, projectors, shift, coupled)
    y = conjugate_gradients(sweeps.product, sweeps.scaled, sweeps.forward(rhs), tolerance, max_iterations, space)
    return sweeps.backward(y)


class BlockPreconditioner:
    """Symmetric block Gauss-Seidel: forward and backward substitution with P A P, shifted; uses the blocks up.

    Parameters
    ----------
    matrix
        The matrix A = L + D + L^T.
    projectors
        (n, 3, 3) orthogonal projections P onto the admissible directions.
    shift
        Added to the diagonal blocks, relative to their trace.
    coupled
        Nodes that move together: the matrix is condensed to their roots, where fields between `forward` and `backward`
        live.
    """

    def __init__(self, matrix: BlockMatrix, projectors: Field, shift: float, coupled: CoupledNodes = UNCOUPLED) -> None:
        matrix = coupled.condensed(matrix)
        whole = (projectors == np.eye(3)).all(axis=(1, 2))
        self._projectors, self._coupled = projectors, coupled
        _project(matrix.indptr, matrix.indices, matrix.data, projectors, whole, shift)
        self._inverses = np.zeros((len(projectors), 3, 3))
        _invert(matrix.indptr, matrix.data, self._inverses)
        self._rows = matrix.indptr, matrix.indices, matrix.data

    def __call__(self, gradient: Field) -> Field:
        """(D + L^T)^-1 D (D + L)^-1 times an admissible field (n, 3)."""
        return self.backward(self.scaled(self.forward(gradient)))

    def forward(self, field: Field) -> Field:
        """(D + L)^-1 P times a field (n, 3)."""
        out = np.empty_like(field)
        own = self._coupled.gathered(field)
        _forward(*self._rows, self._inverses, np.einsum("nij,nj->ni", self._projectors, own), out)
        return out

    def scaled(self, field: Field) -> Field:
        """D times a field (n, 3)."""
        out = np.empty_like(field)
        _scale(self._rows[0], self._rows[2], field, out)
        return out

    def backward(self, field: Field) -> Field:
        """P (D + L^T)^-1 times a field (n, 3)."""
        out = np.empty_like(field)
        _backward(*self._rows, self._inverses, field.copy(), out)
        return self._coupled.spread(np.einsum("nij,nj->ni", self._projectors, out))

    def product(self, field: Field) -> Field:
        """(D + L)^-1 A (D + L^T)^-1 times a field (n, 3)."""
        out = np.empty_like(field)
        _product(*self._rows, self._inverses, field, out)
        return out


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
def _substitute_forward(indptr, indices, data, inverses, b, x):  # type: ignore[no-untyped-def]
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
def _substitute_backward(indptr, indices, data, inverses, b, x):  # type: ignore[no-untyped-def]
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
def _invert(indptr, data, inverses):  # type: ignore[no-untyped-def]
    for i in range(len(indptr) - 1):
        if indptr[i + 1] > indptr[i]:
            _inverse(data, indptr[i + 1] - 1, inverses, i)


@loop
def _scale(indptr, data, x, out):  # type: ignore[no-untyped-def]
    """out = D x; zero in empty rows."""
    for i in range(len(indptr) - 1):
        k = indptr[i + 1] - 1
        for c in range(3):
            out[i, c] = 0.0
            if indptr[i + 1] > indptr[i]:
                out[i, c] = data[k, c, 0] * x[i, 0] + data[k, c, 1] * x[i, 1] + data[k, c, 2] * x[i, 2]


@loop
def _forward(indptr, indices, data, inverses, b, x):  # type: ignore[no-untyped-def]
    _substitute_forward(indptr, indices, data, inverses, b, x)


@loop
def _backward(indptr, indices, data, inverses, b, x):  # type: ignore[no-untyped-def]
    _substitute_backward(indptr, indices, data, inverses, b, x)


@loop
def _product(indptr, indices, data, inverses, p, out):  # type: ignore[no-untyped-def]
    """out = t + (D + L)^-1 (p - D t) with t = (D + L^T)^-1 p."""
    w, t = p.copy(), np.empty_like(p)
    _substitute_backward(indptr, indices, data, inverses, w, t)
    for i in range(len(p)):
        for c in range(3):
            w[i, c] = p[i, c] - w[i, c]
    _substitute_forward(indptr, indices, data, inverses, w, out)
    for i in range(len(p)):
        for c in range(3):
            out[i, c] += t[i, c]
