"""What stays folded is made less bad, and nothing else is spoiled for it."""

import numpy as np
import pytest
from corner_problems import fixed_boundary

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements import corner_scaled_jacobian, is_valid
from hexconformal.elements.hexahedron import CORNER_NEIGHBOURS
from hexconformal.energy.soft_minimum import corner_jacobians
from hexconformal.untangling.improve_folded import improve_folded


def swapped():
    """A jittered cube, two neighbours on top of which have changed places: with that surface no mesh of it is valid."""
    points, cells = generate.jittered(*generate.box((5, 5, 5)), 0.2, seed=4)
    pair = [np.linalg.norm(points - [x, 0.4, 1.0], axis=1).argmin() for x in (0.4, 0.6)]
    points[pair] = points[pair[::-1]]
    return points, cells


@pytest.mark.long
@pytest.mark.parametrize("seed", range(6))
def test_the_worst_folded_cell_is_raised_and_no_other_spoiled(seed):
    # Where the search ends depends on the last digits: what is asserted holds from wherever it starts.
    points, cells = swapped()
    points = points + 1e-12 * np.random.default_rng(seed).normal(size=points.shape)
    formulation, before = fixed_boundary(points, cells), corner_scaled_jacobian(points, cells)
    bad, valid = before <= 0.0, is_valid(points, cells)
    result = improve_folded(formulation, points, bad)
    after = corner_scaled_jacobian(result, cells)
    assert before.min() == pytest.approx(-0.518, abs=1e-3)
    assert after.min() > before.min() + 0.3
    assert (after[~bad] > 0.05).all()
    assert after.mean() > before.mean() - 0.025
    assert is_valid(result, cells)[valid].all()
    assert np.array_equal(result[~formulation.free], points[~formulation.free])


def test_a_run_ends_with_it():
    points, cells = swapped()
    phases = []
    report = hc.regularize((points, cells), boundary="fixed", callback=lambda record: phases.append(record)).report
    assert phases[-1].phase == "improve what stays inverted"
    assert report.after.inverted == phases[-2].inverted == 2
    assert report.after.scaled_jacobian.min > phases[-2].min_scaled_jacobian + 0.2
    assert report.after.scaled_jacobian.mean > report.before.scaled_jacobian.mean + 0.05


def test_derivatives_ofcorner_jacobians():
    points, cells = generate.jittered(*generate.box((2, 2, 2)), 0.4, seed=0)
    direction = np.random.default_rng(1).normal(size=points.shape)
    values, derivatives = corner_jacobians(points, cells)
    np.testing.assert_allclose(values.min(axis=1), corner_scaled_jacobian(points, cells), atol=1e-14)
    edges = direction[cells[:, CORNER_NEIGHBOURS]] - direction[cells][:, :, None]
    expected, errors = (edges * derivatives).sum(axis=(2, 3)), []
    for h in (1e-3, 1e-4):
        ahead, behind = (corner_jacobians(points + s * h * direction, cells)[0] for s in (1, -1))
        errors.append(np.abs((ahead - behind) / (2 * h) - expected).max())
    assert errors[1] < 0.011 * errors[0]
