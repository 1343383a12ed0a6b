"""The distance barrier around a surface: derivatives, walls, and its force on nodes of curves and corners."""

from dataclasses import replace

import numpy as np
import pytest
from corner_problems import convex

from hexconformal import generate
from hexconformal.energy import Patch
from hexconformal.geometry import hausdorff
from hexconformal.geometry.closest_point import SurfaceLocator
from hexconformal.geometry.distance_barrier import DistanceBarrier
from hexconformal.geometry.features import find_features
from hexconformal.mesh.topology import boundary_quads
from hexconformal.regularization.boundary import flat_normals
from hexconformal.solver.admissible import count_free_directions


@pytest.fixture
def cylinder():
    points, cells = generate.cylinder(4, 3, 6)
    return points, cells, boundary_quads(cells)[0]


def barrier_of(points, quads, bound=0.05):
    return DistanceBarrier.around(SurfaceLocator(points, quads), bound, find_features(points, quads))


def test_nothing_is_felt_on_the_surface_itself(cylinder):
    points, cells, quads = cylinder
    value, forces, _ = convex(barrier_of(points, quads), points, cells)
    assert value < 1e-20
    assert np.abs(forces).max() < 1e-10


def looked_at_closely(barrier):
    """The barrier that skips no sample, however far it may be."""
    forward, backward = (
        replace(samples, distances=np.full(len(samples), np.inf)) for samples in (barrier.forward, barrier.backward)
    )
    return replace(barrier, forward=forward, backward=backward)


def mantle_node(points):
    """A node on the mantle of the cylinder, half-way up, and the way outwards there."""
    radius = np.hypot(*points[:, :2].T)
    node = np.flatnonzero(np.isclose(radius, radius.max()) & np.isclose(points[:, 2], 1.0))[0]
    return node, np.append(points[node, :2] / np.linalg.norm(points[node, :2]), 0.0)


def test_curvature_is_the_second_derivative_outwards(cylinder):
    points, cells, quads = cylinder
    node, outward = mantle_node(points)
    for share in (0.3, 0.9):  # the soft part, and the steep one as well
        moved = points.copy()
        moved[node] += share * 0.05 * outward
        barrier = barrier_of(points, quads)
        _, _, full = convex(barrier, moved, cells)
        way = np.zeros_like(points)
        way[node] = outward
        step = 1e-5
        ahead, here, behind = (barrier.value(moved + s * step * way) for s in (1, 0, -1))
        second = (ahead - 2 * here + behind) / step**2
        assert way.ravel() @ full @ way.ravel() == pytest.approx(second, rel=1e-2)


def test_beyond_the_end_of_a_curve_the_way_back_along_it_is_assembled():
    # A node of an edge of a box, pulled out beyond the corner in which the edge ends.
    points, cells = generate.box((3, 3, 3))
    node = np.flatnonzero((np.abs(points - [2 / 3, 0, 0]) < 1e-9).all(axis=1))
    moved = points.copy()
    moved[node, 0] = 1.003
    barrier = barrier_of(points, boundary_quads(cells)[0])
    _, forces, full = convex(barrier, moved, cells)
    way = np.zeros_like(points)
    way[node, 0] = 1.0
    ahead, here, behind = (barrier.value(moved + s * 1e-5 * way) for s in (1, 0, -1))
    assert forces[node, 0] == pytest.approx((ahead - behind) / 2e-5, rel=1e-4)
    assert way.ravel() @ full @ way.ravel() == pytest.approx((ahead - 2 * here + behind) / 1e-10, rel=1e-2)


