"""Corner and volume terms of tetrahedra, wedges and pyramids, by themselves and beside hexahedra."""

import numpy as np
import pytest
from corner_problems import CUBES, convex
from meshes.linear_cells import TYPES, random_cells
from meshes.mixed import collapsed_tables

from hexconformal.common import OptionError
from hexconformal.elements import CELL_TYPES, cell_volumes, collapsed_cells, rows_by_type
from hexconformal.energy import (
    CornerTerm,
    CornerWeights,
    DistortionTerm,
    Patch,
    SoftMinimumTerm,
    VolumeTerm,
    corner_jacobians,
    inverse_targets,
    stretched_boxes,
)
from hexconformal.kernel import use_threads
from hexconformal.kernel.distortion import frame_density

each_type = pytest.mark.parametrize("cell_type", TYPES, ids=lambda one: one.name)
STIFF = {"hexahedron": 0.05, "wedge": 0.02, "pyramid": 0.03, "tetra": 0.01}
WEIGHTS = [
    CornerWeights(),
    CornerWeights(eps=0.3),
    CornerWeights(0.2, 1.0),
    CornerWeights(0.2, 1.0, 0.02),
    CornerWeights(0.2, 1.0, STIFF),
]


def one_cell(cell_type, amount=0.12):
    return random_cells(cell_type, 1, amount, 3)[0], collapsed_cells(np.arange(len(cell_type.nodes))[None], cell_type)


def slope_errors(term, points, steps=(4e-4, 2e-4)):
    """How far central differences of the value are from the slope along a direction, and the slope."""
    direction = np.random.default_rng(0).normal(size=points.shape)
    slope = np.einsum("ij,ij->", term.value_gradient(points)[1], direction)
    ends = ([term.value(points + sign * step * direction) for sign in (1, -1)] for step in steps)
    return [
        abs((ahead - behind) / (2 * step) - slope) for step, (ahead, behind) in zip(steps, ends, strict=True)
    ], slope


@each_type
def test_the_energy_is_that_of_the_frames_and_none_for_the_ideal(cell_type):
    points, cells = one_cell(cell_type)
    corners = list(cell_type.samples)
    edges = points[cell_type.neighbours[corners]] - points[corners][:, None]
    frames = np.swapaxes(edges, 1, 2) @ cell_type.inverse_target
    columns = tuple(tuple(frames[:, k, i] for k in range(3)) for i in range(3))
    densities = frame_density(columns) * np.linalg.det(frames) ** (-2 / 3)
    weight = 8.0 * cell_type.volume / len(corners)
    assert CornerTerm(cells, CUBES).value(points) == pytest.approx(weight * densities.sum(), rel=1e-12)
    for scale in (0.2, 1.0, 7.0):
        assert CornerTerm(cells, CUBES).value(scale * cell_type.ideal) < 1e-27


@each_type
@pytest.mark.parametrize("weights", WEIGHTS)
def test_the_gradient_agrees_with_differences_to_second_order(cell_type, weights):
    points, cells = one_cell(cell_type)
    term = CornerTerm(cells, CUBES, weights)
    value, gradient, full = convex(term, points, cells)
    assert value == pytest.approx(term.value(points), rel=1e-13)
    np.testing.assert_array_equal(gradient, term.value_gradient(points)[1])
    errors, slope = slope_errors(term, points)
    assert errors[1] < 1e-4 * abs(slope) + 1e-6
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)
    assert np.abs(full - full.T).max() < 1e-12 * np.abs(full).max()
    assert np.linalg.eigvalsh(full)[0] > -1e-12 * np.abs(full).max()


def test_the_proportions_of_other_types_are_in_their_shape():
    points, cells = collapsed_tables()
    slender = np.full(len(cells), 1.01)
    more = {}
    for one in rows_by_type(cells):
        own = np.ascontiguousarray(cells[one.rows])
        plain, with_proportions = (
            CornerTerm(own, CUBES, CornerWeights(proportion=p), slender=slender[: len(own)]).value(points)
            for p in (0.0, 1.0)
        )
        more[one.cell_type.name] = with_proportions - plain
    assert more.pop("hexahedron") > 0.0
    assert set(more.values()) == {0.0}


