"""The corner term and its convex Hessian, of meshes and of patches."""

from dataclasses import replace

import numpy as np
import pytest
from corner_problems import CUBES, convex, formulation_of, jittered_cubes

from hexconformal import generate
from hexconformal.elements.hexahedron import CORNER_NEIGHBOURS, CORNERS
from hexconformal.energy import CornerTerm, CornerWeights, DistortionTerm, Patch
from hexconformal.kernel import CellChunks
from hexconformal.kernel.distortion import barrier_factor, cofactor, determinant, frame_frozen_second, frame_gradient
from hexconformal.mesh.topology import node_rings
from hexconformal.untangling.untangle import folded_cells

WEIGHTS = [CornerWeights(), CornerWeights(eps=0.1), CornerWeights(0.05, 1.0), CornerWeights(0.05, 1.0, 0.05)]
TARGETS = {
    "cubes": CUBES,
    "frames": np.linalg.inv(np.eye(3) + 0.2 * np.random.default_rng(5).normal(size=(1, 1, 3, 3))),
}


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("weights", WEIGHTS)
def test_gradient_agrees_with_differences_to_second_order(weights, target):
    points, cells = jittered_cubes()
    term = CornerTerm(cells, TARGETS[target], weights)
    value, gradient, _ = convex(term, points, cells)
    assert value == pytest.approx(term.value(points), rel=1e-13)
    np.testing.assert_array_equal(gradient, term.value_gradient(points)[1])
    direction = np.random.default_rng(0).normal(size=points.shape)
    slope = np.einsum("ij,ij->", gradient, direction)
    errors = []
    for step in (4e-4, 2e-4):
        ahead, behind = (term.value(points + s * step * direction) for s in (1, -1))
        errors.append(abs((ahead - behind) / (2 * step) - slope))
    assert errors[1] < 1e-4 * abs(slope) + 1e-6
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


def test_cells_are_put_in_chunks_once(monkeypatch):
    points, cells = jittered_cubes()
    found = []
    monkeypatch.setattr(CellChunks, "of", lambda *mesh, of=CellChunks.of: found.append(of(*mesh)) or found[-1])
    term = CornerTerm(cells, CUBES)
    first, second = (term.value_gradient(points) for _ in range(2))
    assert len(found) == 1
    assert first[0] == second[0]
    np.testing.assert_array_equal(first[1], second[1])


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("weights", WEIGHTS)
def test_hessian_is_symmetric_positive_semidefinite(weights, target):
    points, cells = jittered_cubes(3, 0.35)
    full = convex(CornerTerm(cells, TARGETS[target], weights), points, cells)[2]
    assert np.abs(full - full.T).max() < 1e-12 * np.abs(full).max()
    values = np.linalg.eigvalsh(full)
    assert values[0] > -1e-12 * values[-1]


@pytest.mark.parametrize("eps", [0.01, 0.1])
@pytest.mark.parametrize("seed", [0, 1])
def test_hessian_is_semidefinite_where_cells_are_folded_too(eps, seed):
    # Where eps counts, the second derivative of the barrier alone is too small for that.
    points, cells = generate.jittered(*generate.box((2, 2, 2)), 1.5, seed=seed, valid=False, keep_boundary=False)
    assert folded_cells(formulation_of(points, cells), points).sum() > 5
    values = np.linalg.eigvalsh(convex(CornerTerm(cells, CUBES, CornerWeights(eps=eps)), points, cells)[2])
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
    full = convex(CornerTerm(cells, TARGETS[target], weights), points, cells)[2]
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
    assert direction.ravel() @ full @ direction.ravel() == pytest.approx(expected, rel=1e-12)