def test_a_hole_is_felt_from_the_original_surface_alone():
    # The corner of a plate is cut off: all that is left lies on the original, which misses the corner.
    points, cells = generate.box((4, 4, 1))
    quads = boundary_quads(cells)[0]
    moved = points.copy()
    corner = (points[:, :2] == 1.0).all(axis=1)
    moved[corner, :2] = 0.93
    barrier = DistanceBarrier.around(SurfaceLocator(points, quads), 0.1)
    apart = hausdorff(moved, points, quads)
    ahead = SurfaceLocator(points, quads).closest(moved[np.unique(quads)]).distances.max()
    assert ahead < 0.01 * apart
    assert 0.8 < apart / 0.1 < 0.99
    assert barrier.relative_distance(moved) == pytest.approx(apart / 0.1, rel=1e-6)
    value, forces, full = convex(barrier, moved, cells)
    # It lies beyond the wall, which is behind it once the barrier is seen from there.
    assert barrier.value(moved) == np.inf
    assert value == pytest.approx(barrier.renewed(moved).value(moved), rel=1e-12)
    assert value > 0.1
    assert (forces[corner][:, :2] < 0).all()
    assert np.abs(full[np.repeat(corner, 3)]).max() > 0


def test_gradient_agrees_with_differences(cylinder):
    points, cells, quads = cylinder
    rng = np.random.default_rng(0)
    moved = points + 0.004 * rng.normal(size=points.shape)
    barrier = barrier_of(points, quads)
    value, forces, _ = convex(barrier, moved, cells)
    np.testing.assert_allclose(forces, barrier.value_gradient(moved)[1], rtol=1e-9, atol=1e-12)
    direction = rng.normal(size=points.shape)
    slope = np.einsum("ij,ij->", forces, direction)
    step = 1e-7
    ahead, behind = barrier.value(moved + step * direction), barrier.value(moved - step * direction)
    assert value == pytest.approx(barrier.value(moved), rel=1e-12)
    assert (ahead - behind) / (2 * step) == pytest.approx(slope, rel=1e-4)


def test_the_limit_is_a_wall(cylinder):
    points, _, quads = cylinder
    barrier = barrier_of(points, quads, bound=0.05).renewed(points)
    grown, radius = points.copy(), np.hypot(*points[:, :2].T)
    node = np.flatnonzero(np.isclose(radius, radius.max()) & np.isclose(points[:, 2], 1.0))[0]
    outward = np.append(points[node, :2] / np.linalg.norm(points[node, :2]), 0.0)
    grown[node] += 0.04 * outward
    assert np.isfinite(barrier.value(grown))
    grown[node] += 0.02 * outward
    assert barrier.value(grown) == np.inf


def test_the_penalty_rises_without_bound_before_the_wall(cylinder):
    points, _, quads = cylinder
    barrier = barrier_of(points, quads, bound=0.05)
    radius = np.hypot(*points[:, :2].T)
    node = np.flatnonzero(np.isclose(radius, radius.max()) & np.isclose(points[:, 2], 1.0))[0]
    outward = np.append(points[node, :2] / np.linalg.norm(points[node, :2]), 0.0)
    values = []
    for share in (0.9, 0.97, 0.979, 0.9799):
        grown = points.copy()
        grown[node] += share * 0.05 * outward
        values.append(barrier.value(grown))
    assert values[1] > 2 * values[0]
    assert values[2] > 5 * values[1]
    assert values[3] > 5 * values[2]
    assert np.isfinite(values[3])


def test_the_relative_distance_is_the_hausdorff_distance_in_bounds(cylinder):
    points, _, quads = cylinder
    moved = points + 0.01 * np.random.default_rng(1).normal(size=points.shape)
    assert barrier_of(points, quads, 0.05).relative_distance(moved) == pytest.approx(
        hausdorff(moved, points, quads) / 0.05, rel=1e-6
    )


def test_far_samples_are_skipped_without_changing_the_value(cylinder):
    points, _, quads = cylinder
    rng = np.random.default_rng(2)
    lazy, moved = barrier_of(points, quads), points
    for _ in range(5):
        moved = moved + 0.003 * rng.normal(size=points.shape)
        lazy = lazy.renewed(moved)
    fresh = replace(looked_at_closely(barrier_of(points, quads)), wall=lazy.wall)
    assert lazy.value(moved) == pytest.approx(fresh.value(moved), rel=1e-9)


