"""Meshes that are put on a surface with its features: edges, corners, faces, tags."""

import numpy as np
import pytest
import pyvista as pv

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements import is_valid
from hexconformal.geometry import SurfaceLocator, distance_between
from hexconformal.mesh import boundary_quads


def jittered(points, amount, seed=0):
    """The points, each moved in any direction, those of the skin too."""
    return points + np.random.default_rng(seed).uniform(-amount, amount, points.shape)


def box_surface(*sizes):
    return pv.Box((0, sizes[0], 0, sizes[1], 0, sizes[2])).triangulate()


def skin_distances(points, cells, segments):
    """Distances of samples of segments (k, 2, 3) from the nearest edge of the skin, one by one."""
    quads, _ = boundary_quads(cells)
    ends = points[np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2)]
    shares = np.linspace(0.0, 1.0, 7)[:, None, None]
    samples = ((1 - shares) * segments[:, 0] + shares * segments[:, 1]).reshape(-1, 3)
    along = ends[:, 1] - ends[:, 0]
    t = np.einsum("sei,ei->se", samples[:, None] - ends[:, 0], along) / (along**2).sum(axis=1)
    feet = ends[:, 0] + np.clip(t, 0.0, 1.0)[..., None] * along
    return np.linalg.norm(samples[:, None] - feet, axis=2).min(axis=1)


def sharp_segments(surface, angle=40.0):
    """The edges of a surface at which it turns by more than an angle, as VTK finds them."""
    edges = surface.clean(tolerance=0.0).extract_feature_edges(
        feature_angle=angle, boundary_edges=False, non_manifold_edges=False, manifold_edges=False
    )
    return np.asarray(edges.points, dtype=float)[edges.lines.reshape(-1, 3)[:, 1:]]


@pytest.mark.parametrize("share", [0.2, 0.35, 0.5])
def test_a_jittered_box_gets_the_faces_edges_and_corners_of_its_stl_exactly(tmp_path, share):
    points, cells = generate.box((5, 4, 6), (1.0, 0.8, 1.2))
    path = tmp_path / "box.stl"
    box_surface(1.0, 0.8, 1.2).save(path)
    result = hc.regularize((jittered(points, 0.2 * share), cells), surface=path)
    assert result.report.after.invalid == 0
    assert result.report.after.scaled_jacobian.min > 0.999
    # As single precision in the file has them; which node is which is known: the box was regular.
    sizes = np.array([1.0, np.float32(0.8), np.float32(1.2)], dtype=float)
    for axis, size in enumerate(sizes):
        for end in (0.0, 1.0):
            on = points[:, axis] == end * points[:, axis].max()
            assert np.abs(result.points[on, axis] - end * size).max() < 1e-9
    assert any("matched are 12 of 12 curves and 8 of 8 corners" in note for note in result.report.notes)


def test_caps_of_a_cylinder_are_flat_and_its_circles_sharp():
    points, cells = generate.cylinder(6, 4, 8)
    radius, height = np.linalg.norm(points[:, :2], axis=1).max(), np.ptp(points[:, 2])
    surface = pv.Cylinder(
        center=points.mean(axis=0), direction=(0, 0, 1), radius=radius, height=height, resolution=120
    ).triangulate()
    result = hc.regularize((jittered(points, 0.05), cells), surface=surface, hausdorff=0.005)
    for end in (points[:, 2].min(), points[:, 2].max()):
        on = points[:, 2] == end
        assert np.abs(result.points[on, 2] - end).max() < 1e-7  # the points of the surface are of single precision
        rim = on & (np.linalg.norm(points[:, :2], axis=1) > radius - 1e-9)
        away = np.linalg.norm(result.points[rim][:, :2], axis=1) - radius
        assert np.abs(away).max() < 0.001 * result.report.diagonal
    assert result.report.hausdorff < 0.005
    assert result.report.after.scaled_jacobian.min > 0.8


def l_shape():
    """An L of cubes, and its surface."""
    points, cells = generate.box((8, 8, 4), (2.0, 2.0, 1.0))
    cells = cells[~(points[cells].mean(axis=1)[:, :2] > 1.0).all(axis=1)]
    used, cells = np.unique(cells, return_inverse=True)
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], dtype=float)
    faces = [np.arange(6)[::-1], np.arange(6, 12)]
    faces += [np.array([i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6]) for i in range(6)]
    corners = np.vstack([np.column_stack([outline, np.full(6, z)]) for z in (0.0, 1.0)])
    # Strips keep the concave hexagons whole where VTK cuts them into triangles.
    surface = pv.PolyData(corners, np.concatenate([[len(f), *f] for f in faces])).triangulate()
    return points[used], cells.reshape(-1, 8), surface


