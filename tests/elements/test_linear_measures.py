"""Measures of tetrahedra, wedges and pyramids against Verdict, the energy, and what holds by definition."""

import numpy as np
import pytest
from meshes.hexahedra import separate
from meshes.linear_cells import OTHERS, TYPES, determinants, random_cells, renumberings

from hexconformal.elements import CELL_TYPES, MEASURES, cell_volumes, measures_of, valid_cells
from hexconformal.elements.hexahedron import CORNERS, HEXAHEDRON
from hexconformal.kernel.distortion import frame_density

each_type = pytest.mark.parametrize("cell_type", OTHERS, ids=lambda one: one.name)


def measured(cell_type, x):
    return dict(zip(MEASURES, measures_of(*separate(x), cell_type), strict=True))


def verdict(cell_type, x, name):
    pyvista = pytest.importorskip("pyvista")
    points, cells = separate(x)
    return np.asarray(pyvista.UnstructuredGrid({cell_type.vtk: cells}, points).cell_quality(name)[name])


@pytest.mark.parametrize("cell_type", TYPES, ids=lambda one: one.name)
def test_the_ideal_of_each_type_is_the_best(cell_type):
    turned = 3.0 * cell_type.ideal @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turned = turned if np.linalg.det(turned[cell_type.neighbours[0]] - turned[0]) > 0 else -turned
    best = measured(cell_type, turned[None])
    for name in ("scaled_jacobian", "minimum_jacobian", "shape", "edge_ratio"):
        assert best[name][0] == pytest.approx(1, abs=1e-13)
    assert best["conformal_distortion"][0] == pytest.approx(0, abs=1e-13)
    assert best["volume"][0] == pytest.approx(27 * cell_type.volume, rel=1e-13)
    others = measured(cell_type, random_cells(cell_type, 5000, 0.3))
    for name in ("scaled_jacobian", "minimum_jacobian", "shape"):
        assert others[name].max() <= 1


@pytest.mark.parametrize(("name", "amount"), [("tetra", 0.6), ("wedge", 0.25)])
def test_scaled_jacobian_is_that_of_verdict(name, amount):
    cell_type = CELL_TYPES[name]
    x = random_cells(cell_type, 3000, amount)
    ours, theirs = measured(cell_type, x)["scaled_jacobian"], verdict(cell_type, x, "scaled_jacobian")
    assert (ours > 0).mean() > 0.8
    assert name == "wedge" or (ours < -0.2).any()
    np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_shape_is_that_of_verdict_for_tetrahedra():
    # Verdict's is another one for wedges and pyramids.
    x = random_cells(CELL_TYPES["tetra"], 3000, 0.4)
    ours = measured(CELL_TYPES["tetra"], x)["shape"]
    sound = ours > 0
    assert np.ptp(ours[sound]) > 0.5
    np.testing.assert_allclose(ours[sound], verdict(CELL_TYPES["tetra"], x, "shape")[sound], atol=1e-12)


@pytest.mark.parametrize("cell_type", OTHERS, ids=lambda one: one.name)
def test_volume_is_that_of_vtk_where_faces_are_flat(cell_type):
    x = cell_type.ideal @ np.random.default_rng(2).normal(size=(500, 3, 3))
    np.testing.assert_allclose(measured(cell_type, x)["volume"], verdict(cell_type, x, "volume"), rtol=1e-10)


@each_type
def test_edge_ratio_counts_all_edges(cell_type):
    x = random_cells(cell_type, 1000, 0.4)
    distances = np.linalg.norm(x[:, :, None] - x[:, None], axis=3)
    near = np.isclose(np.linalg.norm(cell_type.ideal[:, None] - cell_type.ideal[None], axis=2), 1)
    lengths = distances[:, near & (np.arange(len(near))[:, None] < np.arange(len(near)))]
    if cell_type.name == "wedge":
        assert lengths.shape[1] == 9
    np.testing.assert_allclose(measured(cell_type, x)["edge_ratio"], lengths.max(axis=1) / lengths.min(axis=1))


@each_type
def test_conformal_distortion_is_the_energy_of_the_worst_corner(cell_type):
    x = random_cells(cell_type, 1000, 0.4)
    corners = list(cell_type.samples)
    frames = np.swapaxes(x[:, cell_type.neighbours[corners]] - x[:, corners, None], -1, -2) @ cell_type.inverse_target
    density = frame_density(tuple(tuple(frames[..., k, i] for k in range(3)) for i in range(3)))
    expected = (density / (4 * (frames**2).sum(axis=(-1, -2)))).max(axis=1)
    ours = measured(cell_type, x)
    np.testing.assert_allclose(ours["conformal_distortion"], expected, atol=1e-13)
    # Equation (7), cell by cell.
    determinant = np.linalg.det(frames)
    ratios = 3 * np.maximum(determinant, 0) ** (2 / 3) / (frames**2).sum(axis=(-1, -2))
    np.testing.assert_allclose(ours["shape"], ratios.min(axis=1), atol=1e-13)


