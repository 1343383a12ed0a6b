"""Remeshing from end to end: shape kept, nothing turned over, the same type out as in."""

import numpy as np
import pytest
from surface_shapes import grid, icosphere, mixed_sphere, none, quad_cube, quad_sphere, scattered_sphere, shaken

import hexconformal as hc
import surface
from hexconformal.common.errors import MeshError, OptionError, ReadError, WriteError
from surface.constraint.features import CORNER, CURVE, find_features
from surface.constraint.input_surface import InputSurface
from surface.mesh.geometry import Cells, enclosed_volume, mean_edge_length
from surface.quality.assessment import smallest_angles
from surface.remeshing.descent import Termination, descend
from surface.remeshing.pull_back import pull_back

STEPS = surface.Stepping(steps=1)


def as_input(shape):
    points, cells = shape[:2]
    return points, cells.triangles, cells.quads


@pytest.mark.parametrize(
    "shape", [shaken(icosphere(3), 0.03), shaken(quad_sphere(8), 0.025), shaken(mixed_sphere(8), 0.03)]
)
def test_a_shaken_sphere_becomes_regular_and_stays_a_sphere(shape):
    result = surface.remesh(as_input(shape))
    report = result.report
    assert report.converged
    assert report.turned == 0
    assert report.after.min_angle > report.before.min_angle
    assert report.after.mean_dilatation < 0.85 * report.before.mean_dilatation
    assert abs(report.volume_change) < 1e-6
    assert abs(report.area_change) < 1e-2
    assert report.hausdorff < 1e-2
    assert all(record.decrease > 0 for record in result.history[1:])
    assert report.energy_after < 0.7 * report.energy_before


def torus(n, m, seed=0):
    """Sheared, with every node at random along the surface by a quarter of an edge."""
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    v = v + 0.5 * np.sin(u) + 0.5 * np.pi / m * rng.uniform(-1, 1, v.shape)
    u = u + 0.5 * np.pi / n * rng.uniform(-1, 1, u.shape)
    points = np.stack([(2 + np.cos(v)) * np.cos(u), (2 + np.cos(v)) * np.sin(u), np.sin(v)], axis=2).reshape(-1, 3)
    i = np.arange(n * m).reshape(n, m)
    j, k, r = np.roll(i, -1, 0), np.roll(i, (-1, -1), (0, 1)), np.roll(i, -1, 1)
    return points, np.concatenate([np.stack(t, axis=2).reshape(-1, 3) for t in ((i, j, k), (i, k, r))])


def test_the_worst_can_be_emphasized_over_the_mean():
    points, cells = shaken(icosphere(3), 0.02)
    shape = points * [1.0, 0.6, 1.8], cells.triangles
    mean, worst = (surface.remesh(shape, emphasis=e, features=None).report.after for e in ("mean", "worst"))
    assert worst.min_angle > mean.min_angle + 3
    assert mean.mean_angle > worst.mean_angle > mean.mean_angle - 1.5


def graded_disc(rings, around, shift):
    """Triangles ever smaller towards the middle, a hundredth of those outside, which is shifted."""
    i, j = np.meshgrid(np.arange(rings + 1), np.arange(around), indexing="ij")
    z = 0.01 ** (i / rings) * np.exp(2j * np.pi * (j + i / 2) / around)
    z = np.append(z, 0)
    z = z + shift * np.maximum(1 - abs(z), 0) ** 2
    i = np.arange((rings + 1) * around).reshape(rings + 1, around)
    j = np.roll(i, -1, 1)
    corners = [(i[:-1], j[:-1], i[1:]), (j[:-1], j[1:], i[1:]), (i[-1:], j[-1:], np.full((1, around), i.size))]
    return np.stack([z.real, z.imag, 0 * z.real], axis=1), np.concatenate(
        [np.stack(c, 2).reshape(-1, 3) for c in corners]
    )


def test_a_cluster_of_small_cells_goes_far_as_a_whole():
    report = surface.remesh(graded_disc(21, 24, 0.2), fixed=range(24)).report
    assert report.converged
    assert report.iterations < 20
    assert report.after.min_angle > report.before.min_angle + 3.5


