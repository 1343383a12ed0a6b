"""The distortion of quadratic cells against numpy, differences, and the similarities it must not see."""

import itertools

import numpy as np
import pytest
from meshes.quadratic_cells import HEXAHEDRA, QUADRATIC, frames, lattice, random_cells

import hexconformal as hc
from hexconformal.elements import between, edge_derivatives, quadratic_rule
from hexconformal.energy import CornerWeights, Patch, QuadraticTerm
from hexconformal.kernel import barrier_gradient

each_type = pytest.mark.parametrize("cell_type", QUADRATIC, ids=lambda one: one.name)
each_hexahedron = pytest.mark.parametrize("cell_type", HEXAHEDRA, ids=lambda one: one.name)


def edges_at_points(cell_type, x):
    """(q, 3, 3) edges of the corners as which the points of the rule are measured, as columns; and weights (q,)."""
    xi, corners, weights = quadratic_rule(cell_type)
    return np.einsum("iaq,ar->qri", edge_derivatives(cell_type, xi, corners), x), weights


def jacobians(cell_type, x):
    """(q, 3, 3) J at the points of the rule, and weights (q,)."""
    edges, weights = edges_at_points(cell_type, x)
    return edges @ cell_type.inverse_target, weights


def term_of(cell_type, boxes=None, evenness=1.0, **weights):
    nodes = len(cell_type.nodes)
    return QuadraticTerm(np.arange(nodes)[None], cell_type, nodes, boxes, CornerWeights(**weights), evenness)


def hessian(term, x):
    columns = []
    for i in range(x.size):
        variation = np.zeros(x.size)
        variation[i] = 1.0
        columns.append(term.second_product(x, variation.reshape(x.shape)).ravel())
    return np.array(columns)


@each_type
@pytest.mark.parametrize("eps", [0.0, 0.3])
def test_value_is_that_of_the_formula(cell_type, eps):
    x = random_cells(cell_type, 1, 0.08 if eps == 0.0 else 0.5)[0]
    f, weights = jacobians(cell_type, x)
    densities = [barrier_gradient(tuple(tuple(column) for column in one.T.tolist()), eps)[0] for one in f]
    d = np.linalg.det(f)
    chi = (d + np.sqrt(eps**2 + d**2)) / 2
    expected = cell_type.volume * (weights @ densities + (weights @ chi) * (weights @ (1 / chi)) - 1)
    assert term_of(cell_type, eps=eps).value(x) == pytest.approx(expected, rel=1e-10)


@each_hexahedron
def test_points_of_hexahedra_are_nodes_of_27(cell_type):
    x, weights = random_cells(cell_type, 1, 0.08)[0], np.array([1, 4, 1]) / 6
    found, own = jacobians(cell_type, x)
    np.testing.assert_allclose(found, frames(cell_type, x[None], lattice(3))[0], atol=1e-14)
    np.testing.assert_allclose(own, np.einsum("i,j,k->ijk", weights, weights, weights).ravel())


@each_type
@pytest.mark.parametrize("angle", [0.0, 1.0])
def test_numbering_does_not_matter(cell_type, angle):
    x, term = random_cells(cell_type, 1, 0.06)[0], term_of(cell_type, angle=angle, stiffness=0.01)
    value, among = term.value(x), [frozenset(one) for one in between(cell_type)]
    found = 0
    for order in rotations(cell_type.linear):
        middles = [len(order) + among.index(frozenset(order[a] for a in one)) for one in among]
        assert term.value(x[[*order, *middles]]) == pytest.approx(value, rel=1e-12)
        found += 1
    assert found == {"hexahedron": 24, "wedge": 6, "pyramid": 4, "tetra": 12}[cell_type.linear.name]


def rotations(linear):
    """Orders of the corners in which the ideal is the same, but for a rotation."""
    x = linear.ideal - linear.ideal.mean(axis=0)
    for ends in itertools.permutations(range(linear.corners), 4):
        # The corners that four of them go to tell the rotation.
        first = [0, *linear.neighbours[0]]
        turn = np.linalg.lstsq(x[first], x[list(ends)], rcond=None)[0]
        if not np.allclose(turn @ turn.T, np.eye(3)) or np.linalg.det(turn) < 0:
            continue
        apart = np.linalg.norm((x @ turn)[:, None] - x, axis=2)
        order = apart.argmin(axis=1)
        if apart.min(axis=1).max() < 1e-9 and order[first].tolist() == list(ends):
            yield order.tolist()


@each_type
@pytest.mark.parametrize("eps", [0.0, 0.3])
def test_gradient_is_the_derivative(cell_type, eps):
    x = random_cells(cell_type, 1, 0.08 if eps == 0.0 else 0.4)[0]
    term, variation = term_of(cell_type, eps=eps), np.random.default_rng(3).normal(size=x.shape)
    _, gradient = term.value_gradient(x)
    step = 1e-6
    difference = (term.value(x + step * variation) - term.value(x - step * variation)) / (2 * step)
    assert (gradient * variation).sum() == pytest.approx(difference, rel=1e-6)
    np.testing.assert_allclose(gradient.sum(axis=0), 0, atol=1e-11)