@each_type
def test_the_convex_hessian_is_no_less_than_the_hessian_at_the_ideal(cell_type):
    _, cells = one_cell(cell_type)
    points = cell_type.ideal.copy()
    term = CornerTerm(cells, CUBES, CornerWeights(1.0, 0.5, 0.01))
    full = convex(term, points, cells)[2]
    exact, step = np.empty_like(full), 1e-5
    for k in range(points.size):
        move = np.zeros_like(points)
        move.flat[k] = step
        ahead, behind = (term.value_gradient(points + sign * move)[1] for sign in (1, -1))
        exact[:, k] = ((ahead - behind) / (2 * step)).ravel()
    assert (np.linalg.eigvalsh(exact) < 1e-6 * np.abs(exact).max()).sum() == 7
    values = np.linalg.eigvalsh(full - exact)
    assert values[0] > -1e-6 * np.abs(exact).max()


def test_a_mesh_of_all_types_is_the_sum_of_them_with_any_number_of_threads():
    points, cells = collapsed_tables()
    weights = CornerWeights(0.2, 1.0, STIFF)
    whole, parts = CornerTerm(cells, CUBES, weights), 0.0
    for one in rows_by_type(cells):
        parts += CornerTerm(np.ascontiguousarray(cells[one.rows]), CUBES, weights).value(points)
    assert whole.value(points) == pytest.approx(parts, rel=1e-13)
    shuffled = np.random.default_rng(1).permutation(len(cells))
    assert CornerTerm(cells[shuffled], CUBES, weights).value(points) == pytest.approx(parts, rel=1e-12)
    found = []
    for threads in (1, 2, 5):
        use_threads(threads)
        found.append(convex(whole, points, cells))
    use_threads(None)
    for other in found[1:]:
        for one, two in zip(found[0], other, strict=True):
            np.testing.assert_array_equal(one, two)


def test_measures_are_in_the_order_of_the_cells():
    points, cells = collapsed_tables()
    order = np.random.default_rng(2).permutation(len(cells))
    one, two = (CornerTerm(table, CUBES).measures(points) for table in (cells, cells[order]))
    for name in ("determinant", "fullness", "slenderness", "distortion", "angle"):
        np.testing.assert_array_equal(getattr(one, name)[order], getattr(two, name))
    np.testing.assert_allclose(CornerTerm(cells, CUBES).fullness(points), one.fullness, rtol=1e-14)


def test_no_corner_passes_the_stiffness_of_its_type():
    points, cells = collapsed_tables()
    angle = CornerTerm(cells, CUBES).measures(points).angle
    worst = {one.cell_type.name: angle[one.rows].max() for one in rows_by_type(cells)}
    for name in worst:
        for factor, finite in ((0.99, True), (1.01, False)):
            stiffness = dict.fromkeys(worst, 0.0) | {name: factor / worst[name]}
            weights = CornerWeights(0.0, 1.0, stiffness)
            assert np.isfinite(CornerTerm(cells, CUBES, weights).value(points)) == finite
            assert (angle < weights.largest_angles(cells)).all() == finite


