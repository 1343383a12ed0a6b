"""Sheets inside a mesh: their sides, where they end, and distances of each from itself."""

import numpy as np
import pytest
from meshes.hexahedra import fibre, grains, wavy_layers

from hexconformal import generate
from hexconformal.elements import EDGES, cell_volumes
from hexconformal.geometry import (
    DistanceBarrier,
    SurfaceLocator,
    enclosed_volume,
    find_features,
    find_inner_sheets,
    hausdorff,
    joined_features,
)
from hexconformal.geometry.features import CORNER, CURVE
from hexconformal.mesh import boundary_quads, find_interfaces

PLANE = np.array([[x, y, 0.0] for x in range(4) for y in range(4)])
QUADS = np.array([[4 * x + y, 4 * x + y + 4, 4 * x + y + 5, 4 * x + y + 1] for x in range(3) for y in range(3)])
TWO = np.concatenate([PLANE, PLANE + [0.0, 0.0, 0.3]]), np.concatenate([QUADS, QUADS + 16])
SHEETS = np.repeat([0, 1], 9)


def two_sheets(points=TWO[0]):
    return SurfaceLocator(points, TWO[1], SHEETS)


def inside(mesh, **options):
    between = find_interfaces(mesh.cells, mesh.cell_data["material"])
    quads, kinds = between.quads, between.owners
    return find_inner_sheets(mesh.points, quads, kinds, **options)


def test_points_are_closest_on_the_sheet_they_are_looked_for_on():
    places = np.array([[1.4, 1.6, 0.29], [1.4, 1.6, 0.01]])
    for start in (np.array([0, 9]), np.array([8, 17])):
        there = two_sheets().closest(places, start)
        np.testing.assert_allclose(there.distances, 0.29)
        np.testing.assert_array_equal(SHEETS[there.faces], [0, 1])
        walked = two_sheets().closest_by_walk(places, start)
        np.testing.assert_allclose(walked.distances, 0.29)


def test_walks_stay_on_their_sheet_where_sheets_share_nodes():
    # Two walls of a corner: without sheets the walk goes round it.
    points = np.array([[x, y, z] for y, z in ((2, 0), (1, 0), (0, 0), (0, 1)) for x in (0.0, 1.0)])
    quads = np.array([[0, 1, 3, 2], [2, 3, 5, 4], [4, 5, 7, 6]])
    place, start = np.array([[0.5, 0.1, 0.9]]), np.array([0])
    assert SurfaceLocator(points, quads).closest_by_walk(place, start).distances[0] == pytest.approx(0.1)
    for find in ("closest", "closest_by_walk"):
        there = getattr(SurfaceLocator(points, quads, np.array([0, 0, 1])), find)(place, start)
        assert there.distances[0] == pytest.approx(0.9)


def test_every_sheet_is_compared_with_itself():
    swapped = TWO[0] + np.where(TWO[0][:, 2:] > 0, -0.3, 0.3) * [0.0, 0.0, 1.0]
    assert hausdorff(swapped, *TWO) == 0.0
    assert hausdorff(swapped, *TWO, sheets=SHEETS) == pytest.approx(0.3)


def test_sides_agree_within_a_sheet_whichever_came_in():
    mesh = fibre()[0]
    between = find_interfaces(mesh.cells, mesh.cell_data["material"])
    quads, kinds = between.quads, between.owners
    over = np.random.default_rng(0).uniform(size=len(quads)) < 0.5
    mixed = np.where(over[:, None], quads[:, ::-1], quads)
    inner = find_inner_sheets(mesh.points, mixed, kinds)
    # A closed tube between two planes: with one side out its volume is that of the fibre but for the lids.
    ends = mesh.points[inner.quads]
    flux = np.einsum(
        "qi,qi->", np.cross(ends[:, 2] - ends[:, 0], ends[:, 3] - ends[:, 1]), ends.mean(axis=1) * [1, 1, 0]
    )
    fibre_volume = cell_volumes(mesh.points, mesh.cells)[mesh.cell_data["material"] == 0].sum()
    assert abs(flux) / 4 == pytest.approx(fibre_volume, rel=0.02)
    assert inner.sheets.max() == 0


def test_a_closed_sheet_encloses_what_is_inside():
    points, cells = generate.box((4, 4, 4))
    block = (np.abs(points[cells].mean(axis=1) - 0.5) < 0.25).all(axis=1)
    between = find_interfaces(cells, block.astype(np.int64))
    quads, kinds = between.quads, between.owners
    inner = find_inner_sheets(points, quads[np.random.default_rng(1).permutation(len(quads))], kinds)
    assert abs(enclosed_volume(points, inner.quads)) == pytest.approx(0.125)
    assert len(inner.features.corners) == 8
    assert inner.features.curves.max() + 1 == 12


