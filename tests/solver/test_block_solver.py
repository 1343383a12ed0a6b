"""The solver of block matrices in the admissible space, and its preconditioner."""

import copy

import numpy as np
import pytest
from corner_problems import CUBES, all_free, boundary_held, dense, jittered_cubes

from hexconformal import generate
from hexconformal.energy import Assembly, CornerTerm, DistortionTerm, Objective
from hexconformal.kernel import threads
from hexconformal.mesh.topology import boundary_quads
from hexconformal.solver import BlockPreconditioner, boundary_directions, row_parts, solve_blocks


def sliding(points, cells):
    """Nodes slide in planes and along lines, of which none is parallel to an axis."""
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    return boundary_directions(points @ turn, boundary_quads(cells)[0]).all_projectors(len(points))


def partly_held(points, cells):
    """The boundary is held, and one inner node moves in a plane."""
    projectors = boundary_held(points, cells)
    projectors[np.flatnonzero(projectors.any(axis=(1, 2)))[0]] = np.diag([1.0, 1.0, 0.0])
    return projectors


@pytest.fixture(params=[1, 5], ids=["one part", "five parts"])
def parts(request, monkeypatch):
    """Rows in one part, or in several."""
    monkeypatch.setattr(row_parts, "_PART", 64 // request.param)
    return request.param


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
def test_the_solution_is_the_one_of_the_dense_matrix(space, diagonals, parts):
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
def test_the_preconditioner_is_symmetric_and_positive_definite_in_the_admissible_space(space, parts):
    matrix, rhs, projectors = system(space, diagonals=True)
    p, n = whole(projectors), len(rhs)
    sweeps = columns(BlockPreconditioner(matrix, projectors, 1e-5), n)
    assert np.abs(sweeps - sweeps.T).max() < 1e-12 * np.abs(sweeps).max()
    assert np.abs(p @ sweeps @ p - sweeps).max() < 1e-12 * np.abs(sweeps).max()
    values = np.linalg.eigvalsh(sweeps)
    rank = round(np.trace(p))
    assert np.abs(values[: 3 * n - rank]).max(initial=0.0) < 1e-12 * values[-1]
    assert values[3 * n - rank] > 1e-6 * values[-1]


def test_the_preconditioner_is_a_sweep_forward_and_one_backward_in_every_part(parts):
    matrix, rhs, projectors = system("sliding", diagonals=True)
    n, shift = len(rhs), 1e-2
    original = copy.deepcopy(matrix)
    found = columns(BlockPreconditioner(matrix, projectors, shift), n)
    # What the preconditioner is made of: P A P with its shift, the identity where nothing may move.
    p = whole(projectors)
    full = (p @ dense(original) @ p).reshape(n, 3, n, 3)
    rows = np.arange(n)
    used = np.diff(matrix.indptr) > 0
    trace = np.trace(dense(original).reshape(n, 3, n, 3)[rows, :, rows] @ projectors, axis1=1, axis2=2) / 3.0
    trace = np.where(trace > 0.0, trace, 1.0)
    full[rows, :, rows] += trace[:, None, None] * ((1.0 + shift) * np.eye(3) - projectors)
    blocks = full.transpose(0, 2, 1, 3)
    of = np.searchsorted([n * k // parts for k in range(1, parts)], rows, side="right")
    assert of.max() == parts - 1
    norms = np.linalg.norm(blocks, axis=(2, 3))
    added = 0.5 * np.where(of[:, None] != of[None, :], norms, 0.0).sum(axis=1)
    diagonal = whole(blocks[rows, rows] + added[:, None, None] * np.eye(3))
    lower = np.where(((of[:, None] == of[None, :]) & (rows[:, None] > rows[None, :]))[:, None, :, None], full, 0.0)
    inside = np.repeat(used, 3)
    pick = np.ix_(inside, inside)
    low = (diagonal + lower.reshape(3 * n, 3 * n))[pick]
    sweeps = np.zeros((3 * n, 3 * n))
    sweeps[pick] = np.linalg.inv(low.T) @ diagonal[pick] @ np.linalg.inv(low)
    expected = p @ sweeps @ p
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()


def test_the_preconditioner_in_parts_is_nowhere_far_below_the_matrix(monkeypatch):
    eigenvalues = {}
    for part in (64, 8):
        monkeypatch.setattr(row_parts, "_PART", part)
        matrix, rhs, projectors = system("free", diagonals=True)
        full, n = dense(matrix), len(rhs)
        sweeps = columns(BlockPreconditioner(matrix, projectors, 1e-6), n)
        eigenvalues[part] = np.linalg.eigvals(sweeps @ full).real.max()
    assert eigenvalues[64] < 1.0 + 1e-9
    assert eigenvalues[8] < 1.2


def test_the_solution_has_the_same_bits_with_any_number_of_threads(monkeypatch):
    monkeypatch.setattr(row_parts, "_PART", 8)
    monkeypatch.setattr(threads, "_SMALLEST_RANGE", 1)
    found = []
    for count in (1, 2, 5):
        monkeypatch.setattr(threads, "thread_count", lambda count=count: count)
        matrix, rhs, projectors = system("sliding")
        found.append(solve_blocks(matrix, rhs, projectors, 1e-3, 50, 1e-5))
    assert np.array_equal(found[0], found[1])
    assert np.array_equal(found[0], found[2])


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
