"""The distance between two positions of a boundary: exact cases, symmetry, and the tool that scores results."""

import importlib.util

import numpy as np
import pytest
from independent_distance import fine_triangles, finely_measured
from meshes.hexahedra import skin
from meshes.surfaces import icosphere, mixed_sphere, quad_sphere

from hexconformal.generate import ball, box
from hexconformal.geometry import mean_distance
from hexconformal.geometry.closest_point import SurfaceLocator
from hexconformal.geometry.hausdorff import distance_between, faces_beyond, hausdorff, surface_samples
from hexconformal.mesh.topology import boundary_quads


def test_identical_surfaces_are_no_distance_apart():
    points, quads = skin(box((4, 4, 4)))
    assert hausdorff(points, points, quads) < 1e-15
    # Warped quads are followed to the tolerance.
    points, quads = skin(ball(4, 2))
    for tolerance in (1e-2, 1e-3, 1e-4):
        assert hausdorff(points, points, quads, tolerance) <= tolerance


def test_a_cube_that_shrinks():
    # The far corner of the unit cube is the square root of 3 times 0.2 from a cube of edge 0.8.
    points, quads = skin(box((4, 4, 4)))
    assert hausdorff(0.8 * points, points, quads) == pytest.approx(0.2 * 3**0.5, rel=1e-13)


def test_sliding_within_a_flat_face_is_no_distance():
    points, quads = skin(box((6, 6, 6)))
    moved = points.copy()
    inner = (np.abs(points[:, :2] - 0.5) < 0.4).all(axis=1) & (points[:, 2] == 1)
    moved[inner, 0] += 0.05
    assert hausdorff(moved, points, quads) < 1e-14


def test_both_directions_count():
    # One node pulled out: nothing of the old surface is far from the new, but not the other way round; and back.
    points, quads = skin(box((2, 2, 2)))
    pulled = points.copy()
    top = np.flatnonzero((points == [0.5, 0.5, 1.0]).all(axis=1))
    pulled[top, 2] += 0.3
    assert hausdorff(pulled, points, quads) == pytest.approx(0.3, rel=1e-13)
    assert hausdorff(points, pulled, quads) == pytest.approx(0.3, rel=1e-13)


def test_symmetric_and_without_regard_to_unit():
    points, quads = skin(ball(4, 2))
    other = points + np.random.default_rng(0).normal(size=points.shape) * 0.05
    one = hausdorff(points, other, quads)
    assert one == hausdorff(other, points, quads)
    assert hausdorff(1e-6 * points, 1e-6 * other, quads) == pytest.approx(1e-6 * one, rel=1e-10)


def test_surfaces_of_other_faces_can_be_compared():
    # A cube of quads in a larger one of two triangles a side: farthest from corner to corner.
    points, quads = skin(box((3, 3, 3)))
    corners, sides = skin(box((1, 1, 1)))
    halves = np.vstack([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])
    large = SurfaceLocator(1.5 * (corners - 0.5) + 0.5, halves)
    assert distance_between(SurfaceLocator(points, quads), large) == pytest.approx(0.25 * 3**0.5, rel=1e-13)
    # An edge is beaten in: all nodes of the large triangles stay on the surface, the middle of that edge does not.
    dented = points.copy()
    edge = np.flatnonzero((np.abs(points - [1.0, 1.0, 0.5]) < [1e-9, 1e-9, 0.4]).all(axis=1))
    dented[edge, :2] -= 0.1
    assert distance_between(SurfaceLocator(dented, quads), SurfaceLocator(corners, halves)) == pytest.approx(
        0.1 * 2**0.5, rel=1e-13
    )


def test_samples_of_triangles():
    of, weights = surface_samples(np.array([[0, 1, 2], [2, 1, 3]]))
    assert np.bincount(of).tolist() == [3 + 3 + 1 + 3, 1 + 2 + 1 + 3]
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-15)
    np.testing.assert_allclose(weights[-1], [1 / 6, 1 / 6, 4 / 6], rtol=1e-15)