def test_a_patch_is_a_part_of_the_whole():
    points, cells = collapsed_tables()
    moving = np.zeros(len(points), dtype=bool)
    moving[cells[[0, len(cells) // 2, -1]]] = True
    patch = Patch.around(moving, cells, points)
    term = CornerTerm(cells, CUBES, CornerWeights(0.2, 1.0, STIFF))
    gradient = term.value_gradient(points)[1]
    part = term.restricted(patch).value_gradient(points[patch.nodes])[1]
    inside = moving[patch.nodes]
    np.testing.assert_allclose(part[inside], gradient[patch.nodes][inside], rtol=1e-10, atol=1e-12)


def test_the_distortion_at_corners_is_an_eighth_of_the_corner_term():
    points, cells = collapsed_tables()
    scales = np.random.default_rng(0).uniform(0.5, 2.0, len(cells))
    term = DistortionTerm(cells, len(points), scales, eps=0.0, quadrature="corners")
    eighth = CornerTerm(cells, CUBES, scales=scales)
    assert term.value(points) == pytest.approx(eighth.value(points) / 8.0, rel=1e-13)
    np.testing.assert_allclose(term.value_gradient(points)[1], eighth.value_gradient(points)[1] / 8.0, rtol=1e-12)
    for other in (DistortionTerm(cells, len(points)), DistortionTerm(cells, len(points), eps=0.0)):
        with pytest.raises(OptionError, match="measured at corners"):
            other.value(points)


@each_type
def test_the_volume_term_of_a_type(cell_type):
    points, cells = one_cell(cell_type)
    term = VolumeTerm(cells, np.full(1, 2.0 * cell_type.volume), 1.5)
    ratio = cell_volumes(points, cells)[0] / (2.0 * cell_type.volume)
    value, gradient, full = convex(term, points, cells)
    assert value == pytest.approx(1.5 * (ratio + 1 / ratio - 2.0), rel=1e-12)
    errors, slope = slope_errors(term, points, (4e-3, 2e-3))
    assert errors[1] < 1e-3 * abs(slope)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert np.abs(full - full.T).max() < 1e-13 * np.abs(full).max()
    values = np.linalg.eigvalsh(full)
    assert values[0] > -1e-12 * values[-1]
    # Along the change of volume at least as much is kept of the second derivative as there is.
    change = gradient.ravel()
    ahead, behind = (term.value(points + sign * 1e-4 * gradient) for sign in (1, -1))
    assert change @ full @ change >= (ahead + behind - 2 * value) / 1e-8 * (1 - 1e-4)


@each_type
def test_jacobians_of_corners_and_their_derivatives(cell_type):
    points, cells = one_cell(cell_type)
    jacobians, _ = corner_jacobians(points, cells)
    ideal, _ = corner_jacobians(cell_type.ideal, cells)
    np.testing.assert_allclose(ideal, 1.0)
    assert jacobians.shape == (1, 8)
    term = SoftMinimumTerm(cells, np.array([True]), 32.0, np.empty((0, 8)), np.empty(0), 0.0, 0.0)
    errors, slope = slope_errors(term, points)
    assert errors[1] < 1e-4 * abs(slope) + 1e-6
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


def test_targets_of_other_types_are_their_ideals():
    points, cells = collapsed_tables()
    boxes = np.tile([1.0, 1.0, 3.0], (len(cells), 1))
    inverses = inverse_targets(boxes, points, cells, "corners")
    for one in rows_by_type(cells):
        ideal = np.eye(3) if one.cell_type.name == "hexahedron" else one.cell_type.inverse_target
        np.testing.assert_allclose(inverses[one.rows][0, 0], ideal @ np.diag([1.0, 1.0, 1 / 3]))
    assert inverse_targets("cube", points, cells, "corners") is None
    for target in ("input", "1:1:2", points):
        with pytest.raises(OptionError, match="other cells than hexahedra"):
            inverse_targets(target, points, cells, "corners")
    assert set(CELL_TYPES) == set(STIFF)


@pytest.mark.parametrize("height", [0.1, 8.0])
def test_wedges_that_are_stretched_on_purpose_are_their_own_targets(height):
    wedge = CELL_TYPES["wedge"]
    flat = wedge.ideal * [1.0, 1.0, height]
    points = np.concatenate([flat, flat + [5.0, 0.0, 0.0], CELL_TYPES["tetra"].ideal * 3.0])
    wedges, last = collapsed_cells(np.arange(12).reshape(2, 6), wedge), np.arange(12, 16)[None]
    cells = np.concatenate([wedges, collapsed_cells(last, CELL_TYPES["tetra"])])
    boxes = stretched_boxes(points, cells)
    np.testing.assert_allclose(boxes[:2, 2] / boxes[:2, 0], height)
    np.testing.assert_array_equal(boxes[2], 1.0)
    inverses = inverse_targets(boxes, points, cells, "corners")
    assert CornerTerm(cells, inverses).value(points) < 1e-25
    assert CornerTerm(cells, CUBES).value(points) > 0.5
    # Whichever triangle comes first, and wherever the wedge lies.
    turned = points @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    mirrored = cells.copy()
    mirrored[:2] = cells[:2][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    mirrored = mirrored if np.linalg.det(np.linalg.lstsq(points, turned, rcond=None)[0]) < 0 else cells
    assert CornerTerm(mirrored, inverses).value(turned) < 1e-25