@each_type
def test_minimum_jacobian_is_certified(cell_type):
    x = random_cells(cell_type, 2000, 0.8)
    ours, valid = measured(cell_type, x)["minimum_jacobian"], valid_cells(*separate(x), cell_type)
    np.testing.assert_array_equal(ours > 0, valid)
    assert 0.2 < valid.mean() < 0.95
    places = np.random.default_rng(1).dirichlet(np.ones(4), 200)[:, :3]
    values = determinants(cell_type, x, places)
    ratio = values.min(axis=1) / np.abs(values).max(axis=1)
    assert (ours[valid] <= ratio[valid] + 1e-12).all()
    assert (np.abs(ours) <= 1).all()


def gauss_volumes(cell_type, x):
    """Integrals of det J by a product rule on the cube, whose upper face or edges are collapsed."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    nodes, weights = (nodes + 1) / 2, weights / 2
    total = 0.0
    for a, u in zip(nodes, weights, strict=True):
        for b, v in zip(nodes, weights, strict=True):
            for t, w in zip(nodes, weights, strict=True):
                if cell_type.name == "pyramid":
                    place, jacobian = (a, b, t), (1 - t) ** 2
                elif cell_type.name == "wedge":
                    place, jacobian = (a, b * (1 - a), t), 1 - a
                else:
                    place, jacobian = (a, b * (1 - a), t * (1 - a) * (1 - b)), (1 - a) ** 2 * (1 - b)
                total = total + u * v * w * jacobian * determinants(cell_type, x, np.array([place]))[:, 0]
    return total


@each_type
def test_volumes_are_integrals_of_the_determinant(cell_type):
    x = random_cells(cell_type, 200, 0.4)
    np.testing.assert_allclose(measured(cell_type, x)["volume"], gauss_volumes(cell_type, x), atol=1e-13)


def test_volumes_of_the_parts_of_a_hexahedron_add_up():
    # Over warped faces, too: six pyramids share a point, and two wedges a plane that is warped alike.
    x = CORNERS + np.random.default_rng(4).uniform(-0.3, 0.3, (500, 8, 3))
    whole = cell_volumes(*separate(x))
    point = np.random.default_rng(5).uniform(0, 1, (500, 1, 3))
    pyramids = [np.concatenate([x[:, list(face[::-1])], point], axis=1) for face in HEXAHEDRON.faces]
    np.testing.assert_allclose(
        sum(measured(CELL_TYPES["pyramid"], one)["volume"] for one in pyramids), whole, atol=1e-13
    )
    flat = x.copy()
    flat[:, 4:, 2], flat[:, :4, 2] = 1.0, 0.0
    wedges = [flat[:, [0, 1, 2, 4, 5, 6]], flat[:, [0, 2, 3, 4, 6, 7]]]
    total = sum(measured(CELL_TYPES["wedge"], one)["volume"] for one in wedges)
    np.testing.assert_allclose(total, cell_volumes(*separate(flat)), atol=1e-13)


@each_type
def test_measures_do_not_depend_on_the_order_of_nodes(cell_type):
    x = random_cells(cell_type, 300, 0.7)
    expected = measured(cell_type, x)
    for order in renumberings(cell_type):
        for name, values in measured(cell_type, x[:, order]).items():
            np.testing.assert_allclose(values, expected[name], rtol=1e-9, atol=1e-9)


@each_type
@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_scale_and_place_do_not_matter(cell_type, scale):
    x = random_cells(cell_type, 300, 0.5)
    here, there = measured(cell_type, x), measured(cell_type, scale * (x + 100.0))
    for name in MEASURES[:-1]:
        np.testing.assert_allclose(there[name], here[name], atol=1e-10)
    np.testing.assert_allclose(there["volume"] / scale**3, here["volume"], atol=1e-10)


@each_type
def test_cells_inside_out_and_without_size_have_finite_bad_values(cell_type):
    x = random_cells(cell_type, 200, 0.2)
    turned, sound = measured(cell_type, x[:, list(cell_type.mirrored)]), measured(cell_type, x)
    np.testing.assert_allclose(turned["volume"], -sound["volume"], atol=1e-15)
    assert (turned["scaled_jacobian"] < 0).all()
    assert (turned["shape"] == 0).all()
    assert (turned["minimum_jacobian"] < 0).all()
    x[:, 1] = x[:, 0]
    for cells in (x, np.zeros_like(x)):
        bad = measured(cell_type, cells)
        assert (bad["scaled_jacobian"] <= 0).all()
        assert (bad["shape"] < 1e-9).all()
        assert (bad["minimum_jacobian"] <= 0).all()
        assert (bad["edge_ratio"] == np.inf).all()
        assert not any(np.isnan(values).any() for values in bad.values())