def test_samples_are_where_they_should_be():
    points, quads = skin(box((1, 1, 1)))
    of, weights = surface_samples(quads)
    assert len(of) == 8 + 12 + 6 + 24
    places = np.einsum("sj,sji->si", weights, points[quads[of]])
    assert len(np.unique(places, axis=0)) == len(places)
    np.testing.assert_array_equal(places[:8], points[np.unique(quads)])
    pairs = [(a, b) for a in points for b in points if np.abs(a - b).sum() == 1]
    assert set(map(tuple, places[8:20])) == {tuple((a + b) / 2) for a, b in pairs}
    # Quarter points of a unit square lie a quarter from two of its sides.
    assert set(np.unique(places[26:])) == {0.0, 0.25, 0.75, 1.0}


@pytest.mark.long
@pytest.mark.parametrize("name", ["xu_t3_fandisk", "xu_t5_block", "xu_t1_bust"])
def test_no_less_than_the_tool_that_scores_results_and_what_many_samples_say(shared, name):
    meshio = pytest.importorskip("meshio")
    spec = importlib.util.spec_from_file_location("score_hex", shared / "tools" / "score_hex.py")
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    folder = shared / "meshes" / "hex"
    if not (folder / f"{name}_input.vtu").exists():
        pytest.skip("this mesh is not on this machine")
    mesh = meshio.read(folder / f"{name}_input.vtu")
    points, quads = np.asarray(mesh.points, float), boundary_quads(mesh.cells_dict["hexahedron"].astype(np.int64))[0]
    other = np.asarray(meshio.read(folder / f"{name}_published.vtu").points, float)
    diagonal = np.linalg.norm(np.ptp(points[np.unique(quads)], axis=0))
    measured = hausdorff(other, points, quads) / diagonal
    # The tool takes five samples of a quad, and quads for four triangles.
    assert measured > tool.hausdorff(other, points, quads) - 1e-4
    assert measured == pytest.approx(finely_measured(other, points, quads, 16) / diagonal, abs=3e-4)


@pytest.mark.parametrize("seed", range(6))
def test_coarse_warped_quads_are_measured_as_the_bilinear_surfaces_they_are(seed):
    points, quads = skin([box((3, 3, 3)), ball(3, 1)][seed % 2])
    random = np.random.default_rng(seed)
    points = points + random.uniform(-0.08, 0.08, points.shape)
    other = points + random.uniform(-0.04, 0.04, points.shape)
    tolerance = 0.002
    measured, expected = hausdorff(points, other, quads, tolerance), finely_measured(points, other, quads)
    assert measured == pytest.approx(expected, abs=2 * tolerance)


def test_what_is_not_above_a_distance_need_not_be_found():
    points, quads = skin(ball(4, 2))
    apart = hausdorff(1.1 * points, points, quads)
    assert hausdorff(1.1 * points, points, quads, least=0.5 * apart) == pytest.approx(apart, rel=0.03)
    assert hausdorff(1.1 * points, points, quads, least=2.0 * apart) == 2.0 * apart


def sampled(points, faces):
    """Places on a surface, 25 x 25 on each face."""
    return fine_triangles(points, np.concatenate([faces.triangles[:, [0, 1, 2, 2]], faces.quads]), 24)[0]


@pytest.mark.parametrize("surface", [icosphere(1), mixed_sphere(2)])
def test_triangles_and_surfaces_of_both_kinds_are_measured(surface):
    points, faces = surface
    rng = np.random.default_rng(5)
    x, y = (points + rng.uniform(-0.1, 0.1, points.shape) for _ in range(2))
    expected = 0.0
    for this, that in ((x, y), (y, x)):
        # Triangles are exact in the locator, quads are cut finely.
        quads = [fine_triangles(that, faces.quads, 24)] if len(faces.quads) else []
        others = [SurfaceLocator(that, faces.triangles), *(SurfaceLocator(*quad) for quad in quads)]
        places = sampled(this, faces)
        expected = max(expected, np.min([other.closest(places).distances for other in others], axis=0).max())
    assert hausdorff(x, y, faces, 0.001, relative=0.0) == pytest.approx(expected, abs=0.002)


