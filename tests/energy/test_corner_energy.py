"""The corner energy, its convex Hessian, the block solver, and what patches of it do."""

import numpy as np
import pytest
from corner_problems import CUBES, all_free, boundary_held, dense, fixed_boundary_energy, jittered_cubes
from meshes.hexahedra import off_boundary

from hexconformal import generate
from hexconformal.elements.cell_measures import corner_scaled_jacobian
from hexconformal.elements.hexahedron import CORNER_NEIGHBOURS, CORNERS
from hexconformal.elements.lengths_volumes import cell_volumes
from hexconformal.elements.validity import is_valid
from hexconformal.energy.block_matrix import BlockMatrix, block_places
from hexconformal.energy.corner_energy import CornerEnergy, Weights
from hexconformal.energy.distortion_energy import Distortion
from hexconformal.kernel.distortion import barrier_factor, cofactor, determinant, frame_frozen_second, frame_gradient
from hexconformal.mesh.topology import boundary_quads, node_rings
from hexconformal.regularization.untangle import _unfold_patches, folded_cells, harmonic, pull_back, untangle
from hexconformal.regularization.untangle_interior import untangle_interior
from hexconformal.regularization.worst_cells import raise_worst, raise_worst_patches
from hexconformal.solver.projected_newton import newton_step, projected_newton

WEIGHTS = [Weights(), Weights(eps=0.1), Weights(0.05, 1.0), Weights(0.05, 1.0, 0.05)]


TARGETS = {
    "cubes": CUBES,
    "frames": np.linalg.inv(np.eye(3) + 0.2 * np.random.default_rng(5).normal(size=(1, 1, 3, 3))),
}


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("weights", WEIGHTS)
def test_gradient_agrees_with_differences_to_second_order(weights, target):
    points, cells = jittered_cubes()
    problem = CornerEnergy(cells, TARGETS[target], all_free(points))
    _, gradient, _ = problem.value_gradient_hessian(points, weights)
    direction = np.random.default_rng(0).normal(size=points.shape)
    slope = np.einsum("ij,ij->", gradient, direction)
    errors = []
    for step in (4e-4, 2e-4):
        ahead, behind = (problem.value(points + s * step * direction, weights) for s in (1, -1))
        errors.append(abs((ahead - behind) / (2 * step) - slope))
    assert errors[1] < 1e-4 * abs(slope) + 1e-6
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("weights", WEIGHTS)
def test_hessian_is_symmetric_positive_semidefinite(weights, target):
    points, cells = jittered_cubes(3, 0.35)
    _, _, matrix = CornerEnergy(cells, TARGETS[target], all_free(points)).value_gradient_hessian(points, weights)
    full = dense(matrix)
    assert np.abs(full - full.T).max() < 1e-12 * np.abs(full).max()
    values = np.linalg.eigvalsh(full)
    assert values[0] > -1e-12 * values[-1]


@pytest.mark.parametrize("eps", [0.01, 0.1])
@pytest.mark.parametrize("seed", [0, 1])
def test_hessian_is_semidefinite_where_cells_are_folded_too(eps, seed):
    # Where eps counts, the second derivative of the barrier alone is too small for that.
    points, cells = generate.jittered(*generate.box((2, 2, 2)), 1.5, seed=seed, valid=False, keep_boundary=False)
    problem = CornerEnergy(cells, CUBES, all_free(points))
    assert folded_cells(problem, points).sum() > 5
    values = np.linalg.eigvalsh(dense(problem.value_gradient_hessian(points, Weights(eps=eps))[2]))
    assert values[0] > -1e-12 * values[-1]


def numbers(frame):
    return tuple(tuple(float(x) for x in column) for column in frame)


