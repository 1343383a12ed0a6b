"""Cylinders that are swept of wedges and hexahedra."""

import numpy as np
import pytest
from meshes.mixed import faces_by_nodes, smallest_determinants

from hexconformal import OptionError, as_volume_mesh, check, generate, quality

SHAPES = [
    {},
    {"core": 1, "layers": 1, "axial": 1},
    {"core": 2, "layers": 4, "axial": 3, "grading": 0.001, "core_size": 0.9},
    {"core": 7, "layers": 1, "axial": 2, "core_size": 0.05, "radius": 1e-6, "length": 1e3},
]


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_a_swept_cylinder_fills_a_prism_over_a_regular_polygon(shape):
    full = {"core": 4, "layers": 3, "axial": 8, "radius": 1.0, "length": 2.0} | shape
    points, cells = given = generate.swept_cylinder(**shape)
    mesh = as_volume_mesh(given)
    core, axial, n = full["core"], full["axial"], 6 * full["core"]
    assert len(cells["wedge"]) == 6 * core**2 * axial
    assert len(cells["hexahedron"]) == n * full["layers"] * axial
    assert len(points) == (1 + 3 * core * (core + 1) + n * full["layers"]) * (axial + 1)
    assert quality(mesh).valid.all()
    assert (smallest_determinants(mesh, 3) > 0).all()
    area = n / 2 * full["radius"] ** 2 * np.sin(2 * np.pi / n)
    assert quality(mesh).volume.sum() == pytest.approx(full["length"] * area, rel=1e-12)
    core_area = area * full.get("core_size", 0.6) ** 2
    wedges = quality(mesh).by_type()["wedge"]
    assert wedges.volume.sum() == pytest.approx(full["length"] * core_area, rel=1e-12)
    assert wedges.scaled_jacobian.min() > 0.8
    # Faces fit: two cells at the most, from both sides, and on the surface the mantle and two ends.
    owners = faces_by_nodes(mesh).values()
    assert max(map(len, owners)) == 2
    ends = 6 * core**2 + n * full["layers"]
    assert sum(len(one) == 1 for one in owners) == n * axial + 2 * ends
    assert check(mesh) == ()
    on = np.isclose(np.hypot(points[:, 0], points[:, 1]), full["radius"], rtol=1e-14)
    assert on.sum() == n * (axial + 1)


def test_grading_thins_the_outermost_layer():
    points, _ = generate.swept_cylinder(2, 5, 1, grading=0.1, core_size=0.5)
    ray = np.sort(points[(points[:, 1:] == 0.0).all(axis=1) & (points[:, 0] >= 0.5 - 1e-12), 0])
    np.testing.assert_allclose(np.diff(ray)[1:] / np.diff(ray)[:-1], 0.1 ** (1 / 4))


def test_parameters_that_make_no_sense_are_refused():
    wrong = {"core": 0, "layers": 0, "axial": 0, "radius": -1.0, "length": 0.0, "core_size": 1.0, "grading": -2.0}
    for name, value in wrong.items():
        with pytest.raises(OptionError, match=name):
            generate.swept_cylinder(**{name: value})
