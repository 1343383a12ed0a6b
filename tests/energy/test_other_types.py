"""Corner and volume terms of tetrahedra, wedges and pyramids, by themselves and beside hexahedra."""

import numpy as np
import pytest
from corner_problems import CUBES, convex
from meshes.linear_cells import TYPES, random_cells, renumberings
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
    with pytest.raises(OptionError, match="not be one box where there are other cells than hexahedra"):
        inverse_targets("1:1:2", points, cells, "corners")
    assert set(CELL_TYPES) == set(STIFF)


def affine(points):
    """The points under a linear map, and the map."""
    matrix = np.eye(3) + np.random.default_rng(5).uniform(-0.3, 0.3, (3, 3))
    return points @ matrix.T, matrix


@each_type
def test_of_its_own_shape_a_cell_has_the_distortion_of_the_map(cell_type):
    points, cells = one_cell(cell_type)
    moved, matrix = affine(points)
    term = CornerTerm(cells, inverse_targets("input", points, cells, "corners"))
    assert term.value(points) < 1e-25
    # J is the matrix of the map at every corner; the weights of corners sum up to the volume of the ideal, times 8.
    density = frame_density(tuple(matrix.T)) * np.linalg.det(matrix) ** (-2 / 3)
    assert term.value(moved) == pytest.approx(8.0 * cell_type.volume * density, rel=1e-12)


def test_of_the_shapes_of_another_mesh_cells_of_all_types_have_the_distortion_of_the_map():
    points, cells = collapsed_tables()
    moved, matrix = affine(points)
    density = frame_density(tuple(matrix.T)) * np.linalg.det(matrix) ** (-2 / 3)
    volume = sum(len(cells[one.rows]) * one.cell_type.volume for one in rows_by_type(cells))
    shuffled = cells[np.random.default_rng(6).permutation(len(cells))]
    for table in (cells, shuffled):
        inverses = inverse_targets(points, moved, table, "corners")
        assert CornerTerm(table, inverses).value(moved) == pytest.approx(8.0 * volume * density, rel=1e-12)
        # As a term of a patch, too: of one cell, for instance.
        moving = np.zeros(len(points), dtype=bool)
        moving[table[0]] = True
        patch = Patch.around(moving, table, moved)
        own = sum(8.0 * one.cell_type.volume * len(patch.cells[one.rows]) for one in rows_by_type(table[patch.cells]))
        part = CornerTerm(table, inverses).restricted(patch)
        assert part.value(moved[patch.nodes]) == pytest.approx(own * density, rel=1e-12)
        first = Patch(np.array([0]), np.unique(table[0]), moving, moved)
        one = CornerTerm(table, inverses).restricted(first)
        cell_type = rows_by_type(table[:1])[0].cell_type
        assert one.value(moved[first.nodes]) == pytest.approx(8.0 * cell_type.volume * density, rel=1e-12)


@each_type
def test_the_laplacian_is_that_of_the_ideal_whichever_node_is_the_first(cell_type):
    nodes = len(cell_type.nodes)
    matrices = []
    for order in renumberings(cell_type):
        cells = collapsed_cells(np.array([order]), cell_type)
        matrices.append(DistortionTerm(cells, nodes, quadrature="corners").laplacian().toarray())
    for matrix in matrices:
        np.testing.assert_allclose(matrix, matrices[0], atol=1e-14)
    # Of a linear function it is the volume times the square of the slope; constants alone cost nothing.
    slope = np.array([0.3, -1.1, 0.7])
    linear = cell_type.ideal @ slope
    assert linear @ matrices[0] @ linear == pytest.approx(cell_type.volume * slope @ slope, rel=1e-12)
    values = np.linalg.eigvalsh(matrices[0])
    assert values[0] == pytest.approx(0.0, abs=1e-14)
    assert values[1] > 0.01 * values[-1]


def test_on_ideals_of_two_types_side_by_side_linear_functions_are_harmonic():
    # Squares and triangles of unit edges, extruded.
    high = np.sqrt(0.75)
    plane = [(x, y) for y in (0.0, 1.0) for x in range(4)] + [(x + 0.5, 1.0 + high) for x in range(3)]
    points = np.array([(x, y, z) for z in (0.0, 1.0, 2.0) for x, y in plane])
    n = len(plane)
    quads = [[x, x + 1, x + 5, x + 4] for x in range(3)]
    triangles = [[4 + x, 5 + x, 8 + x] for x in range(3)] + [[5 + x, 9 + x, 8 + x] for x in range(2)]
    blocks = {name: [[*(k * n + np.array(f)), *((k + 1) * n + np.array(f))] for k in (0, 1) for f in faces]
              for name, faces in (("hexahedron", quads), ("wedge", triangles))}  # fmt: skip
    cells = np.concatenate([collapsed_cells(np.array(rows), CELL_TYPES[name]) for name, rows in blocks.items()])
    laplacian = DistortionTerm(cells, len(points), quadrature="corners").laplacian()
    residual = laplacian @ points
    assert np.abs(residual[n + 5 : n + 7]).max() < 1e-14  # the nodes inside
    assert np.abs(residual).max() > 0.1


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