def test_the_notch_of_an_l_is_sharp():
    points, cells, surface = l_shape()
    result = hc.regularize((jittered(points, 0.08), cells), surface=surface)
    assert result.report.after.invalid == 0
    notch = (np.abs(points[:, :2] - 1.0) < 1e-12).all(axis=1)
    assert notch.sum() == 5
    assert np.abs(result.points[notch, :2] - 1.0).max() < 1e-9
    assert skin_distances(result.points, cells, sharp_segments(surface)).max() < 1e-9
    assert result.report.hausdorff < 1e-9


def test_a_tangled_skin_and_inside_are_put_right():
    points, cells, surface = l_shape()
    tangled = jittered(points, 0.2, seed=3)
    result = hc.regularize((tangled, cells), surface=surface)
    assert result.report.before.inverted > 50
    assert result.report.after.invalid == 0
    assert skin_distances(result.points, cells, sharp_segments(surface)).max() < 1e-9


def test_valid_cells_stay_valid_in_every_record():
    points, cells, surface = l_shape()
    run = hc.Regularization((jittered(points, 0.09, seed=1), cells), hc.Options(surface=surface))
    first = next(iter(run))
    assert 0 < first.inverted < 0.2 * len(cells)
    valid = is_valid(run.mesh.points, cells)
    for _ in run:
        assert is_valid(run.points, cells)[valid].all()


def faces_of_a_box(centres, split):
    """Numbers of the sides of a unit box that places are on; the top is cut in two."""
    sides = [centres[:, 2] < 1e-6, centres[:, 0] < 1e-6, centres[:, 0] > 1 - 1e-6, centres[:, 1] < 1e-6]
    sides += [centres[:, 1] > 1 - 1e-6, centres[:, 0] < split]
    return np.select(sides, [1, 3, 4, 5, 6, 7], 2)


def test_tags_on_both_sides_tell_which_line_is_which(tmp_path):
    # The line across the top is at .5 in the mesh and at .2 on the surface: by place it would be another row.
    points, cells = generate.box((6, 6, 6))
    quads, _ = boundary_quads(cells)
    flat = [np.insert(cells, 0, 8, axis=1).ravel(), np.insert(quads, 0, 4, axis=1).ravel()]
    types = np.repeat([pv.CellType.HEXAHEDRON, pv.CellType.QUAD], [len(cells), len(quads)])
    grid = pv.UnstructuredGrid(np.concatenate(flat), types, jittered(points, 0.04))
    tags = faces_of_a_box(points[quads].mean(axis=1), 0.5)
    grid.cell_data["tag"] = np.concatenate([np.zeros(len(cells), dtype=int), tags])
    there, coarse = generate.box((2, 1, 1))
    there[np.abs(there[:, 0] - 0.5) < 1e-9, 0] = 0.2
    sides, _ = boundary_quads(coarse)
    surface = pv.PolyData.from_regular_faces(there, sides)
    line = (np.abs(points[:, 0] - 0.5) < 1e-9) & (points[:, 2] > 1 - 1e-9)

    surface.cell_data["tag"] = faces_of_a_box(there[sides].mean(axis=1), 0.2)
    surface.save(tmp_path / "tags.vtp")
    for given in (surface, tmp_path / "tags.vtp"):
        by_tags = hc.regularize(grid, surface=given)
        assert np.abs(by_tags.points[line] - [0.2, 0.5, 1.0])[:, [0, 2]].max() < 1e-9
        assert by_tags.report.after.invalid == 0
        assert any("by tags and angle" in note for note in by_tags.report.notes)


def test_lines_that_come_with_a_surface_are_curves_of_it(tmp_path):
    points, cells = generate.box((6, 6, 6))
    there, coarse = generate.box((2, 1, 1))
    there[np.abs(there[:, 0] - 0.5) < 1e-9, 0] = 0.45
    sides, _ = boundary_quads(coarse)
    ends = np.flatnonzero((np.abs(there[:, 0] - 0.45) < 1e-9) & (there[:, 2] > 0.5))
    surface = pv.PolyData(there, faces=np.insert(sides, 0, 4, axis=1).ravel(), lines=[2, *ends])
    surface.save(tmp_path / "lines.vtp")
    for given in (surface, tmp_path / "lines.vtp"):
        result = hc.regularize((jittered(points, 0.03), cells), surface=given)
        line = (np.abs(points[:, 0] - 0.5) < 1e-9) & (points[:, 2] > 1 - 1e-9)
        assert np.abs(result.points[line, 0] - 0.45).max() < 1e-9
        assert any("by lines and angle" in note for note in result.report.notes)


