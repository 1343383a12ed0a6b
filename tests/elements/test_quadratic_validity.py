"""Validity of quadratic cells against sampling, exact arithmetic, linear cells, and cells made to be hard."""

from fractions import Fraction

import numpy as np
import pytest
from meshes.hexahedra import separate
from meshes.quadratic_cells import (
    HEXAHEDRA,
    QUADRATIC,
    gradients,
    places,
    random_cells,
    reference_places,
    sampled_determinants,
)

from hexconformal.elements import (
    PYRAMID13,
    PYRAMID14,
    determinant_bounds,
    means_of_corners,
    quadratic_coefficients,
    reference_nodes,
    valid_cells,
)
from hexconformal.elements.quadratic import control_vectors
from hexconformal.elements.quadratic.validity import fill_quadratic, room_for_cell

each_type = pytest.mark.parametrize("cell_type", QUADRATIC, ids=lambda one: one.name)
each_hexahedron = pytest.mark.parametrize("cell_type", HEXAHEDRA, ids=lambda one: one.name)
# Whose det J at nodes is exact where it is computed from sums of sixty-fourths.
each_polynomial = pytest.mark.parametrize(
    "cell_type", [one for one in QUADRATIC if one not in (PYRAMID13, PYRAMID14)], ids=lambda one: one.name
)
COUNT = 20_000


@pytest.mark.long
@each_type
def test_sampling_agrees(cell_type):
    x = random_cells(cell_type, COUNT, {"tetra": 0.2, "wedge": 0.14, "pyramid": 0.13}.get(cell_type.linear.name, 0.13))
    x *= np.random.default_rng(1).uniform(0.2, 5, (COUNT, 1, 3))
    lower, upper = determinant_bounds(*separate(x), cell_type)
    valid, least = lower > 0, sampled_determinants(cell_type, x, 6).min(axis=1)
    assert 0.2 < valid.mean() < 0.9
    # Formulas of pyramids are sampled right below the apex, where something may be lost to rounding.
    assert (lower <= least + 1e-5 * np.abs(least)).all()
    # Every one is decided; what is said to be invalid, and seen by no sample, is seen by finer ones.
    assert (valid | (upper <= 0)).all()
    unseen = ~valid & (least > 0)
    assert unseen.mean() < 0.03
    finer = sampled_determinants(cell_type, x[unseen][:30], 33)
    assert (finer.min(axis=1) <= 1e-3 * finer.max(axis=1)).all()


@each_type
def test_coefficients_are_those_of_the_determinant(cell_type):
    x = random_cells(cell_type, 50, 0.3)
    t = places(cell_type, 6)
    binomials = np.array([1, 5, 10, 10, 5, 1])
    powers = np.arange(6)
    one, two, three = (binomials * v[:, None] ** powers * (1 - v[:, None]) ** (5 - powers) for v in t.T)
    values = np.einsum("qi,qj,qk->qkji", one, two, three).reshape(len(t), 216)
    found = quadratic_coefficients(*separate(x), cell_type) @ values.T
    np.testing.assert_allclose(found, sampled_determinants(cell_type, x, 6), atol=1e-12)


@each_type
def test_control_vectors_are_exact(cell_type):
    tables = control_vectors(cell_type)
    assert (tables.table * 64 == np.round(tables.table * 64)).all()
    # The derivative of a map at a corner is a control vector: three times a node less four and one of the others.
    x = random_cells(cell_type, 1, 0.3)[0]
    differences = x[tables.pairs[..., 1]] - x[tables.pairs[..., 0]]
    corner = np.einsum("adc,adr->arc", differences, tables.table)[:, 0]
    np.testing.assert_allclose(corner, (gradients(cell_type, np.zeros((1, 3)))[0].T @ x), atol=1e-14)
    # All of them are so without rounding where nodes are sixty-fourths.
    x = np.rint(64 * x) / 64
    differences = x[tables.pairs[..., 1]] - x[tables.pairs[..., 0]]
    exact = np.einsum("adc,adr->arc", differences, tables.table) / tables.binomials[..., None]
    assert (exact * 64**2 == np.round(exact * 64**2)).all()


@each_type
def test_differences_are_along_the_axis_where_lines_lead_along_it(cell_type):
    tables, x = control_vectors(cell_type), reference_nodes(cell_type)
    ways = x[tables.pairs[..., 1]] - x[tables.pairs[..., 0]]
    for axis in range(2 if cell_type in (PYRAMID13, PYRAMID14) else 3):
        assert not np.delete(ways[axis], axis, axis=1).any()
        assert (ways[axis, :, axis] >= 0).all()


@pytest.mark.long
@each_hexahedron
def test_invalid_inside_alone(cell_type, shared):
    name = cell_type.name.replace("hexahedron", "hex")
    x = np.load(shared / "meshes" / "elements" / f"{name}_invalid_inside.npy")[None]
    assert not valid_cells(*separate(x), cell_type)[0]
    assert sampled_determinants(cell_type, x, 3).min() > 0
    assert sampled_determinants(cell_type, x, 61).min() < 0


