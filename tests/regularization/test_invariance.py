"""The same result in every place, unit, order of nodes and cells, and with any number of threads."""

import numpy as np
import pytest
from meshes.hexahedra import jittered_box, renumbered, with_rough_surface
from scipy.spatial.transform import Rotation

import hexconformal as hc
from hexconformal import generate
from hexconformal.kernel import threads
from hexconformal.mesh.topology import boundary_quads

ENERGIES = ["barrier", "quaternionic"]


@pytest.mark.parametrize("energy", ENERGIES)
def test_rotation_translation_and_scale_carry_over(energy):
    points, cells = jittered_box()
    plain = hc.regularize((points, cells), boundary="fixed", energy=energy, gradient_tolerance=1e-10).points
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    for size, shift in ((1.0, 0.0), (1e-9, 0.0), (1e9, 0.0), (1.0, 1e4)):
        moved = hc.regularize(
            (size * points @ turn.T + shift, cells), boundary="fixed", energy=energy, gradient_tolerance=1e-10
        )
        assert np.abs(moved.points - (size * plain @ turn.T + shift)).max() < 1e-10 * size


def test_permuted_cells_and_nodes_give_the_permuted_result():
    for amount in (0.2, 0.6):
        points, cells = generate.jittered(*generate.box((5, 5, 5)), amount, seed=0, valid=False)
        plain = hc.regularize((points, cells), boundary="fixed", gradient_tolerance=1e-10)
        assert (plain.report.before.inverted > 0) == (amount == 0.6)
        rng = np.random.default_rng(1)
        shuffled, nodes, _ = renumbered((points, cells), rng)
        permuted = hc.regularize(shuffled, boundary="fixed", gradient_tolerance=1e-10)
        assert np.array_equal(permuted.points, plain.points[nodes])


def test_two_runs_are_bit_identical():
    mesh = jittered_box(8)
    assert np.array_equal(hc.regularize(mesh).points, hc.regularize(mesh).points)


CURVED = {"cylinder": generate.cylinder(4, 3, 6), "ball": generate.ball(3, 2)}


@pytest.mark.parametrize("shape", CURVED)
def test_a_curved_boundary_slides_the_same_in_every_unit_and_far_away(shape):
    points, cells = with_rough_surface(CURVED[shape])
    plain = hc.regularize((points, cells))
    diagonal = plain.report.diagonal
    surface = np.unique(boundary_quads(cells)[0])
    assert np.abs(plain.points - points)[surface].max() > 1e-3 * diagonal
    assert plain.report.hausdorff <= plain.report.hausdorff_bound
    assert plain.report.after.scaled_jacobian.min > plain.report.before.scaled_jacobian.min
    assert plain.report.after.scaled_jacobian.mean > plain.report.before.scaled_jacobian.mean
    for size, shift in ((1e-6, 0.0), (1e6, 0.0), (1.0, 1e4 * diagonal)):
        moved = hc.regularize((size * points + shift, cells))
        # What the input's digits have lost, and no more: far away four of sixteen.
        assert np.abs((moved.points - shift) / size - plain.points).max() < (1e-11 if shift else 1e-14) * diagonal
        assert moved.report.hausdorff == pytest.approx(plain.report.hausdorff, rel=1e-8)


@pytest.mark.parametrize("shape", CURVED)
def test_a_curved_boundary_slides_the_same_in_another_order_of_nodes_and_cells(shape):
    points, cells = with_rough_surface(CURVED[shape])
    plain = hc.regularize((points, cells))
    rng = np.random.default_rng(1)
    shuffled, nodes, _ = renumbered((points, cells), rng)
    permuted = hc.regularize(shuffled)
    assert permuted.report.hausdorff <= permuted.report.hausdorff_bound
    assert np.array_equal(permuted.points, plain.points[nodes])


def test_runs_with_a_curved_boundary_are_bit_identical_with_any_number_of_threads(monkeypatch):
    mesh = with_rough_surface(CURVED["cylinder"])
    results = []
    monkeypatch.setattr(threads, "_SMALLEST_RANGE", 20)
    for count in (1, 2, 3, 2):
        monkeypatch.setattr(threads, "thread_count", lambda count=count: count)
        results.append(hc.regularize(mesh).points)
    assert all(np.array_equal(result, results[0]) for result in results[1:])


def test_options_for_single_cells_and_nodes_hold_for_those_in_the_mesh():
    points, cells = generate.jittered(*generate.box((4, 4, 4)), 0.3, seed=5)
    rng = np.random.default_rng(3)
    shuffled, nodes, order = renumbered((points, cells), rng)
    held = rng.random(len(points)) < 0.2
    sizes = rng.uniform(0.5, 2.0, len(cells)) / len(cells)
    boxes = rng.uniform(0.5, 2.0, (len(cells), 3))
    reference = generate.jittered(*generate.box((4, 4, 4)), 0.3, seed=6)[0]
    for one, other in (
        ({"fixed": held}, {"fixed": held[nodes]}),
        ({"sizes": sizes}, {"sizes": sizes[order]}),
        ({"target": boxes}, {"target": boxes[order]}),
        ({"target": reference}, {"target": reference[nodes]}),
    ):
        plain, permuted = hc.regularize((points, cells), **one), hc.regularize(shuffled, **other)
        assert np.abs(plain.points - points).max() > 1e-2
        assert np.array_equal(permuted.points, plain.points[nodes])
    assert np.array_equal(hc.regularize((points, cells), fixed=held).points[held], points[held])