def test_a_surface_may_have_its_inside_out_or_faces_turned_over():
    points, cells = generate.box((5, 5, 5))
    surface = box_surface(1, 1, 1)
    faces = surface.faces.reshape(-1, 4)[:, 1:]
    some = np.where(np.arange(len(faces))[:, None] % 3 == 0, faces[:, ::-1], faces)
    for given in (faces[:, ::-1], some):
        there = pv.PolyData.from_regular_faces(np.asarray(surface.points, float), given)
        report = hc.regularize((jittered(points, 0.06), cells), surface=there).report
        assert any("matched are 12 of 12 curves and 8 of 8 corners" in note for note in report.notes)
        assert report.hausdorff < 1e-9


def test_a_hole_that_is_a_defect_of_the_surface_is_no_curve():
    points, cells = generate.box((8, 8, 8))
    whole = box_surface(1, 1, 1).subdivide(3)
    kept = np.ones(whole.n_cells, dtype=bool)
    kept[[20, 300]] = False
    surface = pv.PolyData.from_regular_faces(whole.points, whole.faces.reshape(-1, 4)[kept, 1:])
    result = hc.regularize((jittered(points, 0.025), cells), surface=surface)
    assert result.report.after.scaled_jacobian.min > 0.5
    assert skin_distances(result.points, cells, sharp_segments(box_surface(1, 1, 1))).max() < 1e-9


def test_a_smooth_surface_has_no_features_to_match():
    points, cells = generate.ball(4, 2)
    surface = pv.Sphere(radius=1.0, theta_resolution=60, phi_resolution=60)
    report = hc.regularize((points, cells), surface=surface).report
    assert report.after.invalid == 0
    assert any("features of the surface" in note and "smooth" in note for note in report.notes)


def test_soft_features_are_not_matched():
    points, cells = generate.box((5, 5, 5))
    report = hc.regularize((jittered(points, 0.04), cells), surface=box_surface(1, 1, 1), features="soft").report
    assert not any("matched" in note for note in report.notes)


def test_a_surface_connected_otherwise_is_told_and_costs_no_cell():
    # A square tube around a hole that the box has not.
    points, cells = generate.box((6, 6, 6))
    tube, around = generate.box((3, 3, 1))
    tube[:, :2] = np.where(np.abs(tube[:, :2] - 0.5) < 0.3, 0.5 + 0.6 * (tube[:, :2] - 0.5), tube[:, :2])
    centre = (np.abs(tube[around].mean(axis=1)[:, :2] - 0.5) < 0.05).all(axis=1)
    sides, _ = boundary_quads(around[~centre])
    surface = pv.PolyData.from_regular_faces(tube, sides)
    report = hc.regularize((jittered(points, 0.02), cells), surface=surface, max_iterations=30).report
    assert report.after.invalid == 0
    assert any("cells stay folded" in note or "matched are" in note for note in report.notes)
    assert any("not followed within the bound" in note for note in report.notes)


def test_fixed_nodes_stay_where_they_are():
    points, cells = generate.box((5, 5, 5))
    start = jittered(points, 0.02)
    node = int(np.argmin(np.abs(points - [0.0, 0.4, 0.4]).sum(axis=1)))
    result = hc.regularize((start, cells), surface=box_surface(1, 1, 1), fixed=[node])
    assert (result.points[node] == start[node]).all()
    assert result.report.after.invalid == 0


@pytest.mark.long
def test_a_scrambled_part_comes_out_valid_on_its_surface_with_its_edges(shared):
    folder = shared / "meshes/hex2"
    mesh = hc.read(folder / "hexopt_CAD4_perturbed_input.vtu")
    surface = pv.read(folder / "hexopt_CAD4_perturbed_surface.obj").triangulate()
    result = hc.regularize(mesh, surface=folder / "hexopt_CAD4_perturbed_surface.obj")
    assert result.report.after.invalid == 0
    assert result.report.after.scaled_jacobian.min >= 0.45
    quads, _ = boundary_quads(mesh.cells)
    there = SurfaceLocator(np.asarray(surface.points, float), surface.faces.reshape(-1, 4)[:, 1:])
    diagonal = np.linalg.norm(np.ptp(mesh.points, axis=0))
    assert distance_between(SurfaceLocator(result.points, quads), there) <= 0.005 * diagonal
    away = skin_distances(result.points, mesh.cells, sharp_segments(surface)[::3]) / diagonal
    assert away.max() < 0.005
    assert np.quantile(away, 0.9) < 0.001
