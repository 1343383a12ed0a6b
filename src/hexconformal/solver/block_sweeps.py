"""Symmetric block Gauss-Seidel for sparse symmetric matrices of 3 x 3 blocks in the admissible displacements."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..energy import BlockMatrix
from ..kernel import algebra, loop, parallel_ranges
from .coupled_nodes import UNCOUPLED, CoupledNodes
from .row_parts import RowParts

__all__ = ["BlockPreconditioner", "block_norm"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


class BlockPreconditioner:
    """Symmetric block Gauss-Seidel in parts: substitutions with P A P, shifted; uses the blocks up.

    Parameters
    ----------
    matrix
        The matrix A = L + D + L^T + R.
    projectors
        (n, 3, 3) orthogonal projections P onto the admissible directions.
    shift
        Added to the diagonal blocks, relative to their trace.
    coupled
        Nodes that move together: the matrix is condensed to their roots, where fields between `forward` and `backward`
        live.
    beside
        (n,) what is added to the diagonal blocks besides E, for blocks that join rows with others elsewhere.
    """

    def __init__(
        self,
        matrix: BlockMatrix,
        projectors: Field,
        shift: float,
        coupled: CoupledNodes = UNCOUPLED,
        beside: Field | None = None,
    ) -> None:
        matrix = coupled.condensed(matrix)
        self._projectors, self._coupled = projectors, coupled
        count = len(projectors)
        whole = np.empty(count, dtype=bool)
        parallel_ranges(_find_whole, count, projectors, whole)
        parallel_ranges(_project, count, matrix.indptr, matrix.indices, matrix.data, projectors, whole, shift)
        self._parts = parts = RowParts.of(matrix.indptr, matrix.indices)
        self._between = parts.offsets, parts.rows, parts.places
        self._added = np.zeros(count) if beside is None else beside.copy()
        self._diagonal, inverses = np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
        parallel_ranges(_add_between, count, matrix.indptr, matrix.data, parts.inner, *self._between, self._added)
        parallel_ranges(_invert, count, matrix.indptr, matrix.data, inverses, self._diagonal)
        self._rows = matrix.indptr, matrix.indices, matrix.data, inverses

    def __call__(self, gradient: Field) -> Field:
        """(E + L^T)^-1 E (E + L)^-1 times an admissible field (n, 3)."""
        return self.backward(self.scaled(self.forward(gradient)))

    def forward(self, field: Field) -> Field:
        """(E + L)^-1 P times a field (n, 3)."""
        out = np.empty_like(field)
        self._in_parts(_forward, _applied(self._projectors, self._coupled.gathered(field)), out)
        return out

    def scaled(self, field: Field) -> Field:
        """E times a field (n, 3)."""
        return _applied(self._diagonal, field)

    def backward(self, field: Field) -> Field:
        """P (E + L^T)^-1 times a field (n, 3)."""
        out = np.empty_like(field)
        self._in_parts(_backward, field.copy(), out)
        return self._coupled.spread(_applied(self._projectors, out))

    def product(self, field: Field) -> Field:
        """(E + L)^-1 A (E + L^T)^-1 times a field (n, 3)."""
        left, t, out = field.copy(), np.empty_like(field), np.empty_like(field)
        self._in_parts(_backward, left, t)
        self._in_parts(_forward_between, *self._between, self._added, field, left, t, out)
        return out

    def _in_parts(self, function: Callable[..., None], *fields: NDArray[Any]) -> None:
        bounds = self._parts.bounds
        parallel_ranges(function, len(bounds) - 1, bounds, self._parts.inner, *self._rows, *fields, smallest=1)


@loop
def _find_whole(first, last, projectors, whole):  # type: ignore[no-untyped-def]
    """Rows whose projection is the identity."""
    for i in range(first, last):
        whole[i] = True
        for r in range(3):
            for c in range(3):
                whole[i] &= projectors[i, r, c] == (1.0 if r == c else 0.0)


@loop
def _project(first, last, indptr, indices, data, projectors, whole, shift):  # type: ignore[no-untyped-def]
    """Blocks become P_i A_ij P_j; the diagonal gets the shift, and what P takes away as an identity."""
    t = np.empty((3, 3))
    for i in range(first, last):
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
def block_norm(data, k):  # type: ignore[no-untyped-def]
    """Frobenius norm of data[k]."""
    square = 0.0
    for r in range(3):
        for c in range(3):
            square += data[k, r, c] * data[k, r, c]
    return np.sqrt(square)


@loop
def _add_between(first, last, indptr, data, inner, offsets, rows, places, added):  # type: ignore[no-untyped-def]
    """Add to each diagonal block half of the norms of the blocks that join its row with other parts."""
    for i in range(first, last):
        for k in range(indptr[i], inner[i]):
            added[i] += 0.5 * block_norm(data, k)
        for n in range(offsets[i], offsets[i + 1]):
            added[i] += 0.5 * block_norm(data, places[n])
        if indptr[i + 1] > indptr[i]:
            for r in range(3):
                data[indptr[i + 1] - 1, r, r] += added[i]


@loop
def _invert(first, last, indptr, data, inverses, diagonal):  # type: ignore[no-untyped-def]
    """Inverses of the diagonal blocks, and these in one array; zero in empty rows."""
    for i in range(first, last):
        if indptr[i + 1] > indptr[i]:
            _inverse(data, indptr[i + 1] - 1, inverses, i)
            for r in range(3):
                for c in range(3):
                    diagonal[i, r, c] = data[indptr[i + 1] - 1, r, c]


def _applied(blocks: Field, field: Field) -> Field:
    """Blocks (n, 3, 3) times a field (n, 3)."""
    out = np.empty_like(field)
    parallel_ranges(_apply, len(field), blocks, field, out)
    return out


@loop
def _apply(first, last, blocks, x, out):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        for c in range(3):
            out[i, c] = blocks[i, c, 0] * x[i, 0] + blocks[i, c, 1] * x[i, 1] + blocks[i, c, 2] * x[i, 2]


@algebra
def _solve_row(indptr, indices, data, inverses, start, i, a0, a1, a2, x):  # type: ignore[no-untyped-def]
    """x_i = E_i^-1 (a - entries of L in the row, times x)."""
    for k in range(start, indptr[i + 1] - 1):
        j = indices[k]
        a0 -= data[k, 0, 0] * x[j, 0] + data[k, 0, 1] * x[j, 1] + data[k, 0, 2] * x[j, 2]
        a1 -= data[k, 1, 0] * x[j, 0] + data[k, 1, 1] * x[j, 1] + data[k, 1, 2] * x[j, 2]
        a2 -= data[k, 2, 0] * x[j, 0] + data[k, 2, 1] * x[j, 1] + data[k, 2, 2] * x[j, 2]
    for c in range(3):
        x[i, c] = inverses[i, c, 0] * a0 + inverses[i, c, 1] * a1 + inverses[i, c, 2] * a2


@loop
def _forward(first, last, bounds, inner, indptr, indices, data, inverses, b, x):  # type: ignore[no-untyped-def]
    """Solve (E + L) x = b."""
    for i in range(bounds[first], bounds[last]):
        _solve_row(indptr, indices, data, inverses, inner[i], i, b[i, 0], b[i, 1], b[i, 2], x)


@loop
def _backward(first, last, bounds, inner, indptr, indices, data, inverses, b, x):  # type: ignore[no-untyped-def]
    """Solve (E + L^T) x = b; b becomes E x."""
    for i in range(bounds[last] - 1, bounds[first] - 1, -1):
        for c in range(3):
            x[i, c] = inverses[i, c, 0] * b[i, 0] + inverses[i, c, 1] * b[i, 1] + inverses[i, c, 2] * b[i, 2]
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        for k in range(inner[i], indptr[i + 1] - 1):
            j = indices[k]
            b[j, 0] -= data[k, 0, 0] * x0 + data[k, 1, 0] * x1 + data[k, 2, 0] * x2
            b[j, 1] -= data[k, 0, 1] * x0 + data[k, 1, 1] * x1 + data[k, 2, 1] * x2
            b[j, 2] -= data[k, 0, 2] * x0 + data[k, 1, 2] * x1 + data[k, 2, 2] * x2


@loop
def _forward_between(  # type: ignore[no-untyped-def]
    first, last, bounds, inner, indptr, indices, data, inverses, offsets, rows, places, added, p, left, t, out
):
    """out = t + (E + L)^-1 (p - left - (E - D) t + R t), with left = E t, which is overwritten part by part."""
    for i in range(bounds[first], bounds[last]):
        a0 = p[i, 0] - left[i, 0] - added[i] * t[i, 0]
        a1 = p[i, 1] - left[i, 1] - added[i] * t[i, 1]
        a2 = p[i, 2] - left[i, 2] - added[i] * t[i, 2]
        for k in range(indptr[i], inner[i]):
            j = indices[k]
            a0 += data[k, 0, 0] * t[j, 0] + data[k, 0, 1] * t[j, 1] + data[k, 0, 2] * t[j, 2]
            a1 += data[k, 1, 0] * t[j, 0] + data[k, 1, 1] * t[j, 1] + data[k, 1, 2] * t[j, 2]
            a2 += data[k, 2, 0] * t[j, 0] + data[k, 2, 1] * t[j, 1] + data[k, 2, 2] * t[j, 2]
        for n in range(offsets[i], offsets[i + 1]):
            j, k = rows[n], places[n]
            a0 += data[k, 0, 0] * t[j, 0] + data[k, 1, 0] * t[j, 1] + data[k, 2, 0] * t[j, 2]
            a1 += data[k, 0, 1] * t[j, 0] + data[k, 1, 1] * t[j, 1] + data[k, 2, 1] * t[j, 2]
            a2 += data[k, 0, 2] * t[j, 0] + data[k, 1, 2] * t[j, 1] + data[k, 2, 2] * t[j, 2]
        _solve_row(indptr, indices, data, inverses, inner[i], i, a0, a1, a2, left)
        for c in range(3):
            out[i, c] = t[i, c] + left[i, c]