@each_type
def test_linear_cells_with_straight_edges_are_valid_as_linear_ones(cell_type):
    linear = cell_type.linear
    corners = linear.ideal + np.random.default_rng(2).uniform(-0.6, 0.6, (COUNT, linear.corners, 3))
    raised = means_of_corners(cell_type) @ corners
    expected = valid_cells(*separate(corners), linear)
    assert 0.01 < expected.mean() < 0.95
    np.testing.assert_array_equal(valid_cells(*separate(raised), cell_type), expected)


@each_type
@pytest.mark.parametrize("scale", [1e-30, 1e-3, 1e30])
def test_scale_and_place_do_not_matter(cell_type, scale):
    x = random_cells(cell_type, 2000, 0.13 if cell_type in HEXAHEDRA else 0.08)
    expected = valid_cells(*separate(x), cell_type)
    np.testing.assert_array_equal(valid_cells(*separate(scale * x), cell_type), expected)
    np.testing.assert_array_equal(valid_cells(*separate(scale * (x + 1000.0)), cell_type), expected)


@each_type
def test_mirrored_is_inside_out(cell_type):
    x = random_cells(cell_type, 200, 0.03)
    points, cells = separate(x)
    turned = cells[:, cell_type.mirrored]
    assert valid_cells(points, cells, cell_type).all()
    assert not valid_cells(points, turned, cell_type).any()
    mirrored = points * [1, 1, -1]
    np.testing.assert_array_equal(valid_cells(mirrored, turned, cell_type), True)


def exact_determinants(cell_type, x):
    """det J at the 27 nodes of the cube without rounding."""
    found = gradients(cell_type, reference_places(cell_type, places(cell_type, 3)))
    assert (np.round(found * 64) - found * 64 == 0).all()
    x = np.vectorize(Fraction)(x)
    for weights in found:
        f = np.vectorize(Fraction)(weights).T @ x
        yield sum(f[0, i] * (f[1, i - 2] * f[2, i - 1] - f[1, i - 1] * f[2, i - 2]) for i in range(3))


@pytest.mark.long
@each_polynomial
def test_what_is_said_to_be_valid_is_valid_however_flat(cell_type):
    rng = np.random.default_rng(3)
    x = random_cells(cell_type, 100, 0.02)
    # Flat up to rounding, and turned so that it is rounded everywhere.
    x[:, :, 2] *= 10.0 ** rng.uniform(-18, -10, (len(x), 1))
    x = x @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=(len(x), 1, 3))
    valid = valid_cells(*separate(x), cell_type)
    truly = np.array([min(exact_determinants(cell_type, one)) > 0 for one in x])
    assert not (valid & ~truly).any()
    assert 0.1 < valid.mean() < truly.mean() < 1


@each_polynomial
def test_rounding_is_bounded(cell_type):
    rng = np.random.default_rng(4)
    x = random_cells(cell_type, 20, 0.05) * [1, 1, 1e-6] @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + 1.0
    lower, _ = determinant_bounds(*separate(x), cell_type)
    for one, bound in zip(x, lower, strict=True):
        assert Fraction(float(bound)) <= min(exact_determinants(cell_type, one))


@each_type
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_none_make_no_valid_cell(cell_type, bad):
    for node in cell_type.nodes:
        x = cell_type.ideal.copy()
        x[node, 1] = bad
        assert not valid_cells(x, np.array([cell_type.nodes]), cell_type)[0]


@each_type
def test_what_touches_zero_is_given_up(cell_type):
    # x -> x^2 has no slope at x = 0.
    places = reference_nodes(cell_type)
    x = places.copy()
    x[:, 0] = x[:, 0] ** 2
    assert not valid_cells(x, np.array([cell_type.nodes]), cell_type)[0]
    x[:, 0] += 1e-6 * places[:, 0]
    assert valid_cells(x, np.array([cell_type.nodes]), cell_type)[0]


@each_hexahedron
def test_rounding_is_measured_by_the_sizes_of_the_control_vectors(cell_type):
    # Those of a brick are its edges, and differences of nodes are half as long.
    tables, out = control_vectors(cell_type), np.empty(216)
    points = cell_type.ideal * [1.0, 2.0, 3.0]
    cells = np.arange(len(points))[None]
    assert fill_quadratic(points, cells, 0, tables.for_loops, room_for_cell(), out) == pytest.approx(
        6 * tables.rounding
    )
    np.testing.assert_allclose(out, 6.0)


@each_type
def test_the_other_side_of_a_cell_is_named_by_its_mirrored_nodes(cell_type):
    x = random_cells(cell_type, 10, 0.03)
    there = determinant_bounds(*separate(x), cell_type)
    back = determinant_bounds(*separate((x * [1.0, 1.0, -1.0])[:, list(cell_type.mirrored)]), cell_type)
    np.testing.assert_allclose(back, there, rtol=1e-9)
