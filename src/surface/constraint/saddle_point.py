"""The saddle-point problem of Gruber & Aulisa, solved for the displacement of one step.

    min_v  E(f + v) + int rho <v, N~> - eps/2 int rho^2

with a nodal, lumped multiplier rho. The stationary rho is <v, N~> / eps, which leaves the symmetric positive
definite system of E(f + v) + 1/(2 eps) sum_i m_i |P_i v_i|^2, P_i the projector onto the directions node i is held
in (its normal N~, or more on curves and corners). With the sign of the eps term that is printed there it
would be unbounded. Equation (17) and equation (18) of docs/mathematics.md.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy
from numpy.typing import NDArray

from hexconformal.energy import BlockMatrix
from hexconformal.geometry import Faces, Features, nodal_area_vectors, nodal_areas, simpson_mean
from hexconformal.solver import solve_blocks

from ..energy import SurfaceEnergy
from ..mesh import Floats
from .features import held_projectors

__all__ = ["NORMALS", "ConstrainedSystem", "constrained_system", "constraint_normals", "displacement"]

NORMALS = ("middle", "simpson", "linear")
_DIRECT = 120_000  # nodes up to which a sparse factorization is the faster one
_PICARD_ITERATIONS, _PICARD_TOLERANCE = 20, 1e-10
_CG_ITERATIONS, _CG_TOLERANCE = 300, 1e-6  # the tolerance only where no factorization fits


def displacement(
    energy: SurfaceEnergy,
    points: Floats,
    cells: Faces,
    features: Features,
    eps: float = 1e-5,
    normal: str = "middle",
) -> tuple[Floats, int]:
    """The displacement v of one step with the energy's second derivative frozen at `points`.

    Parameters
    ----------
    energy
        What is lowered.
    points, cells, features
        The surface and what holds its nodes.
    eps
        Relaxation of the constraint: an area for the quaternionic energy, a fourth power of a length for the
        barrier.
    normal
        Where N~ is taken, see :func:`constraint_normals`: "middle" and "simpson" depend on v and
        are iterated to a fixed point (Picard).

    Returns
    -------
    (n, 3) displacement and the number of linear systems solved.
    """
    gradient, hessian = energy.gradient(points), energy.hessian(points)
    everybody = np.ones(len(points), dtype=bool)
    v = np.zeros_like(points)
    solved = 0
    while solved < _PICARD_ITERATIONS:
        solved += 1
        system = constrained_system(hessian, points, v, cells, features, eps, normal, everybody)
        before, v = v, system.solve_directly(-gradient)
        change = np.abs(v - before).max(initial=0.0)
        if normal == "linear" or change <= _PICARD_TOLERANCE * np.abs(v).max(initial=0.0):
            break
    return v, solved


def constrained_system(
    hessian: scipy.sparse.bsr_matrix,
    points: Floats,
    v: Floats,
    cells: Faces,
    features: Features,
    eps: float,
    normal: str,
    moving: NDArray[np.bool_],
) -> ConstrainedSystem:
    """The linear system of equation (18), with the normal N~ and the tangents of curves for a displacement v."""
    held = held_projectors(constraint_normals(points, points + v, cells, normal), points + v / 2, features)
    return ConstrainedSystem(hessian, held, nodal_areas(points, cells) / eps, moving)


def constraint_normals(points: Floats, moved: Floats, cells: Faces, normal: str = "middle") -> Floats:
    """(n, 3) nodal area vectors N~ that a displacement should be orthogonal to.

    Parameters
    ----------
    points, moved
        (n, 3) positions before and after.
    cells
        The cells.
    normal
        "linear": of the old surface; "middle": of the half-way surface (Gruber & Aulisa: the difference vector is
        orthogonal to it to third order); "simpson": (N0 + 4 N_half + N1) / 6, whose flux is exactly the change of
        the enclosed volume, because the volume is a cubic polynomial along the way; equation (19).
    """
    if normal == "linear":
        return nodal_area_vectors(points, cells)
    if normal == "middle":
        return nodal_area_vectors((points + moved) / 2, cells)
    return simpson_mean(partial(nodal_area_vectors, faces=cells), points, moved)


class ConstrainedSystem:
    """Minimize ``<v, H v>/2 - <rhs, v> + sum_i stiffness_i |P_i v_i|^2 / 2``.

    Parameters
    ----------
    hessian
        (3 n, 3 n) H, positive semidefinite, in 3 x 3 blocks.
    held
        (n, 3, 3) projectors P onto the directions nodes are held in.
    stiffness
        (n,) lumped mass over eps; None is the limit eps = 0, no step in the held directions.
    moving
        (n,) nodes that move at all.
    """

    def __init__(
        self, hessian: scipy.sparse.bsr_matrix, held: Floats, stiffness: Floats | None, moving: NDArray[np.bool_]
    ) -> None:
        count = len(held)
        rows = np.repeat(np.arange(count), np.diff(hessian.indptr))
        lower = hessian.indices <= rows
        indptr = np.concatenate([[0], np.cumsum(np.bincount(rows[lower], minlength=count))])
        self._pattern = indptr, hessian.indices[lower].astype(np.int32)
        self._data = hessian.data[lower]
        self._diagonal = hessian.diagonal()
        self._projectors = np.eye(3) * (moving & (np.diff(indptr) > 0))[:, None, None]
        if stiffness is None:
            self._projectors = self._projectors @ (np.eye(3) - held)
        else:
            diagonal = np.flatnonzero(hessian.indices[lower] == rows[lower])
            self._data[diagonal] += (held * stiffness[:, None, None])[rows[lower][diagonal]]

    def solve_iteratively(self, rhs: Floats, tolerance: float, moving: NDArray[np.bool_] | None = None) -> Floats:
        """(n, 3) solution by conjugate gradients with a symmetric block Gauss-Seidel preconditioner.

        The residual is `tolerance` in the norm of the preconditioner; only some nodes may move.
        """
        projectors = self._projectors if moving is None else self._projectors * moving[:, None, None]
        matrix = BlockMatrix(*self._pattern)
        matrix.data[:] = self._data
        return solve_blocks(matrix, rhs, projectors, tolerance, _CG_ITERATIONS, 1e-9)

    def solve_directly(self, rhs: Floats) -> Floats:
        """(n, 3) solution by a sparse factorization up to 120 000 nodes; all held directions must have a stiffness."""
        from scipy.sparse.linalg import splu

        indptr, indices = self._pattern
        if np.count_nonzero(np.diff(indptr)) > _DIRECT:
            return self.solve_iteratively(rhs, _CG_TOLERANCE)
        rows = np.repeat(np.arange(len(rhs)), np.diff(indptr))
        data = np.where((indices == rows)[:, None, None], 0.5 * self._data, self._data)
        lower = scipy.sparse.bsr_matrix((data, indices, indptr), shape=(rhs.size, rhs.size))
        matrix = (lower + lower.T).tocsc()
        diagonal = self._diagonal
        # Unused nodes have empty rows; a surface that nothing holds may be shifted and turned.
        shift = np.where(diagonal > 0, 1e-11 * np.median(diagonal[diagonal > 0]), 1.0)
        factors = splu(
            matrix + scipy.sparse.diags_array(shift, format="csc"),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        v = factors.solve(rhs.ravel())
        # One refinement takes the shift out again.
        return np.asarray(v + factors.solve(rhs.ravel() - matrix @ v)).reshape(-1, 3)
