"""Closest points against formulas, brute force and VTK's locator."""

import numpy as np
import pytest
from meshes.hexahedra import skin

from hexconformal.common.errors import MeshError, OptionError
from hexconformal.generate import ball, box, cylinder
from hexconformal.geometry.closest_point import CurveLocator, SurfaceLocator
from hexconformal.geometry.closest_point_kernels import closest_on_segment, closest_on_triangle

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


def rough(seed=0):
    """A ball whose surface is noisy enough to be folded."""
    points, quads = skin(ball(4, 2))
    return points + np.random.default_rng(seed).normal(size=points.shape) * 0.1, quads


def triangles(points, quads):
    x = points[quads]
    center = np.broadcast_to(x.mean(axis=1, keepdims=True), x.shape)
    return np.stack([x, np.roll(x, -1, axis=1), center], axis=2).reshape(-1, 3, 3)


def brute(places, corners):
    """Distances by looking at plane, edges and corners of every triangle."""
    a, b, c = (corners[None, :, i] for i in range(3))
    p = places[:, None]
    best = np.full((len(places), corners.shape[0]), np.inf)
    for u, v in ((a, b), (b, c), (c, a)):
        along = v - u
        t = np.clip(((p - u) * along).sum(-1) / np.maximum((along**2).sum(-1), 1e-300), 0, 1)
        best = np.minimum(best, np.linalg.norm(u + t[..., None] * along - p, axis=-1))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    height = ((p - a) * normal / length).sum(-1)
    foot = p - height[..., None] * normal / length
    inside = np.ones(best.shape, dtype=bool)
    for u, v in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(v - u, foot - u) * normal).sum(-1) >= 0
    return np.where(inside, np.minimum(best, np.abs(height)), best).min(axis=1)


def test_closest_on_a_cube_is_the_clipped_point():
    points, quads = skin(box((3, 4, 5)))
    places = np.random.default_rng(1).uniform(-1, 2, (500, 3))
    places = places[((places < 0) | (places > 1)).any(axis=1)]
    there = SurfaceLocator(points, quads).closest(places)
    np.testing.assert_allclose(there.positions, np.clip(places, 0, 1), atol=1e-14)
    np.testing.assert_allclose(there.distances, np.linalg.norm(places - np.clip(places, 0, 1), axis=1), atol=1e-14)


def test_closest_on_a_sphere_within_the_sagitta():
    points, quads = skin(ball(8, 2))
    places = np.random.default_rng(2).normal(size=(300, 3))
    there = SurfaceLocator(points, quads).closest(places)
    exact = np.abs(np.linalg.norm(places, axis=1) - 1)
    longest = np.linalg.norm(points[quads] - np.roll(points[quads], 1, axis=1), axis=2).max()
    assert np.abs(there.distances - exact).max() < longest**2 / 4


@pytest.mark.parametrize("size", [3, 4])
def test_closest_agrees_with_brute_force_on_a_folded_surface(size):
    points, quads = rough()
    faces = quads if size == 4 else np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    places = np.random.default_rng(3).normal(size=(400, 3))
    surface = SurfaceLocator(points, faces)
    there = surface.closest(places)
    corners = triangles(points, quads) if size == 4 else points[faces]
    np.testing.assert_allclose(there.distances, brute(places, corners), rtol=1e-12)
    # What comes back is one point: position, distance and weights say the same.
    np.testing.assert_allclose(np.linalg.norm(there.positions - places, axis=1), there.distances, rtol=1e-12)
    again = np.einsum("kj,kji->ki", there.weights, points[faces[there.faces]])
    np.testing.assert_allclose(again, there.positions, atol=1e-14)
    guessed = surface.closest(places, np.random.default_rng(4).integers(0, len(faces), len(places)))
    np.testing.assert_array_equal(guessed.distances, there.distances)