def tube(n, m, seed=0):
    """An open cylinder of radius 1 and length 2, its nodes at random along it, those of its ends along these."""
    rng = np.random.default_rng(seed)
    angle, z = np.meshgrid(2 * np.pi * np.arange(n) / n, np.linspace(0, 2, m + 1), indexing="ij")
    angle = angle + 0.35 * 2 * np.pi / n * rng.uniform(-1, 1, angle.shape)
    z[:, 1:-1] += 0.35 * 2 / m * rng.uniform(-1, 1, (n, m - 1))
    i = np.arange(n * (m + 1)).reshape(n, m + 1)
    j = np.roll(i, -1, 0)
    quads = np.stack([i[:, :-1], j[:, :-1], j[:, 1:], i[:, 1:]], axis=2).reshape(-1, 4)
    return np.stack([np.cos(angle), np.sin(angle), z], axis=2).reshape(-1, 3), quads


def assert_kept(report):
    assert report.turned == 0
    assert report.volume_change is None or abs(report.volume_change) < 1e-6
    assert abs(report.area_change) < 1e-2
    assert report.hausdorff <= 0.01
    assert report.after.min_angle >= report.before.min_angle - 1e-9
    assert report.after.mean_angle >= report.before.mean_angle - 1e-9


def test_a_noisy_sheared_torus():
    report = surface.remesh(torus(48, 24)).report
    assert report.converged
    assert_kept(report)
    assert report.after.min_angle > 30 > 10 > report.before.min_angle
    assert report.after.mean_angle > report.before.mean_angle + 5


def test_an_irregular_sphere():
    """The convex hull of random points: every valence from 3 on, needles among the triangles."""
    report = surface.remesh(scattered_sphere(500, seed=2)).report
    assert_kept(report)
    assert report.after.min_angle > 3 * report.before.min_angle
    assert report.after.mean_angle > report.before.mean_angle + 5


def test_the_ends_of_an_open_cylinder_slide():
    points, quads = tube(24, 8)
    result = surface.remesh((points, quads))
    assert_kept(result.report)
    end = (points[:, 2] == 0) | (points[:, 2] == 2)
    assert np.abs(result.points[end, 2] - points[end, 2]).max() < 1e-9
    assert np.abs(np.linalg.norm(result.points[end, :2], axis=1) - 1).max() < 0.02
    assert np.linalg.norm(result.points - points, axis=1)[end].max() > 0.02
    assert result.report.after.mean_angle > 85


def test_a_thin_plate_keeps_both_sides():
    points, cells = quad_cube(10)
    rng = np.random.default_rng(5)
    side = np.abs(points[:, 2]) == 1
    inner = side & (np.abs(points[:, :2]) < 1).all(axis=1)
    moved = points * [1, 1, 0.02]
    moved[inner, :2] += 0.06 * rng.uniform(-1, 1, (inner.sum(), 2))
    result = surface.remesh((moved, cells.quads))
    assert_kept(result.report)
    assert (np.abs(result.points[side, 2] - moved[side, 2]) < 1e-9).all()


def test_who_does_not_converge_says_so():
    result = surface.remesh(torus(24, 12), iterations=2)
    assert not result.report.converged
    assert "iterations = 2" in result.report.reason
    assert result.report.iterations == 2


def test_a_cell_that_stands_in_the_way_is_held(monkeypatch):
    points, cells = shaken(icosphere(2), 0.04)
    cells = cells.triangles
    mesh = points, cells
    home = surface.Remeshing(mesh)._start

    def turned_over(shape, x):
        turned = np.zeros(len(cells), dtype=bool)
        turned[7] = np.abs(x[cells[7]] - home[cells[7]]).max() > 0
        return turned

    monkeypatch.setattr(InputSurface, "turned_over", turned_over)
    result = surface.remesh(mesh)
    np.testing.assert_array_equal(result.points[cells[7]], points[cells[7]])
    assert result.report.turned == 0
    assert result.report.after.mean_angle > result.report.before.mean_angle + 5
    assert [record.iteration for record in result.history] == list(range(len(result.history)))
    assert any(note.startswith("nodes held, whose cells would be spoiled: 3 ") for note in result.report.notes)
    assert result.report.iterations > 12
    assert surface.remesh(mesh, iterations=12).report.iterations == 12

    monkeypatch.setattr(InputSurface, "turned_over", lambda shape, x: np.full(len(cells), np.abs(x - home).max() > 0))
    result = surface.remesh(mesh)
    np.testing.assert_array_equal(result.points, points)
    assert "nothing better was found without spoiling a cell" in result.report.reason


