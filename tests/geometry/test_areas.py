"""Areas, normals, volumes of triangle and quadrilateral surfaces, against mathematics."""

import numpy as np
import pytest
from meshes.surfaces import icosphere, mixed_sphere, quad_sphere

from hexconformal.geometry import (
    area_gradient,
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