def convex_second(f, d, constant):
    """Along d: s K + 2 s' G a + (q + c) s'' a a, and the first derivative and value of (q + c) s - c."""
    q, gradient = frame_gradient(numbers(f))
    s, ds, dds = barrier_factor(determinant(numbers(f)), 0.0)
    g, a = np.vdot(gradient, d), np.vdot(cofactor(numbers(f)), d)
    frozen = np.vdot(d, frame_frozen_second(numbers(f), numbers(d)))
    q += constant
    second = s * frozen + 2.0 * ds * g * a + q * max(dds, 2.0 * ds * ds / s) * a * a
    return second, s * g + q * ds * a, q * s - constant


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("weights", [weights for weights in WEIGHTS if weights.eps == 0.0])
def test_hessian_is_the_convex_part_corner_by_corner(weights, target):
    points, cells = jittered_cubes(1, 0.3)
    _, _, matrix = CornerEnergy(cells, TARGETS[target], all_free(points)).value_gradient_hessian(points, weights)
    direction = np.random.default_rng(2).normal(size=points.shape)
    inverse = TARGETS[target][0, 0] if len(TARGETS[target]) else np.eye(3)
    expected = 0.0
    for q in range(8):
        edges = CORNER_NEIGHBOURS[q]
        signs = 1 - 2 * CORNERS[q]
        # Neighbours along x, y, z, whatever their order in the table.
        along = [next(e for e in edges if CORNERS[e][k] != CORNERS[q][k]) for k in range(3)]
        node, ends = cells[0, q], cells[0, along]
        f = inverse.T @ (signs[:, None] * (points[ends] - points[node]))
        d = inverse.T @ (signs[:, None] * (direction[ends] - direction[node]))
        expected += weights.distortion * convex_second(f, d, 0.0)[0]
        lengths = np.linalg.norm(f, axis=1, keepdims=True)
        u = f / lengths
        turn = (d - (d * u).sum(axis=1, keepdims=True) * u) / lengths
        second, first, value = convex_second(u, turn, 8.0)
        room = 1.0 - weights.stiffness * value
        slope = weights.angle / room**2
        expected += slope * second + 2.0 * weights.stiffness * slope / room * first**2
    assert direction.ravel() @ dense(matrix) @ direction.ravel() == pytest.approx(expected, rel=1e-12)


def test_hessian_lies_above_the_exact_one_where_the_mesh_is_perfect():
    # There q = 0 with no slope, and what is left out is the turning of the normals, which only lowers the energy.
    points, cells = generate.box((3, 3, 3))
    points = 3 * points
    _, _, matrix = CornerEnergy(cells, CUBES, all_free(points)).value_gradient_hessian(points, Weights())
    exact = Distortion(cells, len(points), eps=0.0, quadrature="corners")
    full, ratios = dense(matrix), []
    for seed in range(20):
        direction = np.random.default_rng(seed).normal(size=points.shape)
        # The corner rule weighs a corner with 1/8, the corner energy with 1.
        true = 8.0 * np.einsum("ij,ij->", direction, exact.second_product(points, direction))
        ratios.append(direction.ravel() @ full @ direction.ravel() / true)
    assert min(ratios) > 1.0
    assert max(ratios) < 3.0


def test_the_distortion_part_is_the_barrier_energy_at_the_corners():
    points, cells = jittered_cubes()
    value = CornerEnergy(cells, CUBES, all_free(points)).value(points, Weights())
    same = Distortion(cells, len(points), eps=0.0, quadrature="corners").value_gradient(points)[0]
    assert value == pytest.approx(8.0 * same, rel=1e-12)


def test_angles_do_not_feel_edge_lengths():
    points, cells = generate.box((3, 3, 3))
    problem = CornerEnergy(cells, CUBES, all_free(points))
    assert problem.value(points**2 + points, Weights(0.0, 1.0)) == pytest.approx(0.0, abs=1e-11)
    assert problem.value(points**2 + points, Weights(1.0, 0.0)) > 0.1


def test_stiffness_forbids_what_is_worse_than_its_bound():
    points, cells = jittered_cubes()
    problem = CornerEnergy(cells, CUBES, all_free(points))
    worst = problem.measures(points).angle.max()
    assert np.isfinite(problem.value(points, Weights(0.0, 1.0, 0.99 / worst)))
    assert problem.value(points, Weights(0.0, 1.0, 1.01 / worst)) == np.inf