def test_far_samples_are_noticed_when_they_come_near(cylinder):
    # Half the way to the wall in each step, looked at in between: the second half counts from where the first ended.
    points, _, quads = cylinder
    radius = np.hypot(*points[:, :2].T)
    outwards = np.zeros_like(points)
    mantle = np.isclose(radius, radius.max())
    outwards[mantle, :2] = points[mantle, :2] / radius.max()
    start = DistanceBarrier.around(SurfaceLocator(points, quads), 0.05)
    lazy = start.renewed(points + 0.5 * 0.05 * outwards)
    there = points + 0.9 * 0.05 * outwards
    value = looked_at_closely(start).value(there)
    assert value > 1.0
    assert lazy.value(there) == pytest.approx(value, rel=1e-9)
    # What has come near without moving on its own account is known to be near.
    assert lazy.renewed(there).value(there) == pytest.approx(value, rel=1e-9)


def test_curves_and_corners_have_a_barrier_at_a_fifth_of_the_bound(cylinder):
    points, cells, quads = cylinder
    features = find_features(points, quads)
    rims = np.setdiff1d(features.edges, features.corners)
    node = rims[0]
    inward = -np.append(points[node, :2] / np.linalg.norm(points[node, :2]), 0.0)
    ends = [DistanceBarrier.around(SurfaceLocator(points, quads), 0.05, kept) for kept in (features, None)]
    for share, inside in ((0.19, True), (0.21, False)):
        moved = points.copy()
        moved[node] += share * 0.05 * inward
        assert np.isfinite(ends[0].value(moved)) == inside
        assert np.isfinite(ends[1].value(moved))
    moved = points.copy()
    moved[node] += 0.15 * 0.05 * inward
    values, forces = zip(*[convex(barrier, moved, cells)[:2] for barrier in ends], strict=True)
    assert values[0] > values[1]
    assert forces[0][node] @ inward > forces[1][node] @ inward
    # A corner may go nowhere, not even along the edges that meet there.
    box, hexes = generate.box((3, 3, 3))
    skin = boundary_quads(hexes)[0]
    kept = find_features(box, skin)
    assert len(kept.corners) == 8
    for share, inside in ((0.19, True), (0.21, False)):
        moved = box.copy()
        moved[kept.corners[0]] += (0.5 - box[kept.corners[0]]) * [2.0 * share * 0.05, 0.0, 0.0]
        assert np.isfinite(DistanceBarrier.around(SurfaceLocator(box, skin), 0.05, kept).value(moved)) == inside


def test_from_outside_the_wall_comes_in_with_the_worst(cylinder):
    points, cells, quads = cylinder
    node, outward = mantle_node(points)
    barrier = barrier_of(points, quads)
    limits = []
    for share in (5.0, 3.0, 1.2, 0.97):
        moved = points.copy()
        moved[node] += share * 0.05 * outward
        value, forces, _ = convex(barrier, moved, cells)
        assert np.isfinite(value)
        assert forces[node] @ outward > 0
        barrier = barrier.renewed(moved)
        limits.append(barrier.wall)
    assert limits == sorted(limits, reverse=True)
    assert limits[0] > 5.0
    assert limits[-1] == 0.98
    moved[node] += 0.02 * 0.05 * outward
    assert barrier.value(moved) == np.inf


def test_a_patch_leaves_out_what_its_nodes_cannot_change(cylinder):
    points, cells, quads = cylinder
    moved = points + 0.004 * np.random.default_rng(3).normal(size=points.shape)
    moving = np.zeros(len(points), dtype=bool)
    moving[quads[5]] = True
    whole, patch = barrier_of(points, quads), Patch.around(moving, cells, moved)
    cut = whole.restricted(patch)
    # Its faces are those that move, and what is beside them, with nodes that the patch has not.
    inside = len(patch.nodes)
    touched = (
        (cut.skin.faces < inside) & np.append(moving[patch.nodes], False)[np.minimum(cut.skin.faces, inside)]
    ).any(axis=1)
    assert touched.sum() == moving[quads].any(axis=1).sum() < len(touched) < len(quads)
    np.testing.assert_array_equal(cut.skin.points[:inside], moved[patch.nodes])
    assert len(cut.beside) > 0
    assert set(map(tuple, cut.beside)) <= set(map(tuple, moved))
    for samples, of_whole in ((cut.forward, whole.forward), (cut.backward, whole.backward)):
        assert touched[samples.carriers].all()
        assert 0 < len(samples) < len(of_whole)
    assert moving[patch.nodes[cut.curves.nodes]].any(axis=1).all()
    assert moving[patch.nodes[cut.curves.corners]].all()
    # Where nothing moves nothing is felt, however far everything is: here faces, edges and corners of a box.
    points, cells = generate.box((3, 3, 3))
    moving = np.zeros(len(points), dtype=bool)
    patch = Patch(np.arange(len(cells)), np.arange(len(points)), moving, 1.2 * points)
    assert barrier_of(points, boundary_quads(cells)[0]).restricted(patch).value(1.2 * points) == 0.0