def test_coarse_surfaces_stay_within_the_bound_too():
    # While the run goes on, the distance is measured at fewer places than in the end: of some shapes too few.
    notes = []
    for seed in range(4):
        points, cells = shaken(quad_sphere(4), 0.12, seed)
        result = surface.remesh((points * [1.0, 0.5, 2.0], cells.quads), hausdorff=0.01, iterations=25)
        assert result.report.hausdorff <= 0.01
        assert result.report.after.min_angle >= result.report.before.min_angle
        assert abs(result.report.volume_change) < 1e-6
        assert abs(result.report.area_change) <= 0.008
        notes += result.report.notes
    assert any("hausdorff left room" in note for note in notes)


@pytest.mark.parametrize(("hausdorff", "told"), [(1e-4, True), (0.05, False)])
def test_without_projection_the_bound_is_only_compared(hausdorff, told):
    points, cells = shaken(icosphere(2), 0.05)
    report = surface.remesh((points, cells.triangles), project=False, iterations=5, hausdorff=hausdorff).report
    assert 1e-4 < report.hausdorff < 0.05
    assert any("farther than hausdorff" in note for note in report.notes) is told


def test_nodes_are_held_by_the_name_of_a_point_array():
    points, cells = shaken(icosphere(2), 0.05)
    pole = points[:, 2] > 0.5
    mesh = surface.SurfaceMesh(points, cells, {"pole": np.where(pole, 2.0, 0.0), "axes": np.ones((len(points), 3))})
    named, given = (surface.remesh(mesh, fixed=fixed, iterations=3) for fixed in ("pole", pole))
    assert (named.points == given.points).all()
    assert (named.points[pole] == points[pole]).all()
    moment = list(surface.evolve(surface.MeanCurvature(mesh, fixed="pole"), steps=2))[-1]
    assert (moment.points[pole] == points[pole]).all()
    assert (moment.points[~pole] != points[~pole]).any()
    for call in (surface.remesh, lambda mesh, fixed: surface.Evolution(surface.Willmore(mesh, fixed=fixed), STEPS)):
        with pytest.raises(OptionError, match="'wall' names no point array; there are: 'pole', 'axes'"):
            call(mesh, fixed="wall")
        with pytest.raises(OptionError, match="fixed must have one boolean per point"):
            call(mesh, fixed="axes")


@pytest.mark.parametrize("iterations", [1, 100])
def test_the_result_says_whether_it_converged(iterations):
    run = surface.Remeshing(as_input(shaken(icosphere(2), 0.05)), surface.Options(iterations=iterations))
    for _ in run:
        pass
    result = run.result()
    assert result.converged is result.report.converged is run.converged is (iterations == 100)


def test_repeating_changes_nothing():
    shape = shaken(icosphere(3), 0.02)
    first = surface.remesh(as_input(shape))
    again = surface.remesh((first.points, shape[1].triangles))
    assert np.abs(again.points - first.points).max() < 1e-3 * 0.15


def test_result_does_not_depend_on_the_unit_of_length_or_the_place():
    points, cells = shaken(icosphere(2), 0.05)
    here = surface.remesh((points, cells.triangles), iterations=3, tolerance=0)
    there = surface.remesh((1e4 * points + 3e4, cells.triangles), iterations=3, tolerance=0)
    assert np.abs((there.points - 3e4) / 1e4 - here.points).max() < 1e-12


def test_a_cube_keeps_its_corners_and_edges():
    points, cells = quad_cube(6)
    edge = (np.abs(points) == 1).sum(axis=1)
    rng = np.random.default_rng(0)
    moved = points + 0.08 * rng.uniform(-1, 1, points.shape) * (np.abs(points) < 1)
    features = find_features(moved, cells)
    assert ((features.kind == CORNER) == (edge == 3)).all()
    assert ((features.kind == CURVE) == (edge == 2)).all()
    result = surface.remesh((moved, cells.quads))
    assert np.abs(result.points).max(axis=1) == pytest.approx(1, abs=1e-9)
    assert (result.points[edge == 3] == points[edge == 3]).all()
    assert (np.abs(np.abs(result.points[edge >= 2]) - 1) < 1e-9).sum(axis=1).min() == 2
    assert result.report.after.mean_dilatation < 1.02
    assert result.report.hausdorff < 1e-9


