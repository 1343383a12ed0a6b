"""Objectives are the sums of their terms, in every respect."""

import numpy as np
import pytest
from corner_problems import CUBES, convex, dense, jittered_cubes

from hexconformal.energy import (
    Assembly,
    CornerTerm,
    CornerWeights,
    DistortionTerm,
    Objective,
    Patch,
    Term,
    VolumeTerm,
)
from hexconformal.mesh.topology import node_rings


class Away(Term):
    """A weight times the squared distance from where it was last looked from; infinite beyond a limit."""

    def __init__(self, center, weight=1.0, limit=np.inf):
        self.center, self.weight, self.limit, self.calls = center, weight, limit, []

    def value(self, points):
        self.calls.append("value")
        away = ((points - self.center) ** 2).sum()
        return float(self.weight * away) if away < self.limit else np.inf

    def value_gradient(self, points):
        return self.value(points), 2.0 * self.weight * (points - self.center)

    def add_convex(self, points, gradient, assembly):
        value, own = self.value_gradient(points)
        gradient += own
        return value, self.renewed(points)

    def restricted(self, patch):
        return Away(self.center[patch.nodes], self.weight, self.limit)

    def renewed(self, points):
        return self if np.array_equal(points, self.center) else Away(points, self.weight, self.limit)


@pytest.fixture
def mesh():
    return jittered_cubes(3, 0.3)


def terms_of(points, cells):
    rng = np.random.default_rng(4)
    return (
        DistortionTerm(cells, len(points), scales=rng.uniform(0.5, 2.0, len(cells))),
        VolumeTerm(cells, rng.uniform(0.5, 2.0, len(cells)), 3.0),
        CornerTerm(cells, CUBES, CornerWeights(0.2, 1.0)),
    )


def test_value_gradient_products_and_blocks_are_sums(mesh):
    points, cells = mesh
    terms = terms_of(points, cells)
    objective, field = Objective(terms), np.random.default_rng(0).normal(size=points.shape)
    value, gradient = objective.value_gradient(points)
    assert objective.value(points) == pytest.approx(sum(term.value(points) for term in terms), rel=1e-14)
    assert value == pytest.approx(objective.value(points), rel=1e-13)
    near = {"rtol": 0, "atol": 1e-12 * np.abs(gradient).max()}
    np.testing.assert_allclose(gradient, sum(term.value_gradient(points)[1] for term in terms), **near)
    for name in ("second_product", "frozen_product"):
        total = sum(getattr(term, name)(points, field) for term in terms)
        np.testing.assert_allclose(getattr(objective, name)(points, field), total, rtol=1e-12, atol=1e-9)
    # An assembly that has been used before is emptied first.
    assembly = Assembly.of_cells(cells, np.ones(len(points), dtype=bool), diagonals=True)
    for _ in range(2):
        value, gradient, seen = objective.convex(points, assembly)
    each = [convex(term, points, cells, diagonals=True) for term in terms]
    assert value == pytest.approx(sum(one[0] for one in each), rel=1e-13)
    np.testing.assert_allclose(gradient, sum(one[1] for one in each), **near)
    full = dense(assembly.matrix)
    np.testing.assert_allclose(full, sum(one[2] for one in each), rtol=0, atol=1e-12 * np.abs(full).max())
    assert all(one is other for one, other in zip(seen.terms, terms, strict=True))


def test_sums_leave_the_terms_fields_alone(mesh):
    # A term may hand out the same field twice; the sum must not be written there.
    points, cells = mesh
    objective = Objective(terms_of(points, cells))
    first = objective.value_gradient(points)[1]
    again = objective.value_gradient(points)[1]
    np.testing.assert_array_equal(first, again)


def test_what_is_infinite_ends_the_sum(mesh):
    points, _ = mesh
    for nonsense in (0.0, np.nan):
        first, last = Away(points, limit=nonsense), Away(points)
        assert Objective((first, last)).value(points + 1.0) == np.inf
        assert (first.calls, last.calls) == (["value"], [])
    assert Objective((last, first)).value(points + 1.0) == np.inf
    assert last.calls == ["value"]


def test_restricted_it_is_the_sum_of_its_terms_in_the_patch(mesh):
    points, cells = mesh
    terms = (*terms_of(points, cells), Away(points + 0.1))
    patch = Patch.around(node_rings(cells, len(points), np.arange(len(cells)) == 0, 0), cells, points)
    part, inside = Objective(terms).restricted(patch), points[patch.nodes]
    assert part.value(inside) == pytest.approx(sum(term.restricted(patch).value(inside) for term in terms), rel=1e-14)
    # Where a node of the patch moves, both change by the same.
    moved = points.copy()
    moved[patch.moving] += 0.05 * np.random.default_rng(1).normal(size=(patch.moving.sum(), 3))
    whole = Objective(terms)
    change = whole.value(moved) - whole.value(points)
    assert part.value(moved[patch.nodes]) - part.value(inside) == pytest.approx(change, rel=1e-10)
    gradient = whole.value_gradient(points)[1][patch.moving]
    near = 1e-12 * np.abs(gradient).max()
    here = part.value_gradient(inside)[1][patch.local[patch.moving]]
    np.testing.assert_allclose(here, gradient, rtol=0, atol=near)


def test_it_is_renewed_where_a_term_is_and_else_stays_the_same(mesh):
    points, cells = mesh
    terms = (*terms_of(points, cells), Away(points))
    objective = Objective(terms)
    assert objective.renewed(points) is objective
    other = objective.renewed(points + 1.0)
    assert other.value(points + 1.0) == pytest.approx(Objective(terms[:-1]).value(points + 1.0), rel=1e-14)
    assert objective.terms[-1] is terms[-1]
    # The convex blocks come with the objective as it is seen from there.
    assembly = Assembly.of_cells(cells, np.ones(len(points), dtype=bool), diagonals=True)
    value, _, seen = objective.convex(points + 1.0, assembly)
    assert value == pytest.approx(objective.value(points + 1.0), rel=1e-13)
    assert seen.value(points + 1.0) == other.value(points + 1.0)