def test_a_patch_feels_what_its_nodes_feel(cylinder):
    points, cells, quads = cylinder
    moved = points + 0.004 * np.random.default_rng(3).normal(size=points.shape)
    barrier = barrier_of(points, quads)
    forces = convex(barrier, moved, cells)[1]
    moving = np.zeros(len(points), dtype=bool)
    moving[quads[5]] = True
    patch = Patch.around(moving, cells, moved)
    inside, local = moved[patch.nodes], patch.local
    felt = convex(barrier.restricted(patch), inside, local[cells[patch.cells]])[1]
    assert np.abs(felt[local[moving.nonzero()[0]]] - forces[moving]).max() < 1e-9 * np.abs(forces).max()
    np.testing.assert_allclose(felt, barrier.restricted(patch).value_gradient(inside)[1], rtol=1e-9, atol=1e-12)


def test_a_finer_surface_draws_the_boundary_to_it():
    points, cells = generate.ball(3, 2)
    quads = boundary_quads(cells)[0]
    fine, fine_cells = generate.ball(9, 3)
    fine_quads = boundary_quads(fine_cells)[0]
    reference = SurfaceLocator(1.02 * fine, fine_quads)
    barrier = DistanceBarrier.around(SurfaceLocator(points, quads), 0.05, reference=reference)
    forces = convex(barrier, points, cells)[1]
    outward = np.einsum("ij,ij->i", -forces, points)
    surface = np.unique(quads)
    assert (outward[surface] > 0).all()


def test_flat_patches_leave_their_planes_open(cylinder):
    points, _, quads = cylinder
    features = find_features(points, quads)
    free = count_free_directions(flat_normals(points, quads, features.patches, 1e-6)[0])
    end = np.isclose(np.abs(points[:, 2] - points[:, 2].mean()), np.ptp(points[:, 2]) / 2)
    surface = np.zeros(len(points), dtype=bool)
    surface[quads] = True
    assert (free[surface & end] == 2).all()
    assert (free[surface & ~end] == 3).all()


def test_what_is_out_of_the_bound_between_samples_is_watched():
    # A coarse ball, the nodes of which stay as far from the middle as they were.
    points, cells = generate.ball(3, 1)
    points = points + np.random.default_rng(0).uniform(-0.1, 0.1, points.shape)
    quads, _ = boundary_quads(cells)
    moved = points + np.random.default_rng(9).uniform(-0.3, 0.3, points.shape)
    moved *= (np.linalg.norm(points, axis=1) / np.linalg.norm(moved, axis=1))[:, None]
    barrier = DistanceBarrier.around(SurfaceLocator(points, quads), 1.0)
    # A bound that all samples keep, but not the surface.
    apart = barrier.farthest(moved)
    barrier = DistanceBarrier.around(barrier.original, 0.5 * (apart + barrier.relative_distance(moved)))
    assert barrier.relative_distance(moved) < 1.0 < barrier.farthest(moved)
    assert barrier.exceeded(moved)
    assert not barrier.exceeded(points)
    for _ in range(3):
        barrier = barrier.watching(moved)
    assert barrier.relative_distance(moved) > 1.0
    assert barrier.relative_distance(moved) == pytest.approx(barrier.farthest(moved), rel=0.05)
    assert barrier.relative_distance(points) < 0.05