def test_an_open_boundary_slides_or_stays():
    points, cells, inner = grid(8, jitter=0.4)
    slid = surface.remesh((points, cells.triangles))
    fixed = surface.remesh((points, cells.triangles), boundary="fixed")
    assert (fixed.points[~inner] == points[~inner]).all()
    side = np.abs(points[:, 0]) < 1e-12
    assert np.abs(slid.points[side, 0]).max() < 1e-9
    assert slid.report.volume_change is None
    assert slid.report.after.mean_dilatation <= fixed.report.after.mean_dilatation + 1e-6


def test_without_projection_the_simpson_normal_keeps_the_volume():
    shape = shaken(icosphere(3), 0.02)
    result = surface.remesh(
        as_input(shape), energy="quaternionic", reference="flat", project=False, normal="simpson", iterations=3
    )
    assert abs(result.report.volume_change) < 1e-6
    assert result.report.after.mean_dilatation < result.report.before.mean_dilatation


def test_a_reference_mesh_keeps_its_conformal_class():
    points, cells = icosphere(2)
    stretched = points * [1, 1, 2]
    moved, _ = shaken((points, cells), 0.03)
    result = surface.remesh((moved * [1, 1, 2], cells.triangles), reference=stretched)
    assert result.report.energy_after < 0.4 * result.report.energy_before


def test_several_pieces_keep_their_own_volume():
    from surface.mesh.geometry import enclosed_volume

    points, cells = shaken(icosphere(2), 0.05)
    two = np.concatenate([points, 0.5 * points[:, [1, 2, 0]] + [3, 0, 0]])
    triangles = np.concatenate([cells.triangles, cells.triangles + len(points)])
    result = surface.remesh((two, triangles))
    for part in (triangles[: len(cells)], triangles[len(cells) :]):
        one = Cells(part, none(4))
        assert enclosed_volume(result.points, one) == pytest.approx(enclosed_volume(two, one), rel=1e-6)


def test_type_in_is_type_out_and_data_is_kept():
    import meshio
    import pyvista as pv

    points, cells = shaken(mixed_sphere(4), 0.03)
    mesh = meshio.Mesh(
        points,
        [("quad", cells.quads), ("vertex", np.array([[0]])), ("triangle", cells.triangles)],
        point_data={"height": points[:, 2].copy()},
        cell_data={"tag": [np.arange(len(cells.quads)), np.array([7]), 100 + np.arange(len(cells.triangles))]},
    )
    before = points.copy()
    out = surface.remesh(mesh, iterations=2).mesh
    assert isinstance(out, meshio.Mesh)
    assert (mesh.points == before).all()
    assert (out.point_data["height"] == before[:, 2]).all()
    assert [part.tolist() for part in out.cell_data["tag"]] == [part.tolist() for part in mesh.cell_data["tag"]]
    assert np.isnan(out.cell_data["min_angle"][1]).all()
    poly = pv.PolyData(points, np.insert(cells.quads, 0, 4, axis=1).ravel())
    assert isinstance(surface.remesh(pv.Sphere(), iterations=1).mesh, pv.PolyData)
    assert poly.n_cells == len(cells.quads)
    array = surface.remesh((points, cells.triangles, cells.quads), iterations=1).mesh
    assert [part.shape for part in array] == [points.shape, cells.triangles.shape, cells.quads.shape]


@pytest.mark.parametrize("extension", [".ply", ".obj", ".stl", ".off", ".vtu", ".vtk", ".vtp", ".msh"])
def test_files_keep_the_surface(extension, tmp_path):
    points, cells = icosphere(1)
    path = tmp_path / f"sphere{extension}"
    surface.write(path, (points, cells.triangles))
    again = surface.read(path)
    assert len(again.points) == len(points)
    assert len(again.cells.triangles) == len(cells)
    order = np.lexsort(again.points.round(4).T), np.lexsort(points.round(4).T)
    assert np.abs(again.points[order[0]] - points[order[1]]).max() < 1e-6


@pytest.mark.parametrize(
    ("points", "cells", "said"),
    [
        (np.full((3, 3), np.nan), [[0, 1, 2]], "NaN"),
        (np.eye(3), [[0, 1, 5]], "outside"),
        (np.eye(3), [[0, 1, 1]], "repeated"),
        (np.eye(3)[[0, 1, 1]], [[0, 1, 2]], "without area"),
        (np.random.default_rng(0).normal(size=(5, 3)), [[0, 1, 2], [1, 0, 3], [0, 1, 4]], "more than two"),
        (np.random.default_rng(0).normal(size=(4, 3)), [[0, 1, 2], [0, 1, 3]], "which side is out"),
        (np.eye(3), [[0, 1]], "array"),
    ],
)
def test_unsound_surfaces_are_refused(points, cells, said):
    with pytest.raises(MeshError, match=said):
        surface.remesh((points, np.array(cells)))


