"""Area vectors at nodes, and the volume that they are the gradient of: exact formulas."""

from functools import partial

import numpy as np
import pytest
from meshes.hexahedra import jittered_ball

import hexconformal as hc
from hexconformal.geometry import Faces
from hexconformal.geometry.area_vectors import enclosed_volume, nodal_area_vectors, simpson_mean
from hexconformal.mesh.topology import boundary_quads


def test_the_surface_encloses_the_volume_of_the_cells_inside_tangled_or_not():
    points, cells = jittered_ball(0.9, valid=False)
    assert (hc.quality((points, cells)).scaled_jacobian < 0).sum() > 10
    assert enclosed_volume(points, boundary_quads(cells)[0]) == pytest.approx(
        hc.quality((points, cells)).volume.sum(), rel=1e-13
    )


def test_no_digits_are_lost_far_away():
    points, cells = jittered_ball()
    quads = boundary_quads(cells)[0]
    there = points + 2.0**20
    assert enclosed_volume(there, quads) == pytest.approx(enclosed_volume(there - 2.0**20, quads), rel=1e-14)


def test_along_a_straight_way_the_simpson_mean_gives_the_change_of_volume_exactly():
    points, cells = jittered_ball()
    quads = boundary_quads(cells)[0]
    area_vectors = partial(nodal_area_vectors, faces=quads)
    way = 0.2 * np.random.default_rng(0).normal(size=points.shape)
    change = enclosed_volume(points + way, quads) - enclosed_volume(points, quads)
    simpson = np.einsum("ij,ij->", simpson_mean(area_vectors, points, points + way), way)
    assert abs(change) > 1e-2
    assert simpson == pytest.approx(change, rel=1e-12)
    # The half-way normal is exact to third order, the old one to second.
    orders = []
    for normals in (lambda v: area_vectors(points + 0.5 * v), lambda v: area_vectors(points)):
        errors = [
            np.einsum("ij,ij->", normals(v) - simpson_mean(area_vectors, points, points + v), v) for v in (way, way / 2)
        ]
        orders.append(np.log2(errors[0] / errors[1]))
    assert orders == pytest.approx([3.0, 2.0], abs=0.3)


def test_area_vectors_of_an_open_surface_are_integrals_over_its_own_faces():
    # One warped quad and a triangle beside it, by Gauss points: normal times shape function.
    points = np.array([[0.0, 0, 0], [2, 0, 1], [2, 1, 0], [0, 1, 1], [3, 1, 0]])
    quad, triangle = [0, 1, 2, 3], [1, 4, 2]
    expected = np.zeros((5, 3))
    expected[triangle] += np.cross(points[4] - points[1], points[2] - points[1]) / 6
    for u, v in (0.5 + 12**-0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])).tolist():
        shapes = np.array([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v])
        along_u, along_v = np.array([v - 1, 1 - v, v, -v]), np.array([u - 1, -u, u, 1 - u])
        normal = np.cross(along_u @ points[quad], along_v @ points[quad])
        expected[quad] += 0.25 * shapes[:, None] * normal
    found = nodal_area_vectors(points + [100.0, 0, 0], Faces(np.array([triangle]), np.array([quad])))
    np.testing.assert_allclose(found, expected, atol=1e-13)
