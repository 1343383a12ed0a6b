"""Areas and curvatures of discrete surfaces."""

import numpy as np
import pytest
from meshes.surfaces import SHAKEN_SPHERES, icosphere, mixed_sphere, quad_sphere, shaken

from surface.flow.discrete import DiscreteSurface, Elements


@pytest.mark.parametrize("surface", SHAKEN_SPHERES.values(), ids=SHAKEN_SPHERES)
def test_the_area_gradient_is_the_stiffness_matrix_times_the_points(surface):
    points, cells = surface()
    state = DiscreteSurface(Elements(cells, len(points)), points)
    assert np.abs(state.stiffness @ points - state.area_gradient).max() < 1e-13
    assert state.mass_matrix.sum() == pytest.approx(state.area, rel=1e-13)


@pytest.mark.parametrize(
    ("make", "sizes", "rate"),
    [(icosphere, (2, 3, 4), 3.5), (quad_sphere, (4, 8, 16), 10), (mixed_sphere, (4, 8, 16), 2)],
)
def test_curvature_converges_at_every_node_of_a_sphere(make, sizes, rate):
    errors = []
    for size in sizes:
        points, cells = make(size)
        state = DiscreteSurface(Elements(cells, len(points)), points)
        assert state.dual_areas.sum() == pytest.approx(state.area, rel=1e-12)
        errors.append(np.abs(np.linalg.norm(state.nodal_curvature, axis=1) - 2).max())
    assert errors[0] > rate * errors[1] > rate**2 * errors[2]
    assert errors[2] < 1e-3


def test_curvature_stays_finite_where_triangles_are_obtuse():
    points, cells = shaken(icosphere(3), 0.05)
    state = DiscreteSurface(Elements(cells, len(points)), points)
    masses = np.asarray(state.mass_matrix.sum(axis=1)).ravel()
    assert (state.dual_areas >= 0.25 * masses).all()
    assert (state.dual_areas < 0.26 * masses).any()
