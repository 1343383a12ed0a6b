"""The distance of places on two surfaces as an energy."""

import numpy as np
import pytest
from meshes.surfaces import grid, icosphere, mixed_sphere, quad_cube

from hexconformal.geometry import SurfaceLocator, fan_triangles
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


def test_what_no_cell_covers_counts_too():
    # The tip of a sphere is cut off: cells are on the input, or close to it, but the tip of the input is left alone.
    points, cells = icosphere(3)
    cut = points.copy()
    cut[points[:, 2] > 0.95, 2] = 0.95
    near = Nearness(points, cells, cut, 1.0, 1.0)
    vertices, faces, _ = fan_triangles(points, cells)
    top = SurfaceLocator(cut, faces).closest(vertices[[vertices[:, 2].argmax()]]).distances[0]
    assert top > 0.04
    gradient, _ = near.derivatives(cut)
    pulled = cut[:, 2] == 0.95
    assert (gradient[pulled, 2] < 0).all()
    assert np.abs(gradient[cut[:, 2] < 0.8]).max() < 1e-9


def test_places_at_a_thin_wall_keep_to_their_side():
    points, cells = quad_cube(10)
    plate = points * [1, 1, 0.02]
    top = points[:, 2] == 1
    moved = plate + np.where(top[:, None], [0, 0, -0.03], 0)
    near = Nearness(plate, cells, moved, 1.0, 1.0)
    gradient, _ = near.derivatives(moved)
    inner = top & (np.abs(points[:, :2]) < 0.9).all(axis=1)
    assert (gradient[inner, 2] < 0).all()
