"""The distance of places on two surfaces as an energy."""

import numpy as np
import pytest
from meshes.surfaces import grid, icosphere, mixed_sphere, quad_cube

from hexconformal.geometry import face_areas
from surface.constraint import Nearness


@pytest.mark.parametrize("shape", [icosphere(2), mixed_sphere(6)])
def test_the_gradient_is_that_of_the_energy(shape):
    points, cells = shape
    rng = np.random.default_rng(0)
    moved = points + 0.03 * rng.normal(size=points.shape)
    near = Nearness(points, cells, moved, 3.0, 0.1)
    gradient, hessian = near.derivatives(moved)
    way = rng.normal(size=points.shape)
    slope = (near.value(moved + 1e-6 * way) - near.value(moved - 1e-6 * way)) / 2e-6
    assert (gradient * way).sum() == pytest.approx(slope, rel=1e-4)
    assert abs(hessian - hessian.T).max() < 1e-9
    assert way.ravel() @ (hessian @ way.ravel()) > 0


def test_a_lifted_plane_is_as_far_away_as_it_was_lifted_and_those_far_away_count_more():
    points, cells, _ = grid(4)
    near = Nearness(points, cells, points, 2.0, 0.5)
    assert near.mean_square(points) == pytest.approx(0, abs=1e-20)
    for height in (0.1, 0.2):
        lifted = points + [0, 0, height]
        assert near.mean_square(lifted) == pytest.approx(height**2 + height**4 / 0.25)
        # Both surfaces are measured, a cell of mean size once each.
        assert near.value(lifted) == pytest.approx(2 * len(cells) * near.mean_square(lifted))


def test_a_step_towards_the_planes_below_leads_onto_a_sphere_as_near_as_cells_come():
    points, cells = icosphere(2)
    outside = 1.05 * points
    near = Nearness(points, cells, outside, 1.0, 1.0)
    gradient, hessian = near.derivatives(outside)
    step = np.linalg.lstsq(hessian.toarray() + 1e-9 * np.eye(points.size), -gradient.ravel(), rcond=None)[0]
    assert near.value(outside + step.reshape(-1, 3)) < 0.05 * near.value(outside)


def test_places_at_a_thin_wall_keep_to_their_side():
    points, cells = quad_cube(10)
    top, lowered = points[:, 2] == 1, (points[:, 2] == 1)[:, None] * [0, 0, -0.03]
    inner = top & (np.abs(points[:, :2]) < 0.9).all(axis=1)
    pulls = []
    for thickness in (0.02, 1.0):
        plate = points * [1, 1, thickness]
        near = Nearness(plate, cells, plate + lowered, 1.0, 1.0)
        # In units of the area that a cell of mean size has.
        pulls.append(near.derivatives(plate + lowered)[0][inner] * face_areas(plate, cells).mean())
    assert (pulls[0][:, 2] < 0).all()
    # Of the thick one a few places are nearer to its sides.
    np.testing.assert_allclose(*pulls, atol=0.01 * np.abs(pulls[0]).max())