@pytest.mark.parametrize("surface", [icosphere(1), quad_sphere(3)])
def test_faces_beyond_a_bound_are_those_with_places_that_are(surface):
    points, faces = surface
    table, rng = faces.table, np.random.default_rng(3)
    moved = points + rng.normal(size=points.shape) * 0.02
    moved[4] *= 1.3
    # The faces of the other surface have other numbers.
    one, other = SurfaceLocator(moved, table), SurfaceLocator(points, rng.permutation(table))
    bound = 0.1
    found = faces_beyond(one, other, bound, tolerance=1e-4)
    # Places of its own, and faces that are closest to places of the other surface.
    there = other.closest(sampled(moved, faces))
    here = one.closest(sampled(points, faces))
    ahead = (there.distances.reshape(len(table), -1) > bound).any(axis=1)
    behind = np.isin(np.arange(len(table)), here.faces[here.distances > bound])
    assert found[ahead].all()
    assert not found[~(ahead | behind)].any()
    assert 0 < found.sum() < 0.2 * len(table)
    # None where nothing is so far away.
    assert not faces_beyond(one, other, 0.4, tolerance=1e-4).any()


def test_faces_beyond_a_bound_are_found_between_their_nodes():
    # A cube of two triangles a side; of one in small quads two edges are beaten in, in the middle.
    points, quads = skin(box((8, 8, 8)))
    corners, sides = skin(box((1, 1, 1)))
    halves = np.vstack([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])
    edges = [([1.0, 1.0, 0.5], [0, 1]), ([0.5, 0.0, 1.0], [1, 2])]
    dented, expected = points.copy(), np.zeros(len(halves), dtype=bool)
    for middle, axes in edges:
        inward = np.where(np.isin(np.arange(3), axes), 0.5 - np.array(middle), 0.0)
        dented[(np.abs(points - middle) < 1e-9).all(axis=1)] += 0.2 * inward
        ends = np.flatnonzero((corners[:, axes] == np.array(middle)[axes]).all(axis=1))
        expected |= np.isin(halves, ends).sum(axis=1) == 2
    large, small = SurfaceLocator(corners, halves), SurfaceLocator(dented, quads)
    found = faces_beyond(large, small, 0.05, tolerance=1e-4)
    assert expected.sum() == 4
    np.testing.assert_array_equal(found, expected)


def test_a_warped_quad_is_no_distance_from_small_ones_on_it():
    # Four triangles around the centre are a 16th of what the diagonals miss each other by away from it.
    saddle = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 0.0]])
    quad = np.array([[0, 1, 2, 3]])
    small = SurfaceLocator(*fine_triangles(saddle, quad, 64))
    for tolerance in (1e-2, 1e-3):
        assert distance_between(SurfaceLocator(saddle, quad), small, tolerance=tolerance) <= 1.5 * tolerance < 1 / 16


def test_the_mean_distance_is_the_integral_over_both_surfaces():
    points, cells = box((4, 4, 4))
    quads = boundary_quads(cells)[0]
    # A plate pushed along by its own thickness times a slope: everywhere as far as that is in its own direction.
    far = points + [0.0, 0.0, 0.02]
    one, other = SurfaceLocator(far, quads), SurfaceLocator(points, quads)
    # Top and bottom are .02 away, of the sides only what sticks out.
    sides = 4 * 0.02 * 0.01 / 6
    assert mean_distance(one, other, near=True) == pytest.approx(2 * 0.02 / 6, rel=0.05, abs=sides)
    assert mean_distance(one, other) == mean_distance(other, one)
    assert mean_distance(other, other, near=True) < 1e-16
    fine = fine_triangles(far, quads, 12), fine_triangles(points, quads, 12)
    ways = [SurfaceLocator(*b).closest(a[0][a[1]].mean(axis=1)).distances for a, b in (fine, fine[::-1])]
    assert mean_distance(one, other) == pytest.approx(np.mean(np.concatenate(ways)), rel=0.1)