def test_closest_agrees_with_the_locator_of_vtk():
    import pyvista as pv

    points, quads = rough(5)
    places = np.random.default_rng(6).normal(size=(300, 3))
    corners = triangles(points, quads).reshape(-1, 3)
    faces = np.column_stack([np.full(len(corners) // 3, 3), np.arange(len(corners)).reshape(-1, 3)])
    _, foot = pv.PolyData(corners, faces).find_closest_cell(places, return_closest_point=True)
    there = SurfaceLocator(points, quads).closest(places)
    np.testing.assert_allclose(there.distances, np.linalg.norm(foot - places, axis=1), rtol=1e-9)


def test_result_does_not_depend_on_the_number_of_threads(monkeypatch):
    from hexconformal.kernel import threads

    points, quads = rough(7)
    places = np.random.default_rng(8).normal(size=(9000, 3))
    several = SurfaceLocator(points, quads).closest(places)
    monkeypatch.setattr(threads, "thread_count", lambda: 1)
    one = SurfaceLocator(points, quads).closest(places)
    np.testing.assert_array_equal(several.positions, one.positions)


def test_walk_finds_the_closest_point_nearby():
    points, quads = skin(cylinder())
    surface = SurfaceLocator(points, quads)
    of = np.arange(len(quads))
    places = points[quads].mean(axis=1) * 1.02
    np.testing.assert_allclose(
        surface.closest_by_walk(places, of).distances, surface.closest(places).distances, atol=1e-15
    )
    # From far away, on a convex surface, too: only on the same side, going downhill all the way.
    far = np.where(points[quads].mean(axis=1)[:, 2] > points[:, 2].max() - 1e-9)[0]
    there = surface.closest_by_walk(places[far], np.full(len(far), far[0]))
    np.testing.assert_allclose(there.distances, surface.closest(places[far]).distances, atol=1e-15)


def test_walk_does_not_jump_through_a_thin_wall():
    points, quads = skin(box((10, 10, 1), lengths=(1, 1, 0.01)))
    surface = SurfaceLocator(points, quads)
    center = points[quads].mean(axis=1)
    top = np.flatnonzero((center[:, 2] == 0.01) & (np.abs(center[:, :2] - 0.5) < 0.2).all(axis=1))
    places = center[top] - [0, 0, 0.008]
    np.testing.assert_allclose(surface.closest(places).distances, 0.002, rtol=1e-9)
    np.testing.assert_allclose(surface.closest_by_walk(places, top).distances, 0.008, rtol=1e-9)


@pytest.mark.parametrize("height", [0.0, 0.3])
def test_rounding_does_not_choose_between_faces_that_meet_in_the_closest_point(height):
    roof = SurfaceLocator(np.vstack([SQUARE, [[0.0, 0, -1], [0, 1, -1]]]), np.array([[0, 1, 2, 3], [0, 3, 5, 4]]))
    rng = np.random.default_rng(0)
    # Above the ridge, or on it: both faces are equally close.
    places = np.column_stack([np.full(200, -height), rng.uniform(0, 1, 200), np.full(200, height)])
    for face in (0, 1):
        there = roof.closest_by_walk(places + 1e-15 * rng.normal(size=places.shape), np.full(200, face))
        assert (there.faces == face).all()
        np.testing.assert_allclose(there.distances, height * np.sqrt(2), atol=1e-14)


def test_moved_surface_answers_for_its_new_place():
    points, quads = skin(box((3, 3, 3)))
    surface = SurfaceLocator(points, quads)
    before = surface.neighbours
    moved = surface.with_points(points + [5.0, 0, 0])
    assert moved.neighbours is before
    np.testing.assert_allclose(moved.closest([[4.0, 0.5, 0.5]]).distances, 1.0)
    np.testing.assert_allclose(moved.closest_by_walk([[4.0, 0.5, 0.5]], np.array([0])).distances, 1.0)


def test_triangles_without_area_are_segments_and_points():
    rng = np.random.default_rng(9)
    for _ in range(50):
        a, along, p = rng.normal(size=(3, 3))
        s, t = rng.uniform(-2, 2, 2)
        corners = np.array([a, a + s * along, a + t * along])
        foot = np.array(closest_on_triangle(tuple(p), *map(tuple, corners))) @ corners
        low, high = min(0, s, t), max(0, s, t)
        exact = a + np.clip((p - a) @ along / (along @ along), low, high) * along
        np.testing.assert_allclose(np.linalg.norm(p - foot), np.linalg.norm(p - exact), rtol=1e-7)
    assert sum(closest_on_triangle((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))) == 1.0
    assert closest_on_segment((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)) == 0.0


def test_surface_of_a_pyvista_sphere():
    import pyvista as pv

    surface = SurfaceLocator.from_pyvista(pv.Sphere(radius=2.0, theta_resolution=60, phi_resolution=60))
    np.testing.assert_allclose(surface.closest([[5.0, 0, 0], [0, 0, 0.0]]).distances, [3.0, 2.0], atol=0.01)
    volume = SurfaceLocator.from_pyvista(pv.ImageData(dimensions=(3, 3, 3)))
    np.testing.assert_allclose(volume.closest([[1.0, 1, 5]]).positions, [[1, 1, 2]])


def test_triangles_that_repeat_their_points_are_joined():
    import pyvista as pv

    sphere = pv.Sphere()
    corners = np.asarray(sphere.points)[sphere.regular_faces].reshape(-1, 3)
    soup = SurfaceLocator.from_pyvista(pv.PolyData.from_regular_faces(corners, np.arange(len(corners)).reshape(-1, 3)))
    joined = SurfaceLocator.from_pyvista(sphere)
    assert (len(soup.points), len(soup.faces)) == (len(joined.points), len(joined.faces)) == (842, 1680)
    # Only with neighbours can a walk leave the triangle it starts from.
    away = [[0.0, 0.0, 5.0]]
    assert soup.closest_by_walk(away, np.array([len(soup.faces) // 2])).distances[0] == pytest.approx(4.5, abs=1e-6)


@pytest.mark.parametrize("source", ["MultiBlock", "PolyData", "number"])
def test_what_has_no_faces_is_no_surface(source):
    import pyvista as pv

    given = {"MultiBlock": pv.MultiBlock([pv.Sphere()]), "PolyData": pv.PolyData(), "number": 3}[source]
    with pytest.raises(MeshError, match="none" if source == "PolyData" else "one pyvista dataset, or a path, not"):
        SurfaceLocator.from_pyvista(given)


@pytest.mark.parametrize("faces", [np.empty((0, 4), int), np.array([[0, 1]]), np.array([0, 1, 2])])
def test_surface_without_proper_faces_is_refused(faces):
    with pytest.raises(MeshError, match="three or four nodes"):
        SurfaceLocator(SQUARE, faces)


def circle(n):
    t = np.linspace(0, 2 * np.pi, n, endpoint=False)
    return np.column_stack([np.cos(t), np.sin(t), 0 * t]), np.column_stack([np.arange(n), (np.arange(n) + 1) % n])


def test_polyline_stays_on_the_curve_asked_for():
    points, edges = circle(64)
    above = points + [0, 0, 1]
    both = CurveLocator(np.concatenate([points, above]), np.concatenate([edges, edges + 64]), np.repeat([0, 1], 64))
    places = np.random.default_rng(10).normal(size=(100, 3))
    for curve in (0, 1):
        there = both.closest(places, np.full(100, curve))
        across = np.linalg.norm(places[:, :2], axis=1) - 1
        exact = np.hypot(across, places[:, 2] - curve)
        np.testing.assert_allclose(there.distances, exact, atol=1 - np.cos(np.pi / 64))
        assert (there.faces // 64 == curve).all()
        np.testing.assert_allclose(there.positions[:, 2], curve)
    for none in (2, -1):
        with pytest.raises(OptionError, match="these are not: 100"):
            both.closest(places, np.full(100, none))
    with pytest.raises(OptionError, match="these are not: 1"):
        CurveLocator(points, edges, np.where(np.arange(64) < 32, 0, 2)).closest([[0.0, 0, 0]], [1])


def test_polyline_walk_goes_along_its_curve_and_stops_at_the_end():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [4, 0, 0]])
    edges = np.array([[2, 1], [0, 1], [2, 3], [4, 3]])
    line = CurveLocator(points, edges, np.array([0, 0, 1, 1]))
    place = np.array([[3.7, 1.0, 0.0]])
    np.testing.assert_allclose(line.closest_by_walk(place, np.array([1])).positions, [[2, 0, 0]])
    there = line.closest_by_walk(place, np.array([2]))
    np.testing.assert_allclose(there.positions, [[3.7, 0, 0]])
    np.testing.assert_allclose(there.weights, [[0.7, 0.3]])


def test_polyline_walk_does_not_jump_across_a_narrow_strip():
    # A loop around a strip 0.01 wide: the other side is closer, the own side is meant.
    x = np.linspace(0, 1, 21)
    points = np.concatenate([np.column_stack([x, 0 * x, 0 * x]), np.column_stack([x[::-1], 0 * x + 0.01, 0 * x])])
    edges = np.column_stack([np.arange(42), (np.arange(42) + 1) % 42])
    loop = CurveLocator(points, edges, np.zeros(42, int))
    place = np.array([[0.525, 0.008, 0.0]])
    np.testing.assert_allclose(loop.closest(place, [0]).distances, 0.002)
    np.testing.assert_allclose(loop.closest_by_walk(place, np.array([10])).distances, 0.008)


def test_same_answer_for_every_unit_and_far_away():
    points, quads = rough(11)
    places = np.random.default_rng(12).normal(size=(200, 3))
    plain = SurfaceLocator(points, quads).closest(places)
    for unit, shift in ((1e-6, 0.0), (1e6, 0.0), (1.0, 2e4)):
        other = SurfaceLocator(points * unit + shift, quads).closest(places * unit + shift)
        np.testing.assert_allclose(other.distances, plain.distances * unit, rtol=1e-8)


def test_neighbours_of_the_same_label_are_those_that_share_a_node_and_the_label():
    triangles = np.array([[0, 1, 2], [2, 1, 3], [2, 3, 4], [5, 6, 7], [4, 5, 0]])
    labels = np.array([0, 0, 1, 0, 1])
    offsets, ids = SurfaceLocator(np.random.default_rng(0).normal(size=(8, 3)), triangles).neighbours_of_same(labels)
    for face, nodes in enumerate(triangles):
        expected = [k for k, other in enumerate(triangles) if labels[k] == labels[face] and set(nodes) & set(other)]
        assert ids[offsets[face] : offsets[face + 1]].tolist() == expected
