"""The certificate against dense sampling, the design's fixture, and cells made to be hard."""

import numpy as np
import pytest
from meshes.hexahedra import INVALID_INSIDE, separate
from scipy.optimize import minimize

from hexconformal.elements import all_valid, corner_scaled_jacobian, is_valid, minimum_jacobian
from hexconformal.elements.hexahedron import CORNERS, gauss_rule, shape_gradients
from hexconformal.elements.validity import bernstein_coefficients, hexahedron_bounds
from hexconformal.generate import box

ONE = np.arange(8)[None]


def lattice(k):
    return np.stack(np.meshgrid(*[np.linspace(0, 1, k)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


def det(x, xi):
    """(m, q) determinant of J at reference points: differentiates the shape functions, no Bernstein anywhere."""
    return np.linalg.det(np.einsum("cai,qaj->cqij", x, shape_gradients(xi)))


def random_hexes(count, amount, seed=0):
    x = CORNERS + np.random.default_rng(seed).uniform(-amount, amount, (count, 8, 3))
    return x, *separate(x)


def test_coefficients_are_those_of_det_j():
    x, *_ = random_hexes(20, 0.5)
    xi = np.random.default_rng(1).uniform(size=(30, 3))
    basis = np.stack([(1 - xi) ** 2, 2 * xi * (1 - xi), xi**2])  # (degree, q, axis)
    values = np.einsum("iq,jq,kq,ckji->cq", *np.moveaxis(basis, 2, 0), bernstein_coefficients(x).reshape(-1, 3, 3, 3))
    np.testing.assert_allclose(values, det(x, xi), atol=1e-13)


def test_compiled_bounds_agree_with_the_readable_ones():
    x, points, cells = random_hexes(3000, 0.5)
    reference = bernstein_coefficients(x)
    lower, upper = minimum_jacobian(points, cells)
    decided = (reference.min(axis=1) > 1e-9) | (reference[:, [0, 2, 6, 8, 18, 20, 24, 26]].min(axis=1) <= 0)
    assert 0.5 < decided.mean() < 1
    np.testing.assert_allclose(lower[decided], reference[decided].min(axis=1), atol=1e-12)
    np.testing.assert_allclose(
        upper[decided], reference[decided][:, [0, 2, 6, 8, 18, 20, 24, 26]].min(axis=1), atol=1e-12
    )


def test_a_cell_negative_only_between_all_usual_points_is_invalid():
    x = INVALID_INSIDE[None]
    assert corner_scaled_jacobian(INVALID_INSIDE, ONE)[0] == pytest.approx(0.4075, abs=1e-4)
    assert det(x, gauss_rule()[0]).min() > 0
    assert det(x, lattice(3)).min() == pytest.approx(0.073, abs=1e-3)
    assert det(x, lattice(41)).min() == pytest.approx(-0.042, abs=1e-3)
    assert bernstein_coefficients(x).min() == pytest.approx(-0.7770163390, abs=1e-10)
    lower, upper = minimum_jacobian(INVALID_INSIDE, ONE)
    assert lower[0] <= det(x, lattice(41)).min()
    assert upper[0] < 0
    assert not is_valid(INVALID_INSIDE, ONE)[0]
    assert not all_valid(INVALID_INSIDE, ONE)


@pytest.mark.long
@pytest.mark.parametrize(("count", "k"), [(2000, 9), (8, 41)])
@pytest.mark.parametrize("amount", [0.4, 0.55, 0.9])
def test_bounds_hold_at_every_sample(count, k, amount):
    x, points, cells = random_hexes(count, amount, seed=k)
    lower, upper = minimum_jacobian(points, cells)
    samples = np.concatenate([det(part, lattice(k)).min(axis=1) for part in np.array_split(x, 8)])
    assert (lower <= samples + 1e-12).all()
    assert (lower <= upper).all()
    valid = is_valid(points, cells)
    assert (samples[valid] > 0).all()
    # What is not proved valid is proved invalid: nothing stays undecided in practice.
    assert (upper[~valid] <= 0).all()


def test_rates_of_cells_that_usual_tests_accept_wrongly():
    x, points, cells = random_hexes(20000, 0.5)
    invalid = ~is_valid(points, cells)
    gauss = (det(x, gauss_rule()[0]) > 0).all(axis=1)
    corners = corner_scaled_jacobian(points, cells) > 0
    assert 0.38 < (gauss & invalid).sum() / gauss.sum() < 0.43
    assert 0.002 < (corners & invalid).sum() / corners.sum() < 0.013
    assert not (~corners & ~invalid).any()


def test_the_verdict_changes_where_the_minimum_passes_zero():
    def blend(t):
        return (1 - t) * CORNERS + t * INVALID_INSIDE

    low, high = 0.0, 1.0
    for _ in range(50):  # ends on the last cell that is proved valid
        middle = (low + high) / 2
        low, high = (middle, high) if is_valid(blend(middle), ONE)[0] else (low, middle)
    x = blend(low)[None]
    start = lattice(41)[det(x, lattice(41)).argmin()]
    best = minimize(lambda xi: det(x, xi[None])[0, 0], start, bounds=[(0, 1)] * 3, tol=1e-14)
    assert 0 < best.fun < 1e-4  # halving eight times leaves about 4**-8 undecided
    assert high - low < 1e-14


def test_subdivision_proves_what_27_coefficients_cannot():
    x, points, cells = random_hexes(5000, 0.55)
    undecided = (bernstein_coefficients(x).min(axis=1) < 0) & (det(x, lattice(7)).min(axis=1) > 0.02)
    assert undecided.sum() > 50
    assert not (hexahedron_bounds(points, cells[undecided], depth=0)[0] > 0).any()
    assert is_valid(points, cells[undecided]).mean() > 0.95


@pytest.mark.parametrize("scale", [2.0**-30, 2.0**30, 1e-9, 1e9])
def test_the_unit_of_length_does_not_matter(scale):
    _, points, cells = random_hexes(5000, 0.5)
    np.testing.assert_array_equal(is_valid(scale * points, cells), is_valid(points, cells))


def test_far_from_the_origin_and_turned():
    _, points, cells = random_hexes(5000, 0.5)
    points = np.round(points, 5) + 0.0
    valid = is_valid(points, cells)
    np.testing.assert_array_equal(is_valid(points + 1e6, cells), valid)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    np.testing.assert_array_equal(is_valid(points @ turn, cells), valid)
    assert not (is_valid(-points, cells) & valid).any()


def test_thin_cells_are_valid_and_flat_ones_are_not():
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    assert is_valid(CORNERS * [1, 1e-4, 1e4] @ turn, ONE)[0]
    assert is_valid(CORNERS * [1, 1e-8, 1] @ turn, ONE)[0]
    assert not is_valid(CORNERS * [1.0, 0.0, 1.0] @ turn, ONE)[0]
    # Flat in general position: det J is nothing but rounding, positive everywhere in some cells.
    rng = np.random.default_rng(0)
    x = CORNERS @ (rng.normal(size=(2000, 3, 2)) @ rng.normal(size=(2000, 2, 3)))
    assert (bernstein_coefficients(x).min(axis=1) > 0).any()
    assert not is_valid(x.reshape(-1, 3), np.arange(16000).reshape(-1, 8)).any()


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda x: x[[0, 1, 2, 2, 4, 5, 6, 6]], id="collapsed edge"),
        pytest.param(lambda x: 0 * x, id="point"),
        pytest.param(lambda x: x[[1, 0, 2, 3, 5, 4, 6, 7]], id="twisted"),
        pytest.param(lambda x: np.where(np.arange(24).reshape(8, 3) == 19, np.nan, x), id="NaN"),
        pytest.param(lambda x: np.where(np.arange(24).reshape(8, 3) == 0, np.inf, x), id="inf"),
    ],
)
def test_degenerate_cells_are_not_valid(change):
    points = change(CORNERS.astype(float))
    assert not is_valid(points, ONE)[0]
    assert not all_valid(points, ONE)


