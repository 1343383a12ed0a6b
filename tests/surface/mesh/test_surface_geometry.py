"""Areas, normals, volumes of triangle and quadrilateral surfaces, against mathematics."""

import numpy as np
import pytest
from surface_shapes import icosphere, mixed_sphere, none, quad_sphere

from surface.energy.reference import flat_angles, reference_shapes, triangle_from_angles
from surface.mesh.geometry import (
    Cells,
    area_gradient,
    area_vectors,
    cell_areas,
    enclosed_volume,
    nodal_areas,
    nodal_vectors,
    transport_vectors,
)

SURFACES = [icosphere(2), quad_sphere(6), mixed_sphere(6)]


@pytest.mark.parametrize("surface", SURFACES)
def test_nodal_vectors_are_the_gradient_of_the_volume(surface):
    points, cells = surface
    direction = np.random.default_rng(0).normal(size=points.shape)
    step = 1e-5
    ends = [enclosed_volume(points + sign * step * direction, cells) for sign in (1, -1)]
    assert (nodal_vectors(points, cells) * direction).sum() == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-9)


@pytest.mark.parametrize("surface", SURFACES)
def test_the_derivative_of_the_area(surface):
    points, cells = surface
    direction = np.random.default_rng(0).normal(size=points.shape)
    ends = [cell_areas(points + sign * 1e-6 * direction, cells).sum() for sign in (1, -1)]
    slope = (area_gradient(points, cells) * direction).sum()
    assert slope == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-7)


@pytest.mark.parametrize("surface", SURFACES)
def test_simpson_normal_gives_the_change_of_volume_exactly(surface):
    points, cells = surface
    v = 0.3 * np.random.default_rng(1).normal(size=points.shape)
    change = enclosed_volume(points + v, cells) - enclosed_volume(points, cells)
    assert (v * transport_vectors(points, points + v, cells, "simpson")).sum() == pytest.approx(change, abs=2e-14)
    assert abs((v * transport_vectors(points, points + v, cells, "middle")).sum() - change) > 1e-6


@pytest.mark.parametrize("surface", SURFACES)
def test_vectors_and_areas_add_up(surface):
    points, cells = surface
    assert np.abs(area_vectors(points, cells).sum(axis=0)).max() < 1e-13
    assert nodal_areas(points, cells).sum() == pytest.approx(cell_areas(points, cells).sum())


def test_volume_of_a_sphere_converges_with_second_order():
    errors = [4 * np.pi / 3 - enclosed_volume(*icosphere(level)) for level in (1, 2, 3)]
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (rates > 1.9).all()
    assert errors[-1] < 0.04


def test_the_middle_normal_is_orthogonal_to_third_order():
    """Gruber & Aulisa: <f(x + t v) - f(x), N(x + t v / 2)> = O(t^3), with the old normal only O(t^2)."""

    def f(u, v):
        return np.stack([u, v, 0.3 * u**2 - 0.2 * u * v + 0.5 * v**2 + 0.1 * u**3 + 0.2 * v**2 * u], axis=-1)

    def normal(u, v):
        n = np.stack([-(0.6 * u - 0.2 * v + 0.3 * u**2 + 0.2 * v**2), -(-0.2 * u + v + 0.4 * u * v), 1.0])
        return n / np.linalg.norm(n)

    t = np.array([0.1, 0.05, 0.025, 0.0125])
    chord = [f(0.2 + 0.7 * s, 0.1 - 0.4 * s) - f(0.2, 0.1) for s in t]
    middle = [abs(c @ normal(0.2 + 0.35 * s, 0.1 - 0.2 * s)) for c, s in zip(chord, t, strict=True)]
    old = [abs(c @ normal(0.2, 0.1)) for c in chord]
    assert np.log2(np.divide(middle[:-1], middle[1:])).min() > 2.9
    assert np.log2(np.divide(old[:-1], old[1:])).max() < 2.2


@pytest.mark.parametrize("valence", [3, 4, 5, 6, 7, 8, 16])
def test_flat_angles_are_positive_for_every_valence(valence):
    ring = np.arange(1, valence + 1)
    cells = Cells(np.stack([np.zeros(valence, int), ring, np.roll(ring, -1)], axis=1), none(4))
    angles = flat_angles(cells, valence + 1)
    assert (angles > 0.05).all()
    assert angles.sum(axis=1) == pytest.approx(np.pi)
    closed = flat_angles(icosphere(1)[1], 42)
    assert (closed > 0.05).all()


def test_triangles_from_angles_have_these_angles_and_one_area():
    angles = np.array([[0.5, 1.0, np.pi - 1.5], [np.pi / 3] * 3])
    shapes = triangle_from_angles(angles)
    flat = np.concatenate([shapes, np.zeros((2, 3, 1))], axis=2).reshape(-1, 3)
    cells = Cells(np.arange(6).reshape(2, 3), none(4))
    assert cell_areas(flat, cells) == pytest.approx(np.sqrt(3) / 4)
    from surface.mesh.geometry import cell_angles

    assert cell_angles(flat, cells.triangles) == pytest.approx(angles)


def test_reference_shapes_are_checked():
    from hexconformal.common.errors import OptionError

    points, cells = icosphere(1)
    with pytest.raises(OptionError, match="reference mesh"):
        reference_shapes(np.zeros((3, 3)), points, cells)
    with pytest.raises(OptionError, match="flat"):
        reference_shapes("round", points, cells)
    with pytest.raises(OptionError, match="without area"):
        reference_shapes((np.zeros((80, 3, 2)), np.zeros((0, 4, 2))), points, cells)
