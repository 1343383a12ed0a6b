"""The soft minimum of the scaled Jacobian, and terms of points that depend linearly on the mesh's."""

import numpy as np
import pytest
from differences import observed_order
from scipy import sparse

from hexconformal import generate
from hexconformal.elements import corner_scaled_jacobian
from hexconformal.energy import ComposedTerm, DistortionTerm, Objective, Patch, SoftMinimumTerm, corner_jacobians

POINTS, CELLS = generate.jittered(*generate.box((3, 3, 3)), 0.3, seed=4)
WAY = np.random.default_rng(1).normal(size=POINTS.shape)


def soft_minimum(sharpness=16.0, floor=0.5):
    """That of every third cell; the others lose something already."""
    raised = np.arange(len(CELLS)) % 3 == 0
    kept = corner_jacobians(POINTS, CELLS)[0][~raised] + 0.05
    return SoftMinimumTerm(CELLS, raised, sharpness, kept, np.full(len(kept), floor), 10.0, 0.5)


def composed(quadrature="gauss"):
    """The distortion of the mesh halved and turned."""
    random = np.random.default_rng(2)
    mixed = sparse.csr_array(sparse.eye_array(len(POINTS)) + 0.02 * sparse.random_array((len(POINTS),) * 2, rng=random))
    return ComposedTerm(DistortionTerm(CELLS, len(POINTS), None, None, 0.0, quadrature), mixed)


@pytest.mark.parametrize("term", [soft_minimum(), composed()])
def test_gradients_agree_with_differences_to_second_order(term):
    value, gradient = term.value_gradient(POINTS)
    assert term.value(POINTS) == pytest.approx(value, rel=1e-14)
    order = observed_order(lambda t: term.value(POINTS + t * WAY), (gradient * WAY).sum(), (2e-4, 1e-4))
    assert order == pytest.approx(2.0, abs=0.1)


def test_the_soft_minimum_is_at_most_the_minimum_and_comes_to_it():
    quality = corner_scaled_jacobian(POINTS, CELLS)
    raised = np.arange(len(CELLS)) % 3 == 0
    nothing = np.zeros((int((~raised).sum()), 8)) - 1.0, np.full(int((~raised).sum()), -1.0)
    values = [-SoftMinimumTerm(CELLS, raised, s, *nothing, 1.0, 1.0).value(POINTS) for s in (8.0, 64.0, 512.0)]
    assert values[0] < values[1] < values[2] < quality[raised].min()
    assert values[2] == pytest.approx(quality[raised].min(), abs=1e-2)


def test_what_others_lose_is_paid_for_in_squares():
    term = soft_minimum(floor=0.9)
    jacobians = corner_jacobians(POINTS, CELLS)[0][~term.raised]
    paid = 10.0 * (np.maximum(0.9 - jacobians, 0.0) ** 2).sum() + 0.5 * (0.05**2) * jacobians.size
    free = SoftMinimumTerm(CELLS, term.raised, 16.0, term.kept, term.floor, 0.0, 0.0)
    assert term.value(POINTS) - free.value(POINTS) == pytest.approx(paid, rel=1e-12)


@pytest.mark.parametrize("term", [soft_minimum(), composed()])
def test_restricted_to_a_patch_they_change_as_the_whole_does(term):
    moving = np.zeros(len(POINTS), dtype=bool)
    moving[CELLS[0, 0]] = True
    patch = Patch.around(moving, CELLS, POINTS)
    part = term.restricted(patch)
    shift = 0.01 * WAY * moving[:, None]
    there = (POINTS + shift)[patch.nodes]
    change = part.value(there) - part.value(POINTS[patch.nodes])
    # The soft minimum of a part is another one: its own cells count alone.
    if isinstance(term, ComposedTerm):
        assert change == pytest.approx(term.value(POINTS + shift) - term.value(POINTS), rel=1e-9)
    gradient = part.value_gradient(there)[1]
    way = WAY[patch.nodes]
    order = observed_order(lambda t: part.value(there + t * way), (gradient * way).sum(), (2e-4, 1e-4))
    assert order == pytest.approx(2.0, abs=0.1)


def test_the_second_derivative_of_a_composed_term_is_that_of_differences():
    term = composed("corners")
    expected = super(ComposedTerm, term).second_product(POINTS, WAY)
    np.testing.assert_allclose(term.second_product(POINTS, WAY), expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("term", [soft_minimum(), composed()])
def test_without_a_convex_part_they_say_what_to_do(term):
    with pytest.raises(NotImplementedError, match=f"{type(term).__name__} has no convex part: minimize it by L-BFGS"):
        Objective((term,)).terms[0].add_convex(POINTS, np.zeros_like(POINTS), None)


@pytest.mark.filterwarnings("error")
def test_of_no_cells_that_are_raised_there_is_only_what_others_lose():
    none = np.zeros(len(CELLS), dtype=bool)
    kept = corner_jacobians(POINTS, CELLS)[0] + 0.05
    term = SoftMinimumTerm(CELLS, none, 16.0, kept, np.full(len(kept), -1.0), 10.0, 0.5)
    value, gradient = term.value_gradient(POINTS)
    assert value == pytest.approx(0.5 * 8 * len(CELLS) * 0.05**2)
    order = observed_order(lambda t: term.value(POINTS + t * WAY), (gradient * WAY).sum(), (2e-4, 1e-4))
    assert order == pytest.approx(2.0, abs=0.1)
