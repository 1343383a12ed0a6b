"""Generated meshes are manifolds of the promised shape with valid cells."""

import numpy as np
import pytest

from hexconformal import generate
from hexconformal.common.errors import OptionError
from hexconformal.elements import all_valid
from hexconformal.mesh.topology import boundary_quads, face_table
from hexconformal.quality.assessment import quality

MESHES = {
    "box": lambda: generate.box((3, 4, 5), (1, 2, 3), (-1, 0, 5)),
    "sheared_cube": generate.sheared_cube,
    "sheared_block": generate.sheared_block,
    "twisted_cube": generate.twisted_cube,
    "bent_bar": generate.bent_bar,
    "boundary_layer": generate.boundary_layer,
    "cylinder": generate.cylinder,
    "ball": generate.ball,
    "jittered": lambda: generate.jittered(*generate.ball(4, 3), amount=0.8),
}


@pytest.mark.parametrize("name", MESHES)
def test_every_mesh_is_valid_and_hangs_together(name):
    points, cells = MESHES[name]()
    assert points.dtype == np.float64
    assert cells.dtype == np.int64
    assert all_valid(points, cells)
    np.testing.assert_array_equal(np.unique(cells), np.arange(len(points)))
    assert len(np.unique(points.round(12), axis=0)) == len(points)
    table = face_table(cells)
    assert table.counts.max() == 2
    assert (table.orientation[table.counts == 2] == 1).all()
    # A ball: Euler characteristic of its closed surface.
    quads, _ = boundary_quads(cells)
    assert len(np.unique(quads)) - len(quads) == 2


def test_box_has_the_size_asked_for():
    points, cells = generate.box((3, 4, 5), (1, 2, 3), (-1, 0, 5))
    assert (len(points), len(cells)) == (120, 60)
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [[-1, 0, 5], [0, 2, 8]])
    np.testing.assert_allclose(quality((points, cells)).volume, 0.1)


@pytest.mark.parametrize("n", [1, 2, 3, 7, 8, 15])
@pytest.mark.parametrize("shear", [0.0, 0.5, 0.8, 0.99])
def test_sheared_cube_is_a_cube_outside(n, shear):
    straight, _ = generate.box((n, n, n))
    points, cells = generate.sheared_cube(n, shear)
    assert all_valid(points, cells)
    # Nodes of faces, edges and corners stay on theirs, exactly.
    sides = (straight == 0) | (straight == 1)
    np.testing.assert_array_equal(points[sides], straight[sides])
    assert points.min() == 0
    assert points.max() == 1


def test_sheared_cube_is_heavily_skewed_inside_and_on_its_faces():
    points, cells = generate.sheared_cube()
    q = quality((points, cells))
    assert 0.05 < q.scaled_jacobian.min() < 0.25
    assert q.scaled_jacobian.mean() < 0.65
    quads, owners = boundary_quads(cells)
    x = points[quads]
    ahead, back = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    cosine = (ahead * back).sum(-1) / np.linalg.norm(ahead, axis=-1) / np.linalg.norm(back, axis=-1)
    angle = np.degrees(np.arccos(cosine)).min(axis=1)
    assert angle.min() < 30
    assert np.median(angle) < 60
    inside = np.setdiff1d(np.arange(len(cells)), owners)
    assert q.scaled_jacobian[inside].mean() < 0.7


@pytest.mark.parametrize("aspect", [0.5, 2.0, 1e4])
def test_boundary_layer_has_the_aspect_asked_for(aspect):
    points, cells = generate.boundary_layer((8, 8, 16), aspect)
    heights = np.diff(np.unique(points[:, 2]))
    assert 1 / 8 / heights[0] == pytest.approx(aspect)
    np.testing.assert_allclose(heights[1:] / heights[:-1], heights[1] / heights[0], rtol=1e-6)
    assert all_valid(points, cells)
    assert points[:, 2].max() == 1


def test_shears_twists_and_bends_keep_the_volume_or_not():
    for mesh in (generate.sheared_block(4), generate.bent_bar((40, 4, 4), degrees=90, length=1.0)):
        assert quality(mesh).volume.sum() == pytest.approx(1, rel=2e-3)
    points, _ = generate.twisted_cube(4, degrees=60)
    bottom, top = points[:25, :2], points[-25:, :2]
    c, s = np.cos(np.pi / 3), np.sin(np.pi / 3)
    np.testing.assert_allclose(bottom @ np.array([[c, s], [-s, c]]), top, atol=1e-15)
    straight, _ = generate.bent_bar((4, 2, 2), degrees=0)
    assert np.ptp(straight[:, 0]) == 4


@pytest.mark.parametrize(
    "call",
    [
        lambda: generate.box((0, 1, 1)),
        lambda: generate.box((1, 1, 1), lengths=(1, -1, 1)),
        lambda: generate.sheared_cube(4, shear=1.0),
        lambda: generate.bent_bar(degrees=720),
        lambda: generate.boundary_layer(aspect=0),
        lambda: generate.cylinder(core_size=1.2),
        lambda: generate.ball(layers=0),
        lambda: generate.ball(grading=-1),
    ],
)
def test_impossible_requests_are_refused(call):
    with pytest.raises(OptionError):
        call()
