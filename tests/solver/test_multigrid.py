"""Multigrid as a preconditioner: symmetric, definite, and as good on fine meshes as on coarse ones."""

import numpy as np
import pytest
from meshes.hexahedra import off_boundary
from scipy import linalg, sparse

from hexconformal import generate
from hexconformal.energy.distortion_term import DistortionTerm
from hexconformal.energy.target import inverse_targets
from hexconformal.kernel import threads
from hexconformal.mesh import SERIAL
from hexconformal.solver import MultigridSchedule, conjugate_gradients
from hexconformal.solver.multigrid import Multigrid

inner = SERIAL.inner


def laplace(n):
    points, cells = generate.box((n, n, n))
    return DistortionTerm(cells, len(points)).laplacian(), off_boundary(points, cells)


def layered(shape, aspect):
    """Thin cells, each its own target, stiff as the metric of a minimization is."""
    points, cells = generate.boundary_layer(shape, aspect)
    inverses = inverse_targets("input", points, cells, "corners")
    volumes = np.linalg.det(inverses[:, 0]) ** -1
    distortion = DistortionTerm(cells, len(points), inverses=inverses, quadrature="corners")
    return distortion.laplacian(volumes ** (-2.0 / 3.0)), off_boundary(points, cells)


def iterations(matrix, free, cycle):
    """Steps of conjugate gradients to the solution, by 1e8 nearer in the norm of the cycle."""
    solution = np.random.default_rng(0).normal(size=(len(free), 3)) * free[:, None]
    products = []

    def product(x):
        products.append(1)
        return (matrix @ x) * free[:, None]

    error = conjugate_gradients(product, cycle, product(solution), 1e-8) - solution
    assert inner(error, product(error)) < 1e-14 * inner(solution, product(solution))
    return len(products) - 2


def test_the_cycle_is_symmetric_positive_definite_and_leaves_constrained_rows_alone():
    matrix, free = laplace(12)
    cycle = Multigrid(matrix, free)
    a, b = np.random.default_rng(0).normal(size=(2, len(free), 3))
    assert inner(a, cycle(b)) == pytest.approx(inner(b, cycle(a)), rel=1e-5)  # single precision
    assert inner(a, cycle(a)) > 0
    assert not cycle(a)[~free].any()


@pytest.mark.parametrize(("contrast", "least"), [(0.0, 0.75), (6.0, 0.55)])
def test_a_cycle_is_definite_and_reduces_every_error(contrast, least):
    """The eigenvalues of cycle and matrix lie in (0, 1]: one less the smallest is the factor of convergence.

    The contrast is that between the stiffnesses of neighbouring cells, in powers of ten.
    """
    points, cells = generate.box((9, 9, 9))
    free = off_boundary(points, cells)
    distortion = DistortionTerm(cells, len(points))
    nodes = np.flatnonzero(free)
    matrix = distortion.laplacian(10.0 ** (contrast * np.random.default_rng(1).uniform(size=len(cells))))
    cycle = Multigrid(matrix, free)
    columns = np.zeros((len(nodes), len(points), 3))
    columns[np.arange(len(nodes)), nodes] = 1.0
    inverse = np.stack([cycle(column)[nodes, 0] for column in columns], axis=1)
    assert np.abs(inverse - inverse.T).max() < 1e-14 * np.abs(inverse).max()
    assert linalg.eigvalsh(inverse).min() > 0.0
    values = linalg.eigh(matrix[nodes][:, nodes].toarray(), linalg.inv(inverse), eigvals_only=True)
    assert values.max() < 1 + 1e-5  # single precision
    assert values.min() > least


def test_sweeps_leave_as_much_of_the_smoothest_of_their_errors_as_of_the_roughest():
    """And as much with the other sign of those in the middle: Chebyshev's polynomial."""
    for lowest in (0.1, 0.2, 0.7):
        first, second = MultigridSchedule(lowest=lowest).dampings
        left = [(1.0 - first * value) * (1.0 - second * value) for value in (lowest, 0.5 * (lowest + 1.0), 1.0)]
        at_zero = (1.0 + lowest) / (1.0 - lowest)
        np.testing.assert_allclose(left, np.array([1.0, -1.0, 1.0]) / (2.0 * at_zero**2 - 1.0), rtol=1e-12)


def test_a_cycle_has_the_same_bits_with_any_number_of_threads(monkeypatch):
    monkeypatch.setattr(threads, "_SMALLEST_RANGE", 1)
    matrix, free = laplace(12)
    b = np.random.default_rng(0).normal(size=(len(free), 3))
    found = []
    for count in (1, 2, 5):
        monkeypatch.setattr(threads, "thread_count", lambda count=count: count)
        found.append(Multigrid(matrix, free)(b))
    assert np.array_equal(found[0], found[1])
    assert np.array_equal(found[0], found[2])


def test_constrained_rows_and_columns_are_left_out_wherever_they_are():
    matrix, free = laplace(9)
    free &= np.random.default_rng(1).random(len(free)) < 0.7
    b = np.random.default_rng(0).normal(size=(len(free), 3))
    alone = Multigrid(matrix.tocsr()[free][:, free], np.ones(free.sum(), dtype=bool))
    assert np.array_equal(Multigrid(matrix, free)(b)[free], alone(b[free]))


def test_where_nothing_is_constrained_the_cycle_is_definite_too():
    matrix, _ = laplace(8)
    cycle = Multigrid(matrix, np.ones(matrix.shape[0], dtype=bool))
    rng = np.random.default_rng(0)
    for _ in range(5):
        a, b = rng.normal(size=(2, matrix.shape[0], 3))
        a, b = a - a.mean(axis=0), b - b.mean(axis=0)
        assert inner(a, cycle(b)) == pytest.approx(inner(b, cycle(a)), abs=1e-4 * inner(a, a))
        assert 0 < inner(a, cycle(a)) < 100 * inner(a, a)


def test_the_cycle_does_not_depend_on_the_global_random_state():
    matrix, free = laplace(12)
    b = np.random.default_rng(0).normal(size=(len(free), 3))
    cycles = []
    for seed in (1, 2):
        np.random.seed(seed)
        cycles.append(Multigrid(matrix, free)(b))
    assert np.array_equal(*cycles)


def test_iterations_do_not_grow_with_the_mesh():
    counts = [iterations(*system, Multigrid(*system)) for system in map(laplace, (8, 16, 32))]
    assert counts[-1] <= 10
    assert counts[-1] <= counts[0] + 3


def test_stretched_cells_take_no_more():
    for aspect in (1.0, 100.0, 10000.0):
        system = layered((14, 14, 28), aspect)
        cycle = Multigrid(*system)
        assert iterations(*system, cycle) <= 11
        sizes = [len(level.matrix.data) for level in cycle._levels]
        assert sum(sizes) < 3 * sizes[0]


def test_a_level_on_which_nothing_is_strong():
    """A matrix that is diagonal but for less than rounding coarsens to nothing."""
    weak = sparse.diags_array([np.full(999, -1e-3), np.ones(1000), np.full(999, -1e-3)], offsets=[-1, 0, 1]).tocsr()
    cycle = Multigrid(weak, np.ones(1000, dtype=bool))
    assert iterations(weak, np.ones(1000, dtype=bool), cycle) < 10


def test_setting_up_leaves_the_global_random_state_alone():
    matrix, free = laplace(8)
    np.random.seed(3)
    expected = np.random.random(4)
    np.random.seed(3)
    Multigrid(matrix, free)
    assert np.array_equal(np.random.random(4), expected)
