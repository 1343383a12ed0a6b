"""Shape functions and measures of quadratic cells against VTK's and against integrals."""

import numpy as np
import pytest
from meshes.hexahedra import separate
from meshes.quadratic_cells import (
    HEXAHEDRA,
    QUADRATIC,
    frames,
    gradients,
    lattice,
    places_of_nodes,
    random_cells,
    reference_places,
    sampled_determinants,
    shapes,
)

from hexconformal.elements import (
    BETWEEN,
    HEXAHEDRON,
    HEXAHEDRON20,
    HEXAHEDRON27,
    MEASURES,
    edge_nodes,
    from_nodes,
    means_of_corners,
    measures_of,
    quadratic_rule,
    quadratic_shape_gradients,
    quadratic_shapes,
    reference_nodes,
)

each_type = pytest.mark.parametrize("cell_type", QUADRATIC, ids=lambda one: one.name)
each_hexahedron = pytest.mark.parametrize("cell_type", HEXAHEDRA, ids=lambda one: one.name)


def measured(cell_type, x):
    return dict(zip(MEASURES, measures_of(*separate(x), cell_type), strict=True))


@each_type
def test_nodes_and_shape_functions_are_those_of_vtk(cell_type):
    np.testing.assert_array_equal(reference_nodes(cell_type), places_of_nodes(cell_type))
    # Of pyramids those of order 2 that are rational, and quadratic on faces.
    xi = np.random.default_rng(0).random((50, 3))
    there = reference_places(cell_type, xi)
    np.testing.assert_allclose(quadratic_shapes(xi, cell_type), shapes(cell_type, there), atol=1e-14)
    np.testing.assert_allclose(quadratic_shape_gradients(xi, cell_type), gradients(cell_type, there), atol=1e-12)


@each_type
def test_derivatives_hold_where_the_cube_is_one_point_or_edge_too(cell_type):
    xi = lattice(3)
    found = reference_nodes(cell_type).T @ quadratic_shape_gradients(xi, cell_type)
    np.testing.assert_allclose(found, np.tile(np.eye(3), (len(xi), 1, 1)), atol=1e-14)


def test_a_cell_of_20_nodes_is_one_of_27():
    x, xi = random_cells(HEXAHEDRON20, 3, 0.2), lattice(4)
    raised = from_nodes(HEXAHEDRON20) @ x
    np.testing.assert_allclose(frames(HEXAHEDRON20, x, xi), frames(HEXAHEDRON27, raised, xi), atol=1e-13)
    ours, theirs = measured(HEXAHEDRON20, x), measured(HEXAHEDRON27, raised)
    for name in MEASURES:
        np.testing.assert_allclose(ours[name], theirs[name], atol=1e-12)


@each_hexahedron
def test_worst_of_nine_cubed_places(cell_type):
    x = random_cells(cell_type, 100, 0.12)
    f, found = frames(cell_type, x, lattice(9)), measured(cell_type, x)
    det, norm = np.linalg.det(f), (f**2).sum(axis=(2, 3))
    lengths = np.linalg.norm(f, axis=2).prod(axis=2)
    np.testing.assert_allclose(found["scaled_jacobian"], (det / lengths).min(axis=1), atol=1e-13)
    np.testing.assert_allclose(found["shape"], (3 * np.maximum(det, 0) ** (2 / 3) / norm).min(axis=1), atol=1e-12)
    a, b, c = np.moveaxis(f, 3, 0)
    area = sum(np.linalg.norm(np.cross(u, v), axis=2) for u, v in ((a, b), (b, c), (c, a)))
    np.testing.assert_allclose(found["conformal_distortion"], (1 - area / norm).max(axis=1), atol=1e-13)
    valid = found["minimum_jacobian"] > 0
    largest = np.abs(sampled_determinants(cell_type, x, 9)).max(axis=1)
    assert 0.5 < valid.mean() < 1
    assert (found["minimum_jacobian"] <= det.min(axis=1) / largest)[valid].all()


@each_type
def test_volume_is_the_integral(cell_type):
    x = random_cells(cell_type, 100, 0.2)
    t, weights = np.polynomial.legendre.leggauss(4)
    xi, w = (1 + np.array(np.meshgrid(t, t, t)).reshape(3, -1).T) / 2, np.prod(np.meshgrid(*[weights / 2] * 3), axis=0)
    # The cube becomes smaller where it is collapsed; the same by differences.
    before, behind = ([reference_places(cell_type, xi + h * e) for e in np.eye(3)] for h in (-1e-6, 1e-6))
    shares = w.ravel() * np.linalg.det((np.array(behind) - before).transpose(1, 0, 2) / 2e-6)
    expected = np.linalg.det(frames(cell_type, x, xi)) @ shares
    np.testing.assert_allclose(measured(cell_type, x)["volume"], expected, rtol=1e-8, atol=1e-9)


@each_type
def test_an_edge_is_as_long_as_its_curve(cell_type):
    x = cell_type.ideal.copy()
    a, b, middle = edge_nodes(cell_type)[0]
    across = np.cross(x[b] - x[a], [0.3, 0.5, 0.7])
    x[middle] += 0.1 * across / np.linalg.norm(across)
    t = np.linspace(0, 1, 10_001)
    curve = np.stack([t, 0.4 * t * (1 - t)], axis=1)
    length = np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()
    assert measured(cell_type, x[None])["edge_ratio"][0] == pytest.approx(length, rel=1e-4)


