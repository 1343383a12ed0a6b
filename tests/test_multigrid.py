"""Multigrid as a preconditioner: symmetric, definite, and as good on fine meshes as on coarse ones."""

import numpy as np
import pytest

from hexconformal import generate
from hexconformal.assembly import Distortion
from hexconformal.multigrid import Multigrid
from hexconformal.solver import conjugate_gradients, inner
from hexconformal.topology import boundary_quads


def laplace(n):
    points, cells = generate.box((n, n, n))
    matrix = Distortion(cells, len(points)).laplacian()
    free = np.ones(len(points), dtype=bool)
    free[boundary_quads(cells)[0]] = False
    return matrix, free


def test_the_cycle_is_symmetric_positive_definite_and_leaves_constrained_rows_alone():
    matrix, free = laplace(12)
    cycle = Multigrid(matrix, free)
    a, b = np.random.default_rng(0).normal(size=(2, len(free), 3))
    assert inner(a, cycle(b)) == pytest.approx(inner(b, cycle(a)), rel=1e-5)  # single precision
    assert inner(a, cycle(a)) > 0
    assert not cycle(a)[~free].any()


def test_iterations_do_not_grow_with_the_mesh():
    counts = []
    for n in (8, 16, 32):
        matrix, free = laplace(n)
        rhs = np.random.default_rng(0).normal(size=(len(free), 3)) * free[:, None]
        products = []

        def product(x, matrix=matrix, free=free, products=products):
            products.append(1)
            return (matrix @ x) * free[:, None]

        x = conjugate_gradients(product, Multigrid(matrix, free), rhs, 1e-8)
        assert np.abs(matrix @ x - rhs)[free].max() < 1e-6 * np.abs(rhs).max()
        counts.append(len(products))
    assert counts[-1] <= 16
    assert counts[-1] <= counts[0] + 6


def test_setting_up_leaves_the_global_random_state_alone():
    matrix, free = laplace(8)
    np.random.seed(3)
    expected = np.random.random(4)
    np.random.seed(3)
    Multigrid(matrix, free)
    assert np.array_equal(np.random.random(4), expected)