def test_a_moebius_strip_is_refused():
    n = 12
    a = np.arange(n)
    t = 2 * np.pi * a / n
    across = np.stack([np.cos(t / 2) * np.cos(t), np.cos(t / 2) * np.sin(t), np.sin(t / 2)], axis=1)
    circle = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    points = np.concatenate([circle - 0.3 * across, circle + 0.3 * across])
    quads = np.stack([a, a + 1, a + 1 + n, a + n], axis=1)
    quads[-1] = [n - 1, n, 0, 2 * n - 1]
    with pytest.raises(MeshError, match="which side is out"):
        surface.remesh((points, quads))


def test_numbers_are_no_text():
    for make in (
        lambda: hc.Options(hausdorff="0.1"),
        lambda: surface.Options(eps="small"),
        lambda: surface.Stepping(t_end="1"),
    ):
        with pytest.raises(OptionError, match="is a number, not '"):
            make()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"iterations": -1}, "iterations is not negative, not -1"),
        ({"tolerance": 1.0}, r"tolerance must lie in \[0, 1\), not 1\.0"),
        ({"features": 180}, "an angle in .0, 180. degrees, not 180"),
        ({"features": "sharp"}, "an angle, None or an array of edges, not 'sharp'"),
    ],
)
def test_options_out_of_range_are_refused(options, words):
    with pytest.raises(OptionError, match=words):
        surface.Options(**options)


def test_wrong_options_and_files_are_named(tmp_path):
    shape = as_input(icosphere(1))
    with pytest.raises(OptionError, match="unknown option 'colour'"):
        surface.remesh(shape, colour=1)
    with pytest.raises(OptionError, match="eps"):
        surface.remesh(shape, eps=0)
    with pytest.raises(OptionError, match="must be edges of the surface"):
        surface.remesh(shape, features=np.array([[0, 0]]))
    with pytest.raises(ReadError, match="does not exist"):
        surface.remesh(tmp_path / "nothing.ply")
    (tmp_path / "bad.ply").write_text("ply\n")
    with pytest.raises(ReadError):
        surface.remesh(tmp_path / "bad.ply")
    with pytest.raises(WriteError, match="unknown extension"):
        surface.write(tmp_path / "a.xyz", shape)


@pytest.mark.parametrize(
    ("name", "least", "mean"),
    [
        ("dog", 28.3, 55.2),
        ("ellipsoidRef3", 41.6, 56.4),
        ("cube", 89.9, 89.9),
        ("c", 66, 83),
        ("CliffordTorus", 80.9, 84.4),
        ("DTtri", 21.4, 34.2),  # its conformal class allows no more at this shape
        ("DTquad", 50.5, 81),
        ("tri_kitten", 10, 47),
        ("hand", 10, 47),
    ],
)
def test_shared_surfaces(shared, name, least, mean):
    report = surface.remesh(shared / "meshes" / "surface" / f"{name}.ply").report
    assert report.converged
    assert report.turned == 0
    assert abs(report.volume_change) < 1e-6
    assert abs(report.area_change) < 1e-2
    assert report.hausdorff <= 0.01
    assert report.after.min_angle >= least
    assert report.after.mean_angle >= mean


@pytest.mark.parametrize("side", [(0, 1), (1, 0)])
def test_a_cell_over_a_ridge_is_turned_over_if_either_side_says_so(side):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 0.3, -1], [0.5, -0.3, -1]])
    shape = InputSurface(points, Cells(np.array([[0, 1, 2], [1, 0, 3]]), none(4)))
    assert not shape.turned_over(points).any()
    # Upright in the plane of the ridge, so that one of the two facets below is behind it, whichever way it looks.
    moved = np.array([[0.1, 0, 0.2], [0.9, 0, 0.2], [0.5, 0, 1.0], [0.5, -0.3, -1]])
    moved[:2] = moved[list(side)]
    assert shape.turned_over(moved)[0]