@each_type
def test_straight_cells_have_the_measures_of_linear_ones(cell_type):
    of_linear = cell_type.linear
    corners = of_linear.ideal + np.random.default_rng(2).uniform(-0.2, 0.2, (200, of_linear.corners, 3))
    found = measured(cell_type, means_of_corners(cell_type) @ corners)
    linear = measured(of_linear, corners)
    np.testing.assert_allclose(found["volume"], linear["volume"], atol=1e-14)
    np.testing.assert_allclose(found["edge_ratio"], linear["edge_ratio"], atol=1e-12)
    # Corners are among the places: what is between them is at most as good.
    for name in ("scaled_jacobian", "shape"):
        assert (found[name] <= linear[name] + 1e-12).all()
    assert (found["conformal_distortion"] >= linear["conformal_distortion"] - 1e-12).all()
    np.testing.assert_allclose(found["scaled_jacobian"], linear["scaled_jacobian"], atol=0.15)
    assert (np.abs(found["scaled_jacobian"] - linear["scaled_jacobian"]) < 1e-12).mean() > 0.4
    assert of_linear.edges.tolist() == edge_nodes(cell_type)[:, :2].tolist()


@each_type
def test_straight_cells_with_parallel_edges_have_exactly_these(cell_type):
    # One linear map of the ideal: all places are alike, but that edges of other corners have other angles.
    rng = np.random.default_rng(3)
    maps = np.eye(3) + rng.uniform(-0.4, 0.4, (100, 3, 3))
    found = measured(cell_type, cell_type.ideal @ maps)
    for name, values in measured(cell_type.linear, cell_type.linear.ideal @ maps).items():
        np.testing.assert_allclose(found[name], values, atol=1e-11, err_msg=name)


@each_type
def test_the_ideal_is_the_best_there_is(cell_type):
    found = measured(cell_type, cell_type.ideal[None])
    expected = [1.0, 1.0, 1.0, 0.0, 1.0, cell_type.volume]
    np.testing.assert_allclose([found[name][0] for name in MEASURES], expected, atol=1e-12)


@each_type
def test_measures_are_those_of_formulas_at_the_nodes_at_most(cell_type):
    x = random_cells(cell_type, 100, 0.05)
    corners = reference_nodes(cell_type)[: len(cell_type.neighbours)]
    f, found = np.einsum("cai,qaj->cqij", x, gradients(cell_type, corners)), measured(cell_type, x)
    ends = cell_type.reference_corners[cell_type.neighbours] - corners[:, None]
    edges = f @ ends.transpose(0, 2, 1)
    product = np.linalg.norm(edges, axis=2).prod(axis=2) * cell_type.corner_volume
    at_corners = (np.linalg.det(edges) / product).min(axis=1)
    assert (found["scaled_jacobian"] <= at_corners + 1e-12).all()
    assert (np.abs(found["scaled_jacobian"] - at_corners) < 1e-12).mean() > 0.3
    valid = found["minimum_jacobian"] > 0
    sampled = sampled_determinants(cell_type, x, 5)
    assert (found["minimum_jacobian"] * np.abs(sampled).max(axis=1) <= sampled.min(axis=1) + 1e-6)[valid].all()


@each_type
def test_the_rule_has_positive_weights_and_integrates_what_is_linear(cell_type):
    xi, corners, weights = quadratic_rule(cell_type)
    assert (weights > 0).all()
    assert weights.sum() == pytest.approx(1.0)
    assert set(corners.tolist()) <= set(range(len(cell_type.neighbours)))
    centre = {"hexahedron": [0.5, 0.5, 0.5], "wedge": [1 / 3, 1 / 3, 0.5], "pyramid": [0.375, 0.375, 0.25]}
    expected = centre.get(cell_type.linear.name, [0.25, 0.25, 0.25])
    np.testing.assert_allclose(weights @ reference_places(cell_type, xi), expected, atol=1e-14)


@each_type
def test_measures_do_not_depend_on_size_place_and_turn(cell_type):
    x = random_cells(cell_type, 100, 0.06)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    one, other = measured(cell_type, x), measured(cell_type, 1e3 * x @ turn + [1e4, 0, 0])
    for name in MEASURES:
        factor = 1e9 if name == "volume" else 1.0
        np.testing.assert_allclose(other[name], factor * one[name], rtol=1e-9, atol=1e-9)


def test_of_linear_cells_nodes_between_corners_are_their_mean():
    expected = np.eye(8)[[*range(8)]].tolist() + [np.eye(8)[list(among)].mean(axis=0).tolist() for among in BETWEEN]
    np.testing.assert_allclose(from_nodes(HEXAHEDRON), expected, atol=1e-15)


@each_type
def test_a_cell_that_is_negative_everywhere_has_the_worst_minimum(cell_type):
    found = measured(cell_type, (cell_type.ideal * [1.0, 1.0, -1.0])[None])
    np.testing.assert_allclose(found["minimum_jacobian"], -1.0)
    np.testing.assert_allclose(found["volume"], -cell_type.volume)
