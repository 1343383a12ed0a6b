"""Quadratic hexahedra of linear ones whose boundary follows a surface: a cylinder with rims, a ball, a thin layer."""

import numpy as np
import pytest
import pyvista as pv

import hexconformal as hc
from hexconformal.generate import ball, box, cylinder
from hexconformal.io.pyvista_mesh import grid_from_arrays
from hexconformal.mesh import boundary_quads

each_number = pytest.mark.parametrize("nodes", [20, 27])


def cylinder_of(points, resolution=256):
    radius, height = np.linalg.norm(points[:, :2], axis=1).max(), np.ptp(points[:, 2])
    size = {"radius": radius, "height": height, "resolution": resolution}
    return radius, height, pv.Cylinder(center=(0, 0, height / 2), direction=(0, 0, 1), **size).triangulate()


@each_number
def test_a_cylinder_has_its_volume_and_its_rims(nodes):
    points, cells = cylinder(2, 1, 1)
    radius, height, surface = cylinder_of(points)
    mesh, (before, after), _ = hc.curved((points, cells), surface, nodes)
    np.testing.assert_array_equal(mesh.points[: len(points)], points)
    measured, exact = hc.quality(mesh), np.pi * radius**2 * height
    assert measured.valid.all()
    assert hc.quality((points, cells)).volume.sum() < 0.91 * exact
    assert measured.volume.sum() == pytest.approx(exact, rel=1e-3)
    if nodes == 27:  # what is inside goes along: by the shape functions of what has nodes on edges alone
        (block,) = mesh.blocks
        x = mesh.points[block.cells]
        np.testing.assert_allclose(x[:, 26], (x[:, 8:20].sum(axis=1) - x[:, :8].sum(axis=1)) / 4, atol=1e-12)
    # An eighth of a circle is off its chord by 1 - cos(pi / 8) of the radius.
    assert before == pytest.approx(radius * (1 - np.cos(np.pi / 8)), rel=0.01)
    assert after < 0.01 * before
    outside = np.abs(np.linalg.norm(points[:, :2], axis=1) - radius) < 1e-9
    quads = boundary_quads(cells)[0]
    side = quads[outside[quads].all(axis=1)]
    ends = np.stack([side, np.roll(side, 1, axis=1)], axis=2).reshape(-1, 2)
    middles = {tuple(np.round(points[edge].mean(axis=0), 9)): edge for edge in ends}
    straight = hc.elevated((points, cells), nodes).points
    for node in range(len(points), len(straight)):
        edge = middles.get(tuple(np.round(straight[node], 9)))
        if edge is not None:  # of the side or a rim: on the cylinder, as high as before
            assert np.linalg.norm(mesh.points[node, :2]) == pytest.approx(radius, rel=1e-4)
            assert mesh.points[node, 2] == pytest.approx(straight[node, 2], abs=1e-6)


@each_number
def test_a_ball_without_features(nodes):
    points, cells = ball(2, 2)
    radius = np.linalg.norm(points, axis=1).max()
    surface = pv.Sphere(radius=radius, theta_resolution=160, phi_resolution=160)
    mesh, (before, after), _ = hc.curved((points, cells), surface, nodes)
    assert hc.quality(mesh).valid.all()
    assert after < (0.1 if nodes == 20 else 0.03) * before  # without nodes in the middle of faces these are flatter
    exact = 4 / 3 * np.pi * radius**3
    assert hc.quality(mesh).volume.sum() == pytest.approx(exact, rel=2e-2 if nodes == 20 else 5e-3)
    assert hc.quality((points, cells)).volume.sum() < 0.8 * exact


def test_a_plane_box_stays_as_it_is():
    points, cells = box((2, 2, 2))
    surface = pv.Box(bounds=(0, 1, 0, 1, 0, 1)).triangulate()
    mesh, distances, _ = hc.curved((points, cells), surface, 27)
    np.testing.assert_allclose(mesh.points, hc.elevated((points, cells), 27).points, atol=1e-12)
    assert max(distances) < 1e-12