def test_all_valid_sees_one_bad_cell_wherever_it_is():
    points, cells = box((20, 20, 20))
    points = np.asfortranarray(points)
    points.flags.writeable = False
    assert all_valid(points, cells)
    for bad in (0, 4321, 7999):
        mirrored = cells.copy()
        mirrored[bad] = mirrored[bad][[4, 5, 6, 7, 0, 1, 2, 3]]
        assert not all_valid(points, mirrored)
        assert all_valid(points, mirrored, among=np.delete(np.arange(8000), bad))
        assert not all_valid(points, mirrored, among=np.array([5, bad]))
    assert all_valid(points, cells, among=np.array([], dtype=np.int64))


def test_the_number_of_threads_changes_nothing(monkeypatch):
    _, points, cells = random_hexes(9000, 0.5)
    together = minimum_jacobian(points, cells)
    monkeypatch.setattr("hexconformal.kernel.threads.thread_count", lambda: 1)
    np.testing.assert_array_equal(minimum_jacobian(points, cells), together)


def test_bounds_after_bisection_are_bounds():
    x, points, cells = random_hexes(20_000, 0.4)
    lower, upper = hexahedron_bounds(points, cells)
    bisected = (lower > 0) & (bernstein_coefficients(x).reshape(len(x), -1).min(axis=1) <= 0)
    assert bisected.sum() > 10
    assert (lower <= upper).all()
    assert (lower[bisected] <= det(x[bisected], lattice(9)).min(axis=1)).all()
    assert np.isfinite(lower).all()
