"""One remeshing step: the saddle-point problem of the note, solved for the displacement.

    min_v  E(f + v) + int rho <v, N~> - eps/2 int rho^2

with a nodal, lumped multiplier rho. The stationary rho is <v, N~> / eps, which leaves the symmetric positive
definite system of E(f + v) + 1/(2 eps) sum_i m_i |P_i v_i|^2, P_i the projector onto the directions node i is held
in (its normal N~, or more on curves and corners). The printed sign of the eps term makes it unbounded.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from hexconformal.multigrid import Multigrid
from hexconformal.solver import conjugate_gradients

from .energy import Distortion
from .features import Features, holding
from .geometry import Cells, Floats, nodal_areas, transport_vectors

__all__ = ["DIRECT", "NORMALS", "displacement", "solve_constrained"]

NORMALS = ("middle", "simpson", "linear")
DIRECT = 120_000  # nodes up to which a sparse factorization is the faster one
_ROUNDS = 20
_SETTLED = 1e-10


def displacement(
    energy: Distortion,
    points: Floats,
    cells: Cells,
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
        Where N~ is taken, see :func:`surface.geometry.transport_vectors`: "middle" and "simpson" depend on v and are
        iterated to a fixed point (Picard).

    Returns
    -------
    (n, 3) displacement and the number of linear systems solved.
    """
    gradient, hessian = energy.gradient(points), energy.hessian(points)
    masses = nodal_areas(points, cells)
    v = np.zeros_like(points)
    solved = 0
    while solved < _ROUNDS:
        solved += 1
        held = holding(transport_vectors(points, points + v, cells, normal), points + v / 2, features)
        before, v = v, solve_constrained(hessian, -gradient, held, masses / eps)
        change = np.abs(v - before).max(initial=0.0)
        if normal == "linear" or change <= _SETTLED * np.abs(v).max(initial=0.0):
            break
    return v, solved


def solve_constrained(
    hessian: sparse.bsr_matrix, rhs: Floats, held: Floats, stiffness: Floats, tolerance: float = 1e-6
) -> Floats:
    """Minimize ``<v, H v>/2 - <rhs, v> + sum_i stiffness_i |P_i v_i|^2 / 2``.

    Parameters
    ----------
    hessian
        (3 n, 3 n) positive semidefinite, in 3 x 3 blocks.
    rhs
        (n, 3).
    held
        (n, 3, 3) projectors P onto the directions nodes are held in.
    stiffness
        (n,) lumped mass over eps.
    tolerance
        Of the residual, for surfaces too large to factorize.
    """
    count = len(rhs)
    used = np.flatnonzero(hessian.indptr[1:] > hessian.indptr[:-1])
    if len(used) > DIRECT:
        return _iterative(hessian, rhs, held, tolerance)
    penalty = sparse.bsr_matrix(
        (held * stiffness[:, None, None], np.arange(count), np.arange(count + 1)), shape=hessian.shape
    )
    matrix = (hessian + penalty).tocsc()
    diagonal = hessian.diagonal()
    # Unused nodes have empty rows; a surface that nothing holds may be shifted and turned.
    shift = np.where(diagonal > 0, 1e-11 * np.median(diagonal[diagonal > 0]), 1.0)
    factors = splu(
        matrix + sparse.diags_array(shift, format="csc"),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    v = factors.solve(rhs.ravel())
    # One refinement takes the shift out again.
    return np.asarray(v + factors.solve(rhs.ravel() - matrix @ v)).reshape(-1, 3)


def _iterative(hessian: sparse.bsr_matrix, rhs: Floats, held: Floats, tolerance: float) -> Floats:
    """The limit eps = 0: conjugate gradients on the admissible displacements, preconditioned by multigrid."""
    trace = np.einsum("kxx->k", hessian.data) / 3
    count = len(rhs)
    scalar = sparse.csr_matrix((trace, hessian.indices, hessian.indptr), shape=(count, count))
    project = _projection(held)
    free = np.asarray(scalar.diagonal() > 0) & (np.einsum("nxx->n", held) < 2.9)
    cycle = Multigrid(scalar, free)
    return conjugate_gradients(
        lambda v: project((hessian @ v.ravel()).reshape(-1, 3)), lambda r: project(cycle(project(r))), project(rhs),
        tolerance,
    )  # fmt: skip


def _projection(held: Floats) -> Callable[[Floats], Floats]:
    def project(field: Floats) -> Floats:
        return np.asarray(field - np.einsum("nxy,ny->nx", held, field))

    return project