@each_type
def test_similar_copies_cost_nothing_and_nothing_else_does(cell_type):
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    term, x = term_of(cell_type), 3.0 * cell_type.ideal @ turn + [5, 0, 1]
    assert 0.0 <= term.value(x) < 1e-25
    # Translations, rotations and the size; three fields that are conformal at the points, too, without evenness.
    for other, dimension in ((term, 7), (term_of(cell_type, evenness=0.0), 10)):
        values = np.linalg.eigvalsh(hessian(other, cell_type.ideal))
        assert (values < 1e-6 * values.max()).sum() == dimension


@each_type
@pytest.mark.parametrize("eps", [0.0, 0.3])
def test_against_a_box_a_cell_is_measured_as_if_it_were_shrunk(cell_type, eps):
    box, x = np.array([0.5, 0.5, 4.0]), random_cells(cell_type, 1, 0.05)[0]
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    assert abs(term_of(cell_type, boxes=box[None]).value(cell_type.ideal * box @ turn * np.linalg.det(turn))) < 1e-25
    stretched, plain = term_of(cell_type, boxes=box[None], eps=eps), term_of(cell_type, eps=eps)
    f, weights = jacobians(cell_type, x)
    f = f / box
    densities = [barrier_gradient(tuple(tuple(column) for column in one.T.tolist()), eps)[0] for one in f]
    d = np.linalg.det(f)
    chi = (d + np.sqrt(eps**2 + d**2)) / 2
    expected = cell_type.volume * (weights @ densities + (weights @ chi) * (weights @ (1 / chi)) - 1)
    assert stretched.value(x) == pytest.approx(expected, rel=1e-10)
    assert stretched.value(x) > plain.value(x)
    variation = np.random.default_rng(3).normal(size=x.shape)
    difference = (stretched.value(x + 1e-6 * variation) - stretched.value(x - 1e-6 * variation)) / 2e-6
    assert (stretched.value_gradient(x)[1] * variation).sum() == pytest.approx(difference, rel=1e-6)


@each_type
def test_what_is_folded_at_a_point_is_infinite(cell_type):
    x = cell_type.ideal.copy()
    x[0] = 3 * x.mean(axis=0) - 2 * x[0]
    assert term_of(cell_type).value(x) == np.inf
    assert np.isfinite(term_of(cell_type, eps=0.1).value(x))
    assert term_of(cell_type).determinants(x).min() < 0


@each_type
def test_cells_that_share_nodes_pull_together(cell_type):
    x = random_cells(cell_type, 2, 0.05).reshape(-1, 3)
    nodes = len(cell_type.nodes)
    cells = np.arange(2 * nodes).reshape(2, nodes)
    cells[1, 0] = cells[0, 6]
    _, gradient = QuadraticTerm(cells, cell_type, len(x)).value_gradient(x)
    parts = [QuadraticTerm(cells[i : i + 1], cell_type, len(x)).value_gradient(x)[1] for i in range(2)]
    np.testing.assert_allclose(gradient, parts[0] + parts[1], atol=1e-12)


def angle_densities(f):
    """e(u) of the unit columns of frames (q, 3, 3), by the formula with the scaled Jacobian."""
    u = f / np.linalg.norm(f, axis=1, keepdims=True)
    planes = [np.linalg.norm(np.cross(u[:, :, i], u[:, :, j]), axis=1) for i, j in [(0, 1), (0, 2), (1, 2)]]
    # Of unit vectors a plane has 2 (1 + 1) - 4 sin.
    return (sum(4 - 4 * sine for sine in planes) + 8) * np.linalg.det(u) ** (-2 / 3) - 8


@each_type
def test_angles_count_as_at_corners_of_linear_cells(cell_type):
    x = random_cells(cell_type, 1, 0.08)[0]
    e, size = angle_densities(jacobians(cell_type, x)[0]), cell_type.volume
    stiffness = 0.9 / e.max()
    assert term_of(cell_type).largest_angles(x)[0] == pytest.approx(e.max(), rel=1e-11)
    alone = {"evenness": 0.0, "distortion": 0.0, "angle": 2.0}
    assert term_of(cell_type, **alone).value(x) == pytest.approx(2 * size * e.mean(), rel=1e-11)
    term = term_of(cell_type, evenness=0.5, distortion=0.3, angle=2.0, stiffness=stiffness)
    plain = 0.3 * term_of(cell_type, evenness=0.0).value(x) + term_of(cell_type, evenness=0.5, distortion=0.0).value(x)
    assert term.value(x) == pytest.approx(plain + 2 * size * (e / (1 - stiffness * e)).mean(), rel=1e-11)
    variation = np.random.default_rng(3).normal(size=x.shape)
    difference = (term.value(x + 1e-6 * variation) - term.value(x - 1e-6 * variation)) / 2e-6
    assert (term.value_gradient(x)[1] * variation).sum() == pytest.approx(difference, rel=1e-5)


