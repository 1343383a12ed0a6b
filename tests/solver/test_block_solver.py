"""The solver of block matrices in the admissible space, and its preconditioner."""

import numpy as np
import pytest
from corner_problems import CUBES, all_free, boundary_held, dense, jittered_cubes

from hexconformal import generate
from hexconformal.energy import Assembly, CornerTerm, DistortionTerm, Objective
from hexconformal.mesh.topology import boundary_quads
from hexconformal.solver import BlockPreconditioner, boundary_directions, solve_blocks


def sliding(points, cells):
    """Nodes slide in planes and along lines, of which none is parallel to an axis."""
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    return boundary_directions(points @ turn, boundary_quads(cells)[0]).all_projectors(len(points))


def partly_held(points, cells):
    """The boundary is held, and one inner node moves in a plane."""
    projectors = boundary_held(points, cells)
    projectors[np.flatnonzero(projectors.any(axis=(1, 2)))[0]] = np.diag([1.0, 1.0, 0.0])
    return projectors


SPACES = {"free": lambda points, cells: all_free(points), "partly held": partly_held, "sliding": sliding}


def system(space, diagonals=False):
    """A matrix, a right-hand side and projectors."""
    points, cells = jittered_cubes(3)
    term = DistortionTerm(cells, len(points)) if diagonals else CornerTerm(cells, CUBES)
    projectors = SPACES[space](points, cells)
    assembly = Assembly.of_cells(cells, projectors.any(axis=(1, 2)), diagonals)
    _, gradient, _ = Objective((term,)).convex(points, assembly)
    return assembly.matrix, -gradient, projectors


def whole(projectors):
    """Projectors (n, 3, 3) as one matrix (3n, 3n)."""
    n = len(projectors)
    full = np.zeros((n, 3, n, 3))
    full[np.arange(n), :, np.arange(n)] = projectors
    return full.reshape(3 * n, 3 * n)


def columns(operator, n):
    """An operator on fields as a matrix (3n, 3n)."""
    return np.stack([operator(e.reshape(n, 3)).ravel() for e in np.eye(3 * n)], axis=1)


@pytest.mark.parametrize("diagonals", [False, True])
@pytest.mark.parametrize("space", SPACES)
def test_the_solution_is_the_one_of_the_dense_matrix(space, diagonals):
    matrix, rhs, projectors = system(space, diagonals)
    shift = 1e-3
    p, full, n = whole(projectors), dense(matrix), len(rhs)
    inside = p @ full @ p
    # The diagonal blocks get the shift relative to their trace, and are an identity where nothing may move.
    blocks = inside.reshape(n, 3, n, 3)[np.arange(n), :, np.arange(n)]
    traces = np.trace(blocks, axis1=1, axis2=2) / 3.0
    inside += np.kron(np.diag(shift * traces), np.eye(3))
    expected = p @ np.linalg.pinv(p @ inside @ p, rcond=1e-13, hermitian=True) @ p @ rhs.ravel()
    x = solve_blocks(matrix, rhs, projectors, 1e-12, 1000, shift)
    assert np.abs(np.einsum("nij,nj->ni", projectors, x) - x).max() < 1e-14 * np.abs(x).max()
    np.testing.assert_allclose(x.ravel(), expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_without_a_shift_the_residual_vanishes_in_the_admissible_space():
    matrix, rhs, projectors = system("partly held")
    full = dense(matrix)
    x = solve_blocks(matrix, rhs, projectors, 1e-10, 500, 0.0)
    assert np.abs(np.einsum("nij,nj->ni", projectors, x) - x).max() == 0.0
    residual = (full @ x.ravel()).reshape(-1, 3) - rhs
    assert np.abs(np.einsum("nij,nj->ni", projectors, residual)).max() < 1e-9 * np.abs(rhs).max()


@pytest.mark.parametrize("space", SPACES)
def test_the_preconditioner_is_symmetric_and_positive_definite_in_the_admissible_space(space):
    matrix, rhs, projectors = system(space, diagonals=True)
    p, n = whole(projectors), len(rhs)
    sweeps = columns(BlockPreconditioner(matrix, projectors, 1e-5), n)
    assert np.abs(sweeps - sweeps.T).max() < 1e-12 * np.abs(sweeps).max()
    assert np.abs(p @ sweeps @ p - sweeps).max() < 1e-12 * np.abs(sweeps).max()
    values = np.linalg.eigvalsh(sweeps)
    rank = round(np.trace(p))
    assert np.abs(values[: 3 * n - rank]).max(initial=0.0) < 1e-12 * values[-1]
    assert values[3 * n - rank] > 1e-6 * values[-1]


def test_the_preconditioner_is_a_sweep_forward_and_one_backward():
    matrix, rhs, projectors = system("sliding", diagonals=True)
    n, shift = len(rhs), 1e-2
    preconditioner = BlockPreconditioner(matrix, projectors, shift)
    # The matrix now holds P A P with its shift, the identity where nothing may move.
    full = dense(matrix)
    rows = np.arange(n)
    diagonal = whole(full.reshape(n, 3, n, 3)[rows, :, rows])
    used = np.diff(matrix.indptr) > 0
    diagonal[~np.repeat(used, 3)] = 0.0
    lower = np.zeros_like(full)
    for i in range(n):
        lower[3 * i : 3 * i + 3, : 3 * i] = full[3 * i : 3 * i + 3, : 3 * i]
    inside = np.repeat(used, 3)
    low = (diagonal + lower)[np.ix_(inside, inside)]
    p = whole(projectors)
    sweeps = np.zeros_like(full)
    sweeps[np.ix_(inside, inside)] = np.linalg.inv(low.T) @ diagonal[np.ix_(inside, inside)] @ np.linalg.inv(low)
    expected = p @ sweeps @ p
    found = columns(preconditioner, n)
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()


def test_fewer_iterations_leave_a_direction_of_descent():
    for most in (1, 2, 5):
        matrix, rhs, projectors = system("sliding")
        x = solve_blocks(matrix, rhs, projectors, 1e-12, most, 1e-5)
        assert np.vdot(x, rhs) > 0.0


def test_nodes_of_no_cell_stay_where_they_are():
    points, cells = generate.box((1, 1, 1), (1.0, 2.0, 3.0))
    points = np.vstack([points, [9.0, 9.0, 9.0]])
    assembly = Assembly.of_cells(cells, np.ones(9, dtype=bool))
    _, gradient, _ = Objective((CornerTerm(cells, CUBES),)).convex(points, assembly)
    x = solve_blocks(assembly.matrix, -gradient, all_free(points), 1e-8, 100, 1e-3)
    assert np.abs(x[:8]).max() > 1e-3
    assert not x[8].any()