def test_who_is_frozen_stays_exactly_and_the_others_keep_the_volume():
    points, cells = icosphere(3)
    problem = surface.Remeshing((points, cells.triangles))._problem
    rng = np.random.default_rng(0)
    frozen = np.arange(len(points)) % 9 == 0
    step = 0.1 * ~frozen[:, None] * rng.normal(size=points.shape)
    x = problem.start + 0.01 * rng.normal(size=points.shape)
    volume = enclosed_volume(problem.start, cells)
    for who in (frozen, np.zeros_like(frozen)):
        moved, base, _ = problem.retract(x, problem.start, step, who)
        np.testing.assert_array_equal(moved[who], x[who])
        np.testing.assert_array_equal(base[frozen], problem.start[frozen])
        assert abs(enclosed_volume(moved, cells) / volume - 1) < 1e-6
    assert np.linalg.norm(moved[frozen] - problem.start[frozen], axis=1).min() > 1e-4


def test_a_rough_surface_ends_where_only_a_few_hopeless_cells_still_gain():
    points, cells = icosphere(2)
    rng, edge = np.random.default_rng(0), mean_edge_length(points, cells)
    rough = points * (1 + 0.25 * edge * rng.normal(size=(len(points), 1)))
    rough = rough + 0.2 * edge * rng.normal(size=points.shape)
    report = surface.remesh((rough, cells.triangles)).report
    assert report.converged
    assert report.iterations < 50
    assert report.after.mean_angle > 44.0


def test_only_nodes_that_are_too_far_away_go_back():
    points, cells = icosphere(3)
    problem = surface.Remeshing((points, cells.triangles))._problem
    bound = 0.02 * np.linalg.norm(np.ptp(problem.start, axis=0))
    out, slid = 0, 400
    gone = problem.start.copy()
    gone[out] *= 1.2
    gone[slid] += 0.2 * np.cross(problem.start[slid] - problem.start.mean(axis=0), [0.0, 0.0, 1.0])
    near, distance = next(pull_back(problem, problem.restore_volume(gone), bound))
    assert problem.input_surface.hausdorff(gone) > bound >= distance > 0.8 * bound
    before, after = (np.linalg.norm(x - problem.start, axis=1) for x in (gone, near))
    assert after[out] < 0.9 * before[out]
    assert after[slid] > 0.98 * before[slid]


def test_a_cell_may_turn_over_by_itself_until_it_is_strict():
    points, cells = icosphere(2)
    shape, nobody = InputSurface(points, cells), np.zeros(len(cells), dtype=bool)
    a, b, c = cells.triangles[0]
    turned = points.copy()
    turned[a] = 1.3 * (points[b] + points[c]) - points[a]
    turned[a] /= np.linalg.norm(turned[a])
    over = shape.turned_over(turned)
    assert over[0]
    assert not shape.cells_out_of_bounds(turned, 1.0, nobody).any()
    shape.forbid_turning = True
    np.testing.assert_array_equal(shape.cells_out_of_bounds(turned, 1.0, nobody), over)
    # What is turned over already may stay so.
    shape.accept()
    assert not shape.cells_out_of_bounds(turned, 1.0, nobody).any()


def test_a_cell_may_never_come_closer_to_another_sheet_than_to_its_own():
    # A thin wall: two parallel sheets that look away from each other.
    top, cells, _ = grid(6, jitter=0.0)
    points = np.concatenate([top, top - [0, 0, 0.1]])
    both = np.concatenate([cells.triangles, cells.triangles[:, ::-1] + len(top)])
    shape, nobody = InputSurface(points, Cells(both, none(4))), np.zeros(len(both), dtype=bool)
    sunk = points.copy()
    sunk[both[40]] -= [0, 0, 0.06]
    assert shape.turned_over(sunk)[40]
    assert not shape.cells_out_of_bounds(sunk, 1.0, nobody).any()
    shape.forbid_sheet_change = True
    assert shape.cells_out_of_bounds(sunk, 1.0, nobody)[40]
    sunk[both[40]] += [0, 0, 0.02]
    assert not shape.cells_out_of_bounds(sunk, 1.0, nobody).any()


def test_what_ends_a_little_too_far_away_goes_back_a_little():
    points, cells = icosphere(2)
    rough = points + 0.1 * np.random.default_rng(1).normal(size=points.shape)
    report = surface.remesh((rough, cells.triangles)).report
    assert any(note.startswith("hausdorff left room for 9") for note in report.notes)
    assert report.hausdorff <= 0.01
    assert report.after.mean_angle > report.before.mean_angle + 4


