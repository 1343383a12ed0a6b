"""Areas, normals, volumes of triangle and quadrilateral surfaces, against mathematics."""

import numpy as np
import pytest
from meshes.surfaces import icosphere, mixed_sphere, quad_sphere

from hexconformal.geometry import (
    area_gradient,
    corner_angles,
    enclosed_volume,
    face_area_vectors,
    face_areas,
    nodal_area_vectors,
    nodal_areas,
)

SURFACES = [icosphere(2), quad_sphere(6), mixed_sphere(6)]


@pytest.mark.parametrize("surface", SURFACES)
def test_nodal_vectors_are_the_gradient_of_the_volume(surface):
    points, cells = surface
    direction = np.random.default_rng(0).normal(size=points.shape)
    step = 1e-5
    ends = [enclosed_volume(points + sign * step * direction, cells) for sign in (1, -1)]
    assert (nodal_area_vectors(points, cells) * direction).sum() == pytest.approx(
        (ends[0] - ends[1]) / (2 * step), abs=1e-9
    )


@pytest.mark.parametrize("surface", SURFACES)
def test_the_derivative_of_the_area(surface):
    points, cells = surface
    direction = np.random.default_rng(0).normal(size=points.shape)
    ends = [face_areas(points + sign * 1e-6 * direction, cells).sum() for sign in (1, -1)]
    slope = (area_gradient(points, cells) * direction).sum()
    assert slope == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-7)


@pytest.mark.parametrize("surface", SURFACES)
def test_vectors_and_areas_add_up(surface):
    points, cells = surface
    assert np.abs(face_area_vectors(points, cells).sum(axis=0)).max() < 1e-13
    assert nodal_areas(points, cells).sum() == pytest.approx(face_areas(points, cells).sum())


def test_volume_of_a_sphere_converges_with_second_order():
    errors = [4 * np.pi / 3 - enclosed_volume(*icosphere(level)) for level in (1, 2, 3)]
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (rates > 1.9).all()
    assert errors[-1] < 0.04


@pytest.mark.parametrize("width", [3, 4])
def test_vectors_and_angles_are_what_numpy_finds_of_degenerate_faces_too(width):
    rng = np.random.default_rng(3)
    points, faces = rng.normal(size=(200, 3)), rng.integers(0, 200, (3000, width))
    faces[:50, 1] = faces[:50, 0]
    x = points[faces]
    u, v = (x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) if width == 3 else (x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    np.testing.assert_array_equal(face_area_vectors(points, faces), np.cross(u, v) / 2)
    a, b = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    angles = np.arctan2(np.linalg.norm(np.cross(a, b), axis=2), (a * b).sum(axis=2))
    np.testing.assert_allclose(corner_angles(points, faces), angles, rtol=0, atol=1e-14)
    assert not corner_angles(points, faces)[:50, :2].any()


def test_angles_of_what_lies_on_a_line_are_nothing_to_the_last_bit():
    ways = np.random.default_rng(4).normal(size=(500, 3))
    for way in ways:
        assert corner_angles(np.stack([0 * way, way, 2 * way]), np.array([[0, 1, 2]])).tolist() == [[0.0, np.pi, 0.0]]