@pytest.mark.parametrize("size", [0.1, 3e7])
def test_the_rounding_of_a_file_is_no_distance_to_tell_of(size, tmp_path):
    points, cells = box((3, 3, 3))
    pv.Box(bounds=(0, 0.7, 0, 0.7, 0, 0.7)).triangulate().scale(size, inplace=False).save(tmp_path / "box.stl")
    mesh = 0.7 * size * points, cells
    found = hc.curved(mesh, tmp_path / "box.stl")
    assert 0.0 < found.distances[0] < 1e-7 * size
    assert not found.notes
    moved = 0.7 * size * (points + [1e-6, 0.0, 0.0]), cells
    assert "corners are up to" in hc.curved(moved, tmp_path / "box.stl").notes[0]


def rings(radii, around):
    """Nodes of circles around the third axis, at both ends of a tube."""
    angles = np.linspace(0.0, 2 * np.pi, around, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    return np.concatenate([radius * circle + [0.0, 0.0, z] for z in (0.0, 1.0) for radius in radii])


def between(one, other):
    return np.stack([one, other, np.roll(other, -1), np.roll(one, -1)], axis=1)


def tube(thin, around=8):
    """A tube whose inner layer is thin: curved, its hole would reach beyond the straight edges behind it."""
    circles = np.arange(6 * around).reshape(2, 3, around)
    cells = [np.hstack([between(*end[layer : layer + 2]) for end in circles]) for layer in range(2)]
    return rings((1.0, 1.0 + thin, 2.0), around), np.concatenate(cells)


def surface_of_tube(around=256, radii=(1.0, 2.0)):
    (hole, outside), (upper_hole, upper) = np.arange(4 * around).reshape(2, 2, around)
    quads = [between(outside, hole), between(upper_hole, upper), between(hole, upper_hole), between(upper, outside)]
    return pv.PolyData.from_regular_faces(rings(radii, around), np.concatenate(quads)).triangulate()


@each_number
@pytest.mark.parametrize("thin", [0.3, 0.03, 0.003])
def test_thin_layers_go_along(thin, nodes):
    points, cells = tube(thin)
    mesh, (before, after), notes = hc.curved((points, cells), surface_of_tube(), nodes)
    assert notes == ()
    assert after < 0.02 * before
    measured = hc.quality(mesh)
    assert measured.valid.all()
    assert measured.scaled_jacobian.min() > 0.8
    assert measured.minimum_jacobian.min() > 0.1 * hc.quality((points, cells)).minimum_jacobian.min()


@each_number
def test_what_would_be_folded_goes_a_part_of_its_way(nodes):
    # A quarter of a cylinder as one cell, two faces of which lie on it: curved, no angle is left between these.
    x, y = np.array([[0, 0], [1, 0], [np.sqrt(0.5)] * 2, [0, 1]]).T
    points = np.concatenate([np.column_stack([x, y, np.full(4, z)]) for z in (0.0, 1.0)])
    angles = np.linspace(0.0, np.pi / 2, 65)
    rim = np.concatenate([[[0.0, 0.0]], np.column_stack([np.cos(angles), np.sin(angles)])])
    wedges = [[0, k, k + 1, 66, 66 + k, 67 + k] for k in range(1, 65)]
    whole = np.concatenate([np.column_stack([rim, np.full(66, z)]) for z in (0.0, 1.0)])
    surface = grid_from_arrays(hc.as_volume_mesh((whole, {"wedge": wedges})))
    straight = hc.quality((points, [range(8)]))
    mesh, (before, after), notes = hc.curved((points, [range(8)]), surface, nodes)
    assert notes == ("cells that cannot be curved all the way: 1 (ids 0)",)
    assert hc.quality(mesh).valid.all()
    assert hc.quality(mesh).minimum_jacobian.min() > 0.1 * straight.minimum_jacobian.min()
    assert after < before
    assert straight.volume.sum() < hc.quality(mesh).volume.sum() < np.pi / 4


@each_number
def test_walls_that_are_thinner_than_what_is_missing_and_neighbours_stay_apart(nodes):
    # A chord of an eighth is 7.6 % of the radius inside: beyond the other wall, and beyond the wall of what is around.
    circles = np.arange(4 * 8).reshape(2, 2, 8)
    cells = np.hstack([between(*end) for end in circles])
    points, outer = rings((0.98, 1.0), 8), rings((1.01, 1.4), 8)
    both = np.concatenate([points, outer])
    surface = surface_of_tube(radii=(0.98, 1.0)) + surface_of_tube(radii=(1.01, 1.4))
    mesh, (before, after), notes = hc.curved((both, np.concatenate([cells, cells + len(points)])), surface, nodes)
    assert notes == ()
    assert after < 0.1 * before
    (block,) = mesh.blocks
    for some, radii in ((block.cells[:8], (0.98, 1.0)), (block.cells[8:], (1.01, 1.4))):
        found = np.linalg.norm(mesh.points[np.unique(some[:, 8:20]), :2], axis=1)
        on_walls = np.abs(found[:, None] - radii).min(axis=1) < 1e-3
        assert on_walls.sum() == 48
        assert found[on_walls].min() > radii[0] - 1e-3
    assert hc.quality(mesh).valid.all()


def test_where_the_surface_is_too_far_nodes_stay():
    points, cells = box((10, 3, 1), (1.0, 3.0, 0.1))
    straight = hc.elevated((points, cells), 20)
    lid = pv.Box(bounds=(0, 1, 0, 3, 0, 0.18)).triangulate()  # farther than half of the short edges
    mesh, _, notes = hc.curved((points, cells), lid, 20)
    assert "corners are up to 0.08 away" in notes[0]
    x, y, z = straight.points.T
    upper = (z > 0.09) & (y > 0.5) & (y < 2.5)
    short = upper & (np.round(20 * x) % 2 == 1) & (x > 0.1) & (x < 0.9)
    assert "as the surface is too far there: " in notes[1]
    assert int(notes[1].rpartition(" ")[2]) >= short.sum() == 16
    np.testing.assert_array_equal(mesh.points[short], straight.points[short])
    long = upper & (np.round(2 * y) % 2 == 1) & (x > 0.15) & (x < 0.85)
    np.testing.assert_allclose(mesh.points[long, 2], 0.18, atol=1e-12)
    assert hc.quality(mesh).valid.all()


def test_nodes_go_nearly_half_the_length_of_their_edge():
    points, cells = box((10, 3, 1), (1.0, 3.0, 0.1))
    lid = pv.Box(bounds=(0, 1, 0, 3, 0, 0.14)).triangulate()
    mesh, _, notes = hc.curved((points, cells), lid, 20)
    assert not any("too far" in note for note in notes)
    straight = hc.elevated((points, cells), 20).points
    inner = (straight[:, 2] > 0.09) & (np.abs(straight[:, 0] - 0.5) < 0.4) & (np.abs(straight[:, 1] - 1.5) < 1.2)
    short = inner & (np.round(20 * straight[:, 0]) % 2 == 1)
    assert short.sum() > 10
    np.testing.assert_allclose(mesh.points[short, 2], 0.14, atol=1e-12)


def test_without_a_surface_it_is_the_other_function_that_is_meant():
    with pytest.raises(hc.OptionError, match="elevated"):
        hc.curved(box((1, 1, 1)), None)
    with pytest.raises(hc.OptionError, match="20 or 27"):
        hc.curved(box((1, 1, 1)), pv.Box(bounds=(0, 1, 0, 1, 0, 1)), 20.0)
    with pytest.raises(hc.MeshError, match="not that of the mesh"):
        hc.curved(box((1, 1, 1)), pv.Sphere(radius=10.0))


@pytest.mark.parametrize("nodes", [20, 27])
@pytest.mark.parametrize("inner", [0.3, 0.9])
def test_a_quarter_of_a_tube_one_cell_around_is_followed(inner, nodes):
    def tube(around):
        points, cells = hc.generate.box((1, around, 1))
        radius, angle = inner + (1 - inner) * points[:, 0], np.pi / 2 * points[:, 1]
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), points[:, 2]]), cells

    surface = grid_from_arrays(hc.HexMesh(*tube(200)))
    found = hc.curved(tube(1), surface, nodes)
    assert found.notes == ()
    # Beyond its chord a parabola bounds two thirds of the chord times the height.
    height = 1 - np.sqrt(0.5)
    area = 0.5 + 2 / 3 * np.sqrt(2) * height
    assert hc.quality(found.mesh).valid.all()
    assert hc.quality(found.mesh).volume.sum() == pytest.approx((1 - inner**2) * area, rel=1e-4)
    assert found.distances[0] == pytest.approx(height, rel=1e-3)
    assert found.distances[1] < 0.03 * found.distances[0]