@each_type
def test_no_angle_gets_beyond_the_stiffness(cell_type):
    x = random_cells(cell_type, 1, 0.08)[0]
    largest = term_of(cell_type).largest_angles(x)[0]
    assert np.isfinite(term_of(cell_type, angle=1.0, stiffness=0.999 / largest).value(x))
    assert term_of(cell_type, angle=1.0, stiffness=1.001 / largest).value(x) == np.inf
    folded = cell_type.ideal.copy()
    folded[0] = 3 * folded.mean(axis=0) - 2 * folded[0]
    assert term_of(cell_type, angle=1.0).value(folded) == np.inf
    assert term_of(cell_type).largest_angles(folded)[0] == np.inf


@each_type
def test_laplacian_is_that_of_ideals_as_large_as_the_cells(cell_type):
    box = np.array([0.5, 0.5, 4.0])
    for scale, boxes in ((1.0, None), (0.2, None), (3.0, box[None])):
        x = scale * cell_type.ideal
        matrix = term_of(cell_type, boxes=boxes).laplacian(x)
        np.testing.assert_allclose(matrix.toarray(), matrix.toarray().T, atol=1e-12)
        np.testing.assert_allclose(matrix @ np.ones(len(x)), 0, atol=1e-11)
        # Gradients of coordinates of the cell are unit vectors, those of other nodes are integrated by the same rule.
        expected = np.ones(3) if boxes is None else 1 / box**2
        size = cell_type.volume / scale**2
        np.testing.assert_allclose(np.diag(cell_type.ideal.T @ matrix @ cell_type.ideal), size * expected)
        y = np.random.default_rng(0).normal(size=len(x))
        f, weights = jacobians(cell_type, np.stack([y, y, y], axis=1))
        assert y @ matrix @ y == pytest.approx(size * weights @ (f[:, 0] ** 2 @ expected), rel=1e-10)


@each_type
def test_the_cells_of_a_stretched_cell_are_as_large_as_its_edges_are_on_average(cell_type):
    x = cell_type.ideal * [1.0, 1.0, 3.0]
    long, ideal = term_of(cell_type).laplacian(x), term_of(cell_type).laplacian(cell_type.ideal)
    ends = x[cell_type.edges]
    squares = ((ends[:, 1] - ends[:, 0]) ** 2).sum(axis=1).mean()
    np.testing.assert_allclose(long.toarray(), ideal.toarray() / squares, atol=1e-13)


@each_hexahedron
@pytest.mark.parametrize("with_boxes", [False, True])
def test_of_a_patch_its_own_cells_count(cell_type, with_boxes):
    mesh = hc.elevated(hc.generate.box((4, 1, 1)), len(cell_type.nodes))
    rng = np.random.default_rng(5)
    points, cells = mesh.points + rng.uniform(-0.01, 0.01, mesh.points.shape), mesh.blocks[0].cells
    boxes = rng.uniform(0.5, 2.0, (4, 3)) if with_boxes else None
    moving = np.zeros(len(points), dtype=bool)
    moving[cells[2, 8]] = True
    patch = Patch.around(moving, cells, points)
    own = QuadraticTerm(cells, cell_type, len(points), boxes).restricted(patch)
    alone = [
        term_of(cell_type, None if boxes is None else boxes[[row]]).value(points[cells[row]]) for row in patch.cells
    ]
    assert 0 < len(alone) < 4
    assert own.value(points[patch.nodes]) == pytest.approx(sum(alone), rel=1e-11)
    assert own.value_gradient(points[patch.nodes])[1].shape == (len(patch.nodes), 3)


@each_type
def test_scaled_jacobians_are_the_smallest_at_the_points(cell_type):
    for one in random_cells(cell_type, 5, 0.1):
        edges, _ = edges_at_points(cell_type, one)
        values = np.linalg.det(edges) / np.linalg.norm(edges, axis=1).prod(axis=1) / cell_type.corner_volume
        np.testing.assert_allclose(term_of(cell_type).scaled_jacobians(one), values.min(), rtol=1e-10)


@each_type
def test_angles_and_scaled_jacobians_of_the_ideal_are_the_best_there_are(cell_type):
    term = term_of(cell_type)
    assert term.largest_angles(2.0 * cell_type.ideal)[0] == pytest.approx(0, abs=1e-13)
    assert term.scaled_jacobians(2.0 * cell_type.ideal)[0] == pytest.approx(1)
