"""A solver for sparse symmetric matrices of 3 x 3 blocks in the admissible displacements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..energy import BlockMatrix
from ..kernel import loop
from ..mesh import SERIAL, Space
from .block_sweeps import BlockPreconditioner, block_norm
from .conjugate_gradients import conjugate_gradients
from .coupled_nodes import UNCOUPLED, CoupledNodes

__all__ = ["SharedBlocks", "block_preconditioner", "solve_blocks"]

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
    """Solve P A P x = P rhs by conjugate gradients, preconditioned by symmetric block Gauss-Seidel in parts.

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
        Where the fields live; where nodes are shared out parts sweep over their own rows, see :class:`SharedBlocks`.
    coupled
        Nodes that move together, with projections that are alike: T P A P T is what is solved then, T being the map
        from roots to all nodes.

    Returns
    -------
    (n, 3) admissible solution.

    Notes
    -----
    Rows are taken in parts, some thousand consecutive ones each, which threads work on at once: the number of parts
    depends on that of the rows alone, and so does the result. With A = L + D + L^T + R, L the lower triangle within the
    parts and R what is between them, the preconditioner is M = (E + L) E^-1 (E + L^T), symmetric Gauss-Seidel in every
    part. E is D with half of the norms of a row's blocks of R added, so that M is hardly below A anywhere: with E = D
    it takes half as many iterations more (A. Baker, R. Falgout, T. Kolev and U. Yang, Multigrid smoothers for
    ultraparallel computing, SIAM J. Sci. Comput. 33 (2011)). It shares its triangles with the matrix: what is solved is

        (E + L)^-1 A (E + L^T)^-1 y = (E + L)^-1 rhs,    x = (E + L^T)^-1 y,

    preconditioned by E. With t = (E + L^T)^-1 p the product is t + (E + L)^-1 (p - E t - (E - D) t + R t): one
    substitution each way (S. Eisenstat, Efficient implementation of a class of preconditioned conjugate gradient
    methods, SIAM J. Sci. Stat. Comput. 2 (1981)).
    """
    if space.is_shared:
        blocks = SharedBlocks(matrix, projectors, shift, space)
        return conjugate_gradients(blocks.product, blocks, blocks.projected(rhs), tolerance, max_iterations, space)
    sweeps = BlockPreconditioner(matrix, projectors, shift, coupled)
    y = conjugate_gradients(sweeps.product, sweeps.scaled, sweeps.forward(rhs), tolerance, max_iterations, space)
    return sweeps.backward(y)


def block_preconditioner(
    matrix: BlockMatrix, projectors: Field, shift: float, space: Space = SERIAL, coupled: CoupledNodes = UNCOUPLED
) -> BlockPreconditioner | SharedBlocks:
    """Sweeps over the rows of a matrix, or of the own ones where nodes are shared out; uses the blocks up."""
    if space.is_shared:
        return SharedBlocks(matrix, projectors, shift, space)
    return BlockPreconditioner(matrix, projectors, shift, coupled)


class SharedBlocks:
    """A matrix that is the sum of what parts have of it, with sweeps in the rows that each owns.

    The preconditioner takes the diagonal blocks of the sum, and below them what a part has itself; half of the norms of
    what others have, or joins rows with those of others, is added to the diagonal, as between parts of threads.

    Parameters
    ----------
    matrix
        What this part adds to A.
    projectors
        (n, 3, 3) orthogonal projections P onto the admissible directions.
    shift
        Added to the diagonal blocks, relative to their trace.
    space
        Where the fields live.
    """

    def __init__(self, matrix: BlockMatrix, projectors: Field, shift: float, space: Space) -> None:
        self._matrix, self._projectors, self._space = matrix, projectors, space
        rows, count = np.flatnonzero(np.diff(matrix.indptr)), len(space.own(projectors))
        diagonal = np.zeros_like(projectors)
        diagonal[rows] = matrix.data[matrix.indptr[rows + 1] - 1]
        beside = np.zeros(len(projectors))
        _add_of_others(count, matrix.indptr, matrix.indices, matrix.data, beside)
        diagonal, beside = space.add(diagonal), space.add(beside)
        traces = np.einsum("nij,nji->n", diagonal, projectors) / 3.0
        self._shifts = (shift * np.where(traces > 0.0, traces, 1.0) + 1e-30)[:, None]
        # Own nodes come first, so that their rows of a lower triangle have own columns alone.
        # A row may be empty here whose node has all its cells elsewhere.
        starts, last = matrix.indptr[: count + 1], int(matrix.indptr[count])
        lacking = (np.diff(starts) == 0) & diagonal[:count].any(axis=(1, 2))
        rows = np.flatnonzero(lacking)
        indices = np.insert(matrix.indices[:last], starts[rows], rows)
        own = BlockMatrix(starts + np.concatenate([[0], np.cumsum(lacking)]), indices)
        own.data[:] = np.insert(matrix.data[:last], starts[rows], 0.0, axis=0)
        rows = np.flatnonzero(np.diff(own.indptr))
        own.data[own.indptr[rows + 1] - 1] = diagonal[rows]
        self._sweeps = BlockPreconditioner(own, projectors[:count], shift, beside=beside[:count])

    def __call__(self, gradient: Field) -> Field:
        """Sweeps forward and backward over own rows of a field (n, 3); those of others are zero."""
        out = np.zeros_like(gradient)
        self._space.own(out)[:] = self._sweeps(self._space.own(gradient))
        return out

    def projected(self, field: Field) -> Field:
        """P times a field (n, 3)."""
        return np.asarray(np.einsum("nij,nj->ni", self._projectors, field))

    def product(self, field: Field) -> Field:
        """The shifted P A times an admissible field (n, 3)."""
        field, out = self._space.update(field), np.zeros_like(field)
        _multiply(self._matrix.indptr, self._matrix.indices, self._matrix.data, field, out)
        return self.projected(self._space.add(out)) + self._shifts * field


@loop
def _multiply(indptr, indices, data, x, out):  # type: ignore[no-untyped-def]
    """out += A x, of which the lower triangle is there."""
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            for r in range(3):
                for c in range(3):
                    out[i, r] += data[k, r, c] * x[j, c]
                    if i != j:
                        out[j, c] += data[k, r, c] * x[i, r]


@loop
def _add_of_others(owned, indptr, indices, data, out):  # type: ignore[no-untyped-def]
    """Add half of the norms of the blocks off the diagonal in the rows of others to both of their ends."""
    for i in range(owned, len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1] - 1):
            half = 0.5 * block_norm(data, k)
            out[i] += half
            out[indices[k]] += half