def test_a_band_with_one_side_is_no_obstacle():
    turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    across = np.stack([np.cos(turns / 2) * np.cos(turns), np.cos(turns / 2) * np.sin(turns), np.sin(turns / 2)], axis=1)
    middle = 3 * np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    points = np.concatenate([middle - across, middle + across])
    k, n = np.arange(24), np.roll(np.arange(24), -1)
    twist = n < k
    quads = np.stack([k, np.where(twist, n + 24, n), np.where(twist, n, n + 24), k + 24], axis=1)
    inner = find_inner_sheets(points, quads, np.zeros(24, np.int64))
    assert inner.sheets.max() == 0
    assert len(inner.features.edges) >= 48


def test_grains_meet_in_curves_that_stay_where_stairs_are_soft():
    mesh = grains(8)
    inner = inside(mesh, tolerance=0.01)
    assert "stair steps" in inner.features.reason
    # Edges around which there are three or more grains, or two and the skin.
    pairs = np.sort(mesh.cells[:, EDGES].reshape(-1, 2), axis=1).tolist()
    around = {tuple(pair): set() for pair in pairs}
    for pair, grain in zip(pairs, np.repeat(mesh.cell_data["material"], 12).tolist(), strict=True):
        around[tuple(pair)].add(grain)
    skin = np.stack([quads := boundary_quads(mesh.cells)[0], np.roll(quads, 1, axis=1)], axis=2).reshape(-1, 2)
    for pair in np.sort(skin, axis=1).tolist():
        around[tuple(pair)].add("outside")
    meeting = {pair for pair, regions in around.items() if len(regions) > 2}
    assert set(map(tuple, np.sort(inner.features.edges, axis=1).tolist())) == meeting
    assert len(inner.features.slack_curves) == inner.features.curves.max() + 1
    assert inner.features.slack_corners.all()


def test_kinds_are_told_apart_by_curves():
    kinds = (np.arange(9) >= 3).astype(np.int64)
    inner = find_inner_sheets(PLANE, QUADS, kinds)
    np.testing.assert_array_equal(inner.sheets, kinds)
    line = np.flatnonzero(PLANE[:, 0] == 1)
    assert (inner.features.kind[line[1:-1]] == CURVE).all()
    assert (inner.features.kind[line[[0, -1]]] == CORNER).all()


def test_nodes_where_a_curve_of_the_skin_meets_a_sheet_are_corners():
    mesh = wavy_layers(6, jitter=0.0)
    skin = find_features(mesh.points, boundary_quads(mesh.cells)[0])
    both = joined_features(mesh.points, skin, inside(mesh).features)
    assert len(both.corners) == 12
    assert both.patches.max() + 1 == 7
    assert not both.slack.any()
    soft = joined_features(
        mesh.points, find_features(mesh.points, boundary_quads(mesh.cells)[0], mode="soft"), inside(mesh).features
    )
    assert len(soft.edges) == 24


def test_the_barrier_keeps_every_sheet_from_where_it_was():
    barrier = DistanceBarrier.around(two_sheets(), 0.4)
    swapped = TWO[0] + np.where(TWO[0][:, 2:] > 0, -0.3, 0.3) * [0.0, 0.0, 1.0]
    assert barrier.relative_distance(swapped) == pytest.approx(0.75)
    assert barrier.farthest(swapped) == pytest.approx(0.75)
    assert DistanceBarrier.around(SurfaceLocator(*TWO), 0.29).relative_distance(swapped) == 0.0
    assert DistanceBarrier.around(two_sheets(), 0.29).exceeded(swapped)
    assert DistanceBarrier.around(two_sheets(), 0.29).watching(swapped).relative_distance(swapped) > 1.0


def test_curves_of_soft_sheets_go_as_far_as_these():
    mesh = grains(6, jitter=0.0)
    bound, shift = 0.05, np.array([0.03, 0.0, 0.0])
    inner = inside(mesh, tolerance=bound)
    original = SurfaceLocator(mesh.points, inner.quads, inner.sheets)
    barriers = [
        DistanceBarrier.around(original, bound, features)
        for features in (inner.features, find_features(mesh.points, inner.quads, mode="keep"))
    ]
    # Beyond the wall of kept curves, at a fifth of the bound, and not of those.
    assert np.isfinite(barriers[0].value(mesh.points + shift))
    assert barriers[1].value(mesh.points + shift) == np.inf


def test_values_gradients_and_curvatures_agree_with_sheets():
    mesh = grains(5)
    rng = np.random.default_rng(3)
    inner = inside(mesh, tolerance=0.05)
    original = SurfaceLocator(mesh.points, inner.quads, inner.sheets)
    barrier = DistanceBarrier.around(original, 0.05, inner.features)
    here = mesh.points + 0.03 * rng.uniform(-1, 1, mesh.points.shape)
    barrier = barrier.renewed(here)
    way = rng.normal(size=here.shape)
    slope = np.einsum("ni,ni->", barrier.value_gradient(here)[1], way)
    step = 1e-6
    numeric = (barrier.value(here + step * way) - barrier.value(here - step * way)) / (2 * step)
    assert slope == pytest.approx(numeric, rel=1e-4)
    assert slope != 0.0