def test_folded_corners_are_infinite_without_eps_and_finite_with_it():
    points, cells = jittered_cubes()
    points[len(points) // 2] += 2.0
    problem = CornerEnergy(cells, CUBES, all_free(points))
    assert folded_cells(problem, points).any()
    assert problem.value(points, Weights()) == np.inf
    assert np.isfinite(problem.value(points, Weights(eps=0.5)))


def test_the_solver_finds_the_solution_in_the_admissible_space():
    points, cells = jittered_cubes()
    projectors = boundary_held(points, cells)
    projectors[np.flatnonzero(projectors.any(axis=(1, 2)))[0]] = np.diag([1.0, 1.0, 0.0])
    problem = CornerEnergy(cells, CUBES, projectors)
    _, gradient, matrix = problem.value_gradient_hessian(points, Weights())
    full = dense(matrix)
    x, _ = matrix.solve(-gradient, projectors, 1e-10, 500, 0.0)
    assert np.abs(np.einsum("nij,nj->ni", projectors, x) - x).max() == 0.0
    residual = (full @ x.ravel()).reshape(-1, 3) + gradient
    assert np.abs(np.einsum("nij,nj->ni", projectors, residual)).max() < 1e-9 * np.abs(gradient).max()


def test_newton_converges_to_the_perfect_mesh():
    points, cells = jittered_cubes()
    problem = fixed_boundary_energy(points, cells)
    *_, (best, energy) = projected_newton(problem, points, Weights(), decrease=1e-12)
    assert energy < 1e-12
    assert np.abs(best - 4 * generate.box((4, 4, 4))[0]).max() < 1e-6


def test_a_patch_sees_the_energy_of_its_own_cells_and_moves_its_own_nodes_only():
    points, cells = jittered_cubes(6)
    problem = CornerEnergy(cells, CUBES, all_free(points))
    core = node_rings(cells, len(points), np.arange(len(cells)) == 100, 0)
    patch, nodes = problem.restricted(core, points)
    around = core[cells].any(axis=1)
    whole = CornerEnergy(cells[around], CUBES, all_free(points)).value(points, Weights())
    assert patch.value(points[nodes], Weights()) == pytest.approx(whole, rel=1e-13)
    assert np.array_equal(nodes[patch.free], np.flatnonzero(core))


def test_a_rounded_step_forgets_rounding_in_its_input_and_stays_admissible():
    points, cells = generate.jittered(*generate.box((3, 3, 3)), 0.3, seed=3)
    noise = 1e-13 * np.random.default_rng(0).normal(size=points.shape)
    slanted = np.array([0.6, 0.0, 0.8])
    projectors = np.tile(np.eye(3), (len(points), 1, 1))
    projectors[::5] -= np.outer(slanted, slanted)
    weights, moved = Weights(), {}
    for rounding in (0.0, 2.0**-10):
        problem = CornerEnergy(cells, np.empty((0, 1, 3, 3)), projectors, rounding=rounding)
        moved[rounding] = [
            newton_step(problem, x, weights, 1e-5, lambda _: True)[0] - x for x in (points, points + noise)
        ]
        assert np.abs(moved[rounding][0][::5] @ slanted).max() < 1e-15
    differences = {rounding: np.abs(one - other)[1::5].max() for rounding, (one, other) in moved.items()}
    assert differences[2.0**-10] < 1e-15 < 1e-13 < differences[0.0]
    # Half the rounding, of an edge of a third is what it costs.
    assert np.abs(moved[0.0][0] - moved[2.0**-10][0]).max() < 2.0**-11 / 3


SIZES = Weights(0.0, volume=1.0)


def sized(points, cells, sizes):
    return CornerEnergy(cells, CUBES, all_free(points), target_volumes=sizes)


def test_cells_pay_for_volume_as_the_formula_says_and_not_without_a_size():
    points, cells = jittered_cubes()
    volumes = cell_volumes(points, cells)
    wanted = np.random.default_rng(3).uniform(0.2, 3.0, len(cells))
    expected = volumes / wanted + wanted / volumes - 2.0
    assert sized(points, cells, wanted).value(points, SIZES) == pytest.approx(expected.sum(), rel=1e-12)
    assert sized(points, cells, volumes).value(points, SIZES) == pytest.approx(0.0, abs=1e-12)
    wanted[::2] = 0.0
    assert sized(points, cells, wanted).value(points, SIZES) == pytest.approx(expected[1::2].sum(), rel=1e-12)
    assert sized(points, cells, np.empty(0)).value(points, SIZES) == 0.0
    assert sized(points, cells, wanted).value(points, Weights(0.0)) == 0.0


def test_gradient_of_the_sizes_agrees_with_differences_to_second_order():
    points, cells = jittered_cubes()
    problem = sized(points, cells, np.random.default_rng(3).uniform(0.2, 3.0, len(cells)))
    gradient = problem.value_gradient_hessian(points, SIZES)[1]
    direction = np.random.default_rng(0).normal(size=points.shape)
    slope = np.einsum("ij,ij->", gradient, direction)
    errors = []
    for step in (4e-3, 2e-3):
        ahead, behind = (problem.value(points + s * step * direction, SIZES) for s in (1, -1))
        errors.append(abs((ahead - behind) / (2 * step) - slope))
    assert errors[1] < 1e-3 * abs(slope)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_hessian_of_the_sizes_is_semidefinite_and_exact_where_all_cells_shrink():
    points, cells = jittered_cubes(3, 0.35)
    problem = sized(points, cells, np.random.default_rng(3).uniform(0.2, 3.0, len(cells)))
    full = dense(problem.value_gradient_hessian(points, SIZES)[2])
    values = np.linalg.eigvalsh(full)
    assert np.abs(full - full.T).max() < 1e-12 * values[-1]
    assert values[0] > -1e-12 * values[-1]
    # One cube that grows by t in every direction has the volume (1 + t)^3; what is left out is r g^T dg.
    points, cells = generate.box((1, 1, 1))
    for wanted in (0.5, 1.0, 4.0):
        full = dense(sized(points, cells, np.array([wanted])).value_gradient_hessian(points, SIZES)[2])
        ratio = 1.0 / wanted
        kept = 9.0 * max(2.0 / ratio, ratio + 1.0 / ratio)
        grown = (points - 0.5).ravel()
        # Both ends of a diagonal pay the same, so what stands in for their mixed terms vanishes.
        assert grown @ full @ grown == pytest.approx(kept, rel=1e-12)


def test_a_patch_has_the_sizes_of_its_cells():
    points, cells = jittered_cubes(6)
    wanted = np.random.default_rng(3).uniform(0.2, 3.0, len(cells))
    problem = sized(points, cells, wanted)
    core = node_rings(cells, len(points), np.arange(len(cells)) == 100, 0)
    patch, nodes = problem.restricted(core, points)
    around = core[cells].any(axis=1)
    expected = sized(points, cells[around], wanted[around]).value(points, SIZES)
    assert patch.value(points[nodes], SIZES) == pytest.approx(expected, rel=1e-13)


def test_lifting_raises_the_worst_cell_step_by_step():
    points, cells = generate.jittered(*generate.cylinder(4, 3, 6), 0.35, seed=3)
    problem = fixed_boundary_energy(points, cells)
    lowest = [corner_scaled_jacobian(at.points, cells).min() for at in raise_worst(problem, points)]
    assert lowest[-1] > corner_scaled_jacobian(points, cells).min() + 0.2
    assert lowest[-1] == max(lowest)


def test_nothing_is_lifted_once_held_corners_forbid_it():
    points, cells = generate.sheared_block(4, 1.0)
    held = fixed_boundary_energy(points, cells)
    assert list(raise_worst_patches(held, points)) == []
    assert list(raise_worst_patches(CornerEnergy(cells, CUBES, all_free(points)), points)) != []


def test_matrices_leave_out_what_is_held():
    points, cells = generate.box((3, 3, 3))
    free = off_boundary(points, cells)
    matrix = BlockMatrix.of_cells(cells, free)
    assert matrix.indptr[-1] == len(matrix.indices) == 8 + 12 + 12  # nodes, edges, diagonals of faces of one cell
    assert (np.diff(matrix.indptr)[~free] == 0).all()
    assert (block_places(cells, free, matrix) >= 0).sum() == 8 * 8 + 12 * 4 + 12 * 2


def test_untangling_unfolds_every_cell():
    points, cells = generate.jittered(*generate.box((6, 6, 6)), 1.0, seed=0, valid=False)
    problem = fixed_boundary_energy(points, cells)
    assert folded_cells(problem, points).sum() > 50
    *_, last = untangle(problem, points)
    assert not folded_cells(problem, last.points).any()


def test_a_cell_folded_inside_with_sound_corners_is_unfolded():
    points, cells = generate.box((3, 3, 3))
    points = 3 * points + np.random.default_rng(4936).uniform(-0.45, 0.45, points.shape)
    problem = fixed_boundary_energy(points, cells)
    assert not folded_cells(problem, points).any()
    assert not is_valid(points, cells).all()
    better = untangle_interior(problem, points)
    assert is_valid(better, cells).all()
    surface = np.unique(boundary_quads(cells)[0])
    assert np.array_equal(better[surface], points[surface])
    assert untangle_interior(problem, better) is better


def test_points_are_brought_back_only_where_the_worst_is_worse_and_to_the_start_where_nothing_else_is_near():
    start, cells = generate.jittered(*generate.box((4, 4, 4)), 1.0, seed=0, valid=False)
    straight = generate.box((4, 4, 4))[0]
    worse = straight.copy()
    worse[62] += [0.6, 0.0, 0.0]  # an inner node past its neighbours
    assert corner_scaled_jacobian(worse, cells).min() < corner_scaled_jacobian(start, cells).min() < 0.0
    assert pull_back(straight, start, cells, lambda _: True) is straight
    assert pull_back(worse, start, cells, lambda _: False) is start
    back = corner_scaled_jacobian(pull_back(worse, start, cells, lambda _: True), cells)
    assert back.min() >= corner_scaled_jacobian(start, cells).min()
    assert back.mean() > corner_scaled_jacobian(start, cells).mean() + 0.1
    away = straight.copy()
    away[0] = 0.9  # a corner through the box: no worse, but too far from the surface
    near = pull_back(away, start, cells, lambda x: bool(np.linalg.norm(x[0]) < 0.5))
    assert np.linalg.norm(near[0]) < 0.5
    assert (corner_scaled_jacobian(near, cells) <= 0).sum() < 5


def test_the_harmonic_start_puts_inner_nodes_between_their_neighbours():
    points, cells = generate.jittered(*generate.box((4, 4, 4)), 0.5, seed=0, valid=False)
    problem = fixed_boundary_energy(points, cells)
    smooth = harmonic(problem, points, np.ones(len(points), dtype=bool))
    assert np.abs(smooth - generate.box((4, 4, 4))[0]).max() < 5e-3
    surface = np.unique(boundary_quads(cells)[0])
    assert np.array_equal(smooth[surface], points[surface])


class Wall:
    """A surface that one node has to stay near to."""

    def __init__(self, node, place):
        self.node, self.place = node, place

    def relative_distance(self, points):
        return 2.0 * np.linalg.norm(points[self.node] - self.place)

    def restricted(self, nodes, moving, points):
        """As a patch that does not watch what is around it."""
        return


def test_patches_that_leave_the_surface_are_not_unfolded_and_the_others_are():
    points, cells = generate.box((3, 3, 3))
    tangled = 3 * points
    corners = [int(np.argmin(points.sum(axis=1))), int(np.argmax(points.sum(axis=1)))]
    tangled[corners[0]] += 1.8
    tangled[corners[1]] -= 1.8
    cores = [np.arange(len(points)) == corner for corner in corners]
    for node, opened in (None, [True, True]), (corners[0], [False, True]), (corners[1], [True, False]):
        surface = None if node is None else Wall(node, tangled[node])
        problem = CornerEnergy(cells, CUBES, all_free(points), surface)
        found = _unfold_patches(problem, tangled, tangled, cores)
        still = folded_cells(problem, found)
        assert [not still[(cells == corner).any(axis=1)].any() for corner in corners] == opened
