"""Shape functions and measures of quadratic hexahedra against VTK's and against integrals."""

import numpy as np
import pytest
from meshes.hexahedra import separate
from meshes.quadratic_cells import (
    QUADRATIC,
    frames,
    lattice,
    places_of_nodes,
    random_cells,
    sampled_determinants,
    vtk_gradients,
    vtk_shapes,
)

from hexconformal.elements import (
    BETWEEN,
    EDGE_NODES,
    HEXAHEDRON,
    HEXAHEDRON20,
    HEXAHEDRON27,
    MEASURES,
    cell_measures,
    from_nodes,
    measures_of,
    quadratic_shape_gradients,
    quadratic_shapes,
)
from hexconformal.elements.hexahedron import CORNERS

each_type = pytest.mark.parametrize("cell_type", QUADRATIC, ids=lambda one: one.name)


def measured(cell_type, x):
    return dict(zip(MEASURES, measures_of(*separate(x), cell_type), strict=True))


@each_type
def test_nodes_and_shape_functions_are_those_of_vtk(cell_type):
    np.testing.assert_array_equal(cell_type.ideal, places_of_nodes(cell_type))
    xi = np.random.default_rng(0).random((50, 3))
    np.testing.assert_allclose(quadratic_shapes(xi, cell_type), vtk_shapes(cell_type, xi), atol=1e-14)
    np.testing.assert_allclose(quadratic_shape_gradients(xi, cell_type), vtk_gradients(cell_type, xi), atol=1e-13)


def test_a_cell_of_20_nodes_is_one_of_27():
    x, xi = random_cells(HEXAHEDRON20, 3, 0.2), lattice(4)
    raised = from_nodes(HEXAHEDRON20) @ x
    np.testing.assert_allclose(frames(HEXAHEDRON20, x, xi), frames(HEXAHEDRON27, raised, xi), atol=1e-13)
    ours, theirs = measured(HEXAHEDRON20, x), measured(HEXAHEDRON27, raised)
    for name in MEASURES:
        np.testing.assert_allclose(ours[name], theirs[name], atol=1e-12)


@each_type
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
    x = random_cells(cell_type, 100, 0.3)
    t, weights = np.polynomial.legendre.leggauss(3)
    xi, w = (1 + np.array(np.meshgrid(t, t, t)).reshape(3, -1).T) / 2, np.prod(np.meshgrid(*[weights / 2] * 3), axis=0)
    np.testing.assert_allclose(
        measured(cell_type, x)["volume"], np.linalg.det(frames(cell_type, x, xi)) @ w.ravel(), atol=1e-14
    )


@each_type
def test_an_edge_is_as_long_as_its_curve(cell_type):
    x = cell_type.ideal.copy()
    x[EDGE_NODES[0, 2], 1] -= 0.1
    t = np.linspace(0, 1, 10_001)
    curve = np.stack([t, -0.4 * t * (1 - t)], axis=1)
    length = np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()
    assert measured(cell_type, x[None])["edge_ratio"][0] == pytest.approx(length, rel=1e-4)


@each_type
def test_straight_cells_have_the_measures_of_linear_ones(cell_type):
    corners = CORNERS + np.random.default_rng(2).uniform(-0.2, 0.2, (200, 8, 3))
    weights = np.where(CORNERS == 1, cell_type.ideal[:, None], 1 - cell_type.ideal[:, None]).prod(axis=2)
    found = measured(cell_type, weights @ corners)
    linear = dict(zip(MEASURES, cell_measures(*separate(corners)), strict=True))
    np.testing.assert_allclose(found["volume"], linear["volume"], atol=1e-14)
    np.testing.assert_allclose(found["edge_ratio"], linear["edge_ratio"], atol=1e-12)
    # Corners are among the places: what is between them is at most as good.
    for name in ("scaled_jacobian", "shape"):
        assert (found[name] <= linear[name] + 1e-12).all()
    assert (found["conformal_distortion"] >= linear["conformal_distortion"] - 1e-12).all()
    np.testing.assert_allclose(found["scaled_jacobian"], linear["scaled_jacobian"], atol=0.15)
    assert HEXAHEDRON.edges.tolist() == EDGE_NODES[:, :2].tolist()


@each_type
def test_measures_do_not_depend_on_size_place_and_turn(cell_type):
    x = random_cells(cell_type, 100, 0.1)
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
    np.testing.assert_allclose(found["volume"], -1.0)
