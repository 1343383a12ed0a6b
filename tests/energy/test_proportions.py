"""The proportions of edges at corners."""

import numpy as np
import pytest
from corner_problems import CUBES, convex, jittered_cubes

from hexconformal import generate
from hexconformal.energy import CornerTerm, CornerWeights

FRAMES = np.linalg.inv(np.diag([1.0, 1.0, 4.0])[None, None])


def proportions(cells, slender=3.0, inverses=CUBES, weights=None):
    """The term of proportions alone, or beside others."""
    weights = CornerWeights(0.0, proportion=5.0) if weights is None else weights
    return CornerTerm(cells, inverses, weights, slender=np.full(len(cells), slender))


def stretched(amount=8.0):
    points, cells = jittered_cubes()
    return points * [1.0, 1.0, amount], cells


def test_bricks_have_the_value_of_the_logarithm():
    points, cells = generate.box((1, 1, 1), (1.0, 2.0, 20.0))
    # Two of the three pairs of edges at each of eight corners are beyond a ratio of three.
    beyond = np.log(10.0 / 3.0), np.log(20.0 / 3.0)
    expected = 8 * 5.0 * sum(x**2 + 8.0 * x**4 for x in beyond)
    assert proportions(cells).value(points) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("inverses", [CUBES, FRAMES], ids=["cubes", "boxes"])
@pytest.mark.parametrize("weights", [None, CornerWeights(0.2, 1.0, proportion=5.0)], ids=["alone", "beside angles"])
def test_gradient_agrees_with_differences(inverses, weights):
    points, cells = stretched(8.0 if inverses is CUBES else 0.2)
    term = proportions(cells, inverses=inverses, weights=weights)
    value, gradient, _ = convex(term, points, cells)
    assert value == pytest.approx(term.value(points), rel=1e-13)
    direction = np.random.default_rng(0).normal(size=points.shape)
    ahead, behind = (term.value(points + s * 1e-6 * direction) for s in (1, -1))
    assert (ahead - behind) / 2e-6 == pytest.approx(np.vdot(gradient, direction), rel=1e-6)


def test_blocks_are_those_of_gauss_and_newton():
    points, cells = stretched()
    term = proportions(cells)
    full = convex(term, points, cells)[2]
    rows = []
    # Gradients of x = |log ratio| - log 3, one per pair of edges beyond it, times the root of the second derivative.
    from hexconformal.elements import CORNER_NEIGHBOURS

    for cell in cells:
        for q in range(8):
            edges = points[cell[CORNER_NEIGHBOURS[q]]] - points[cell[q]]
            squares = (edges**2).sum(axis=1)
            for i, j in ((0, 1), (0, 2), (1, 2)):
                x = abs(0.5 * np.log(squares[i] / squares[j])) - np.log(3.0)
                if x > 0.0:
                    row = np.zeros((len(points), 3))
                    for edge, sign in ((i, 1.0), (j, -1.0)):
                        slope = sign * edges[edge] / squares[edge]
                        row[cell[CORNER_NEIGHBOURS[q][edge]]] += slope
                        row[cell[q]] -= slope
                    rows.append(np.sqrt(5.0 * (2.0 + 96.0 * x**2)) * row.ravel())
    roots = np.array(rows)
    np.testing.assert_allclose(full, roots.T @ roots, atol=1e-12 * np.abs(full).max())


def test_what_is_as_slender_as_allowed_costs_nothing():
    points, cells = generate.box((2, 2, 2), (1.0, 1.0, 2.9))
    assert proportions(cells).value(points) == 0.0
    assert CornerTerm(cells, CUBES, CornerWeights(0.0, proportion=5.0)).value(points * [1.0, 1.0, 9.0]) == 0.0
    # Ratios are those against the target.
    long = points * [1.0, 1.0, 4.0 / 2.9]
    assert proportions(cells, inverses=FRAMES).value(long) == 0.0 < proportions(cells).value(long)


def test_slenderness_and_fullness_are_those_of_bricks_and_needles():
    points, cells = generate.box((1, 1, 1), (1.0, 2.0, 20.0))
    measures = CornerTerm(cells, CUBES).measures(points)
    assert measures.slenderness[0] == pytest.approx(20.0, rel=1e-13)
    assert measures.fullness[0] == pytest.approx(40.0 / ((1 + 4 + 400) / 3) ** 1.5, rel=1e-13)
    flat = CornerTerm(cells, CUBES).measures(points * [1.0, 1.0, 0.0])
    assert flat.fullness[0] == 0.0
    assert flat.slenderness[0] == np.inf
