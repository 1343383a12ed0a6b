"""The block matrix: what it leaves out, and its solver in the admissible space."""

import numpy as np
from corner_problems import CUBES, boundary_held, dense, jittered_cubes
from hexconformal.energy.corner_energy import CornerEnergy, Weights
from meshes.hexahedra import off_boundary

from hexconformal import generate
from hexconformal.energy.block_matrix import BlockMatrix, block_places


def test_the_solver_finds_the_solution_in_the_admissible_space():
    points, cells = jittered_cubes()
    projectors = boundary_held(points, cells)
    projectors[np.flatnonzero(projectors.any(axis=(1, 2)))[0]] = np.diag([1.0, 1.0, 0.0])
    problem = CornerEnergy(cells, CUBES, projectors)
    _, gradient, matrix = problem.value_gradient_hessian(points, Weights())
    full = dense(matrix)
    x, _ = matrix.solve(-gradient, projectors, 1e-10, 500, 0.0)
    assert np.abs(np.einsum("nij,nj->ni", projectors, x) - x).max() == 0.0
    residual = (full @ x.ravel()).reshape(-1, 3) + gradient
    assert np.abs(np.einsum("nij,nj->ni", projectors, residual)).max() < 1e-9 * np.abs(gradient).max()


def test_matrices_leave_out_what_is_held():
    points, cells = generate.box((3, 3, 3))
    free = off_boundary(points, cells)
    matrix = BlockMatrix.of_cells(cells, free)
    assert matrix.indptr[-1] == len(matrix.indices) == 8 + 12 + 12  # nodes, edges, diagonals of faces of one cell
    assert (np.diff(matrix.indptr)[~free] == 0).all()
    assert (block_places(cells, free, matrix) >= 0).sum() == 8 * 8 + 12 * 4 + 12 * 2