def test_hessian_lies_above_the_exact_one_where_the_mesh_is_perfect():
    # There q = 0 with no slope, and what is left out is the turning of the normals, which only lowers the energy.
    points, cells = generate.box((3, 3, 3))
    points = 3 * points
    full = convex(CornerTerm(cells, CUBES), points, cells)[2]
    exact = DistortionTerm(cells, len(points), eps=0.0, quadrature="corners")
    ratios = []
    for seed in range(20):
        direction = np.random.default_rng(seed).normal(size=points.shape)
        # The corner rule weighs a corner with 1/8, the corner term with 1.
        true = 8.0 * np.einsum("ij,ij->", direction, exact.second_product(points, direction))
        ratios.append(direction.ravel() @ full @ direction.ravel() / true)
    assert min(ratios) > 1.0
    assert max(ratios) < 3.0


def test_the_distortion_part_is_the_barrier_energy_at_the_corners():
    points, cells = jittered_cubes()
    value = CornerTerm(cells, CUBES).value(points)
    same = DistortionTerm(cells, len(points), eps=0.0, quadrature="corners").value_gradient(points)[0]
    assert value == pytest.approx(8.0 * same, rel=1e-12)


def test_angles_do_not_feel_edge_lengths():
    points, cells = generate.box((3, 3, 3))
    angles, whole = (CornerTerm(cells, CUBES, CornerWeights(*weights)) for weights in ((0.0, 1.0), (1.0, 0.0)))
    assert angles.value(points**2 + points) == pytest.approx(0.0, abs=1e-11)
    assert whole.value(points**2 + points) > 0.1


def test_stiffness_forbids_what_is_worse_than_its_bound():
    points, cells = jittered_cubes()
    worst = CornerTerm(cells, CUBES).measures(points).angle.max()
    assert np.isfinite(CornerTerm(cells, CUBES, CornerWeights(0.0, 1.0, 0.99 / worst)).value(points))
    assert CornerTerm(cells, CUBES, CornerWeights(0.0, 1.0, 1.01 / worst)).value(points) == np.inf


def test_folded_corners_are_infinite_without_eps_and_finite_with_it():
    points, cells = jittered_cubes()
    points[len(points) // 2] += 2.0
    assert folded_cells(formulation_of(points, cells), points).any()
    assert CornerTerm(cells, CUBES).value(points) == np.inf
    assert np.isfinite(CornerTerm(cells, CUBES, CornerWeights(eps=0.5)).value(points))


def test_a_patch_sees_the_energy_of_its_own_cells_and_moves_its_own_nodes_only():
    points, cells = jittered_cubes(6)
    core = node_rings(cells, len(points), np.arange(len(cells)) == 100, 0)
    patch, nodes = formulation_of(points, cells).restricted(core, points)
    around = core[cells].any(axis=1)
    whole = CornerTerm(cells[around], CUBES).value(points)
    assert patch.objective(CornerWeights()).value(points[nodes]) == pytest.approx(whole, rel=1e-13)
    assert np.array_equal(nodes[patch.free], np.flatnonzero(core))


def test_cells_count_by_their_scales_in_a_patch_too():
    points, cells = jittered_cubes(4)
    rng = np.random.default_rng(3)
    scales = rng.uniform(0.5, 2.0, len(cells))
    frames = np.linalg.inv(np.eye(3) + 0.2 * rng.normal(size=(len(cells), 8, 3, 3)))
    term = CornerTerm(cells, frames, CornerWeights(0.3, 1.0, 0.01), scales)
    each = [replace(term, cells=cells[[c]], inverses=frames[[c]], scales=np.ones(1)) for c in range(len(cells))]
    expected = scales * [one.value(points) for one in each]
    assert term.value(points) == pytest.approx(expected.sum(), rel=1e-12)
    moving = node_rings(cells, len(points), np.arange(len(cells)) == 20, 0)
    patch = Patch.around(moving, cells, points)
    assert 1 < len(patch.cells) < len(cells)
    assert term.restricted(patch).value(points[patch.nodes]) == pytest.approx(expected[patch.cells].sum(), rel=1e-12)