def test_cells_stray_of_which_a_node_does():
    points, cells, inner = grid(4)
    shape, nobody = InputSurface(points, cells), np.ones(len(cells), dtype=bool)
    peak = int(np.flatnonzero(inner)[4])
    lifted = points + 0.066 * (np.arange(len(points)) == peak)[:, None] * [0, 0, 1]
    # Centres are a third as far away, and the input's node is nearer to the slope of the peak than to its top.
    assert np.array_equal(shape.cells_out_of_bounds(lifted, 0.06, nobody), (cells.triangles == peak).any(axis=1))
    assert not shape.cells_out_of_bounds(lifted, 0.063, nobody).any()


@pytest.mark.parametrize("seed", [200, 211])
def test_a_run_goes_on_while_cells_gain_against_their_own_normals(seed):
    # On a rough surface the energy that is lowered stalls first, since not all normals are taken anew.
    points, triangles = scattered_sphere(300, seed)
    rng = np.random.default_rng(seed)
    problem = surface.Remeshing((points * (1 + 0.02 * rng.standard_normal((300, 1))), triangles))._problem
    termination, tolerance = Termination(), 3e-4
    own = [
        problem.energy.value_at_own_normals(at.points)
        for at in descend(problem, tolerance, termination, np.zeros(300, dtype=bool))
    ]
    assert termination.converged
    falls = -np.diff(np.log(own))
    assert (falls[-5:] < 1.5 * tolerance).all() or falls[-10:].sum() < 10 * tolerance


def test_a_grid_that_is_best_in_its_corners_is_remeshed_all_the_same():
    points, cells, _ = grid(8, jitter=0.0)
    report = surface.remesh((points, cells.triangles)).report
    assert report.before.mean_angle == pytest.approx(45)
    assert report.after.mean_angle > 52
    assert report.after.min_angle > 0.999 * report.before.min_angle


def thin_wall(level, seed=0, noise=0.2):
    """A flattened sphere, with nodes at random along it."""
    points, cells = icosphere(level)
    rng, edge = np.random.default_rng(seed), mean_edge_length(points, cells)
    points = points + noise * edge * rng.normal(size=points.shape)
    return points * [1.0, 1.0, 0.02] / np.linalg.norm(points, axis=1, keepdims=True), cells.triangles


@pytest.mark.parametrize(
    ("wall", "mean"), [((3,), 53), ((2, 2, 0.2), 47), ((2, 2, 0.35), 29), ((3, 2, 0.35), 27), ((3, 1, 0.2), 50)]
)
def test_where_cells_of_a_thin_wall_turn_over_it_begins_again_with_care(wall, mean):
    run = surface.Remeshing(thin_wall(*wall))
    for _ in run:
        pass
    report = run.result().report
    assert max(record.turned for record in run.history) > 0
    assert report.turned == 0
    assert report.after.mean_angle > mean > report.before.mean_angle
    assert report.after.min_angle > (1 - 1e-3) * report.before.min_angle


@pytest.mark.parametrize("everybody", [False, True])
def test_who_waits_stays_until_no_cell_may_turn_over(everybody):
    points, cells = shaken(icosphere(2), 0.03)
    problem = surface.Remeshing((points, cells.triangles))._problem
    waiting = np.full(len(points), everybody)
    waiting[:30] = True
    released = False
    for at in descend(problem, 3e-4, Termination(), waiting):
        moved = np.linalg.norm(at.points - problem.start, axis=1)
        assert moved[waiting].any() == released
        released = problem.input_surface.forbid_turning
    assert released
    assert (moved[waiting] > 0).all()


def test_a_descent_that_begins_again_does_not_take_the_latest_surface_back(monkeypatch):
    # A search that gives up early, so that the first descent ends stuck.
    monkeypatch.setattr(surface.remeshing.descent, "_MAX_TRIES", 4)
    points, cells = shaken(icosphere(2), 0.08)
    run = surface.Remeshing((points, cells.triangles), surface.Options(iterations=10, features=None))
    latest = [smallest_angles(run.last_points, cells).mean() for _ in run]
    means = np.array([record.mean_angle for record in run.history])
    again = int(np.argmin(np.diff(means))) + 1
    assert means[again] < means[again - 1] - 2
    assert min(latest[again:]) >= latest[again - 1]
