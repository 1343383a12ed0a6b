"""Interfaces between regions are kept by regularization."""

import numpy as np
import pytest
import pyvista as pv
from independent_distance import finely_measured
from meshes.hexahedra import fibre, grains, parts, wavy_layers

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements import cell_volumes
from hexconformal.geometry import SurfaceLocator
from hexconformal.mesh import boundary_quads, find_interfaces


def two_materials(seed=1):
    """A box of two materials that meet in a plane, not where regular cells would; inner nodes jittered."""
    points, cells = generate.box((8, 5, 5))
    x = points[:, 0].copy()
    material = np.where(points[cells].mean(axis=1)[:, 0] < 0.5, 1, 2)
    plane, inside = x == 0.5, ((points > 0) & (points < points.max(axis=0))).all(axis=1)
    shift = 0.05 * np.random.default_rng(seed).uniform(-1, 1, points.shape) * inside[:, None]
    shift[plane, 0] = 0.0
    shift[:, 0] += 0.13 * np.sin(np.pi * x)
    return points + shift, cells, material, plane


def meshed(points, cells, material):
    return hc.HexMesh(points, cells, cell_data={"material": material})


@pytest.mark.parametrize("options", [{}, {"boundary": "fixed"}, {"hausdorff": 0.0}, {"boundary": "free"}])
def test_a_flat_interface_stays_in_its_plane_where_nodes_slide(options):
    points, cells, material, plane = two_materials()
    result = hc.regularize(meshed(points, cells, material), **options)
    assert np.ptp(result.points[plane, 0]) < 1e-15
    assert np.abs(result.points[plane, 0] - points[plane, 0]).max() < 1e-15
    assert np.abs(result.points[plane] - points[plane]).max() > 0.01
    assert any("2 regions (array 'material': 1, 2)" in note for note in result.report.notes)
    assert result.report.after.scaled_jacobian.mean > result.report.before.scaled_jacobian.mean
    # Without a word it would have moved.
    ignored = hc.regularize(meshed(points, cells, material), interfaces="ignore", **options)
    assert np.abs(ignored.points[plane, 0] - points[plane, 0]).max() > 0.01
    assert not any("interfaces" in note for note in ignored.report.notes)


def test_volumes_of_both_sides_of_a_flat_interface_stay():
    points, cells, material, _ = two_materials()
    result = hc.regularize(meshed(points, cells, material))
    before, after = (hc.quality((x, cells)).volume for x in (points, result.points))
    for number in (1, 2):
        assert after[material == number].sum() == pytest.approx(before[material == number].sum(), rel=1e-12)


def distances(mesh, result):
    """Distance in diagonals of the interface of each pair of regions from itself, by many samples on fine triangles."""
    between = find_interfaces(mesh.cells, mesh.cell_data["material"])
    quads, pairs = between.quads, between.owners
    diagonal = np.linalg.norm(np.ptp(mesh.points, axis=0))
    return [finely_measured(result.points, mesh.points, quads[pairs == k], 8) / diagonal for k in np.unique(pairs)]


def volumes(points, mesh):
    return np.bincount(mesh.cell_data["material"], cell_volumes(points, mesh.cells))


@pytest.mark.parametrize("bound", [0.005, 0.001])
def test_a_wavy_interface_slides_within_its_bound(bound):
    mesh = wavy_layers()
    result = hc.regularize(mesh, hausdorff=bound)
    assert 0.2 * bound < distances(mesh, result)[0] <= bound
    assert result.report.hausdorff < 1e-14
    np.testing.assert_allclose(volumes(result.points, mesh), volumes(mesh.points, mesh), rtol=1e-3)
    assert result.report.before.scaled_jacobian.min < 0.1
    assert result.report.after.scaled_jacobian.min > 0.5
    assert result.report.after.invalid == 0
    # Without a word it would go eight bounds away.
    ignored = hc.regularize(mesh, interfaces="ignore")
    assert distances(mesh, ignored)[0] > 0.04


@pytest.mark.parametrize("options", [{"boundary": "fixed"}, {"hausdorff": 0.0}, {"boundary": "free"}])
def test_a_wavy_interface_stays_where_nothing_slides_on_curved_ones(options):
    mesh = wavy_layers(6)
    result = hc.regularize(mesh, **options)
    nodes = np.unique(find_interfaces(mesh.cells, mesh.cell_data["material"]).quads)
    # Where the wave has a line in its faces nodes slide along it.
    np.testing.assert_allclose(result.points[nodes, 2], mesh.points[nodes, 2], atol=1e-12)
    assert result.report.largest_displacement > 0.01


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"constraint": "compatible", "eps": 1e-7},
        {"energy": "quaternionic"},
        {"emphasis": "mean"},
        {"method": "lbfgs"},
        {"conserve_volume": True},
        {"features": "soft"},
    ],
)
def test_a_fibre_stays_round(options):
    mesh, nodes = fibre()
    result = hc.regularize(mesh, hausdorff=0.002, **options)
    bound = 0.002 * np.linalg.norm(np.ptp(mesh.points, axis=0))
    radius = np.hypot(*mesh.points[nodes, :2].T).mean()
    assert np.abs(np.hypot(*result.points[nodes, :2].T) - radius).max() <= bound
    assert distances(mesh, result)[0] <= 0.002
    assert result.report.hausdorff <= 0.002
    assert result.report.after.invalid == 0
    assert result.report.after.scaled_jacobian.mean > result.report.before.scaled_jacobian.mean


def test_grains_keep_their_volumes_and_the_lines_between_them():
    mesh = grains(10)
    result = hc.regularize(mesh)
    assert result.report.before.scaled_jacobian.min < 0.3
    assert result.report.after.scaled_jacobian.min > 0.95
    assert max(distances(mesh, result)) <= 0.005
    np.testing.assert_allclose(volumes(result.points, mesh), volumes(mesh.points, mesh), rtol=0.01)
    # Lines where three grains meet, as those of nodes that belong to three or more.
    grain = [set() for _ in mesh.points]
    for cell, number in zip(mesh.cells, mesh.cell_data["material"], strict=True):
        for node in cell:
            grain[node].add(number)
    triple = np.array([len(numbers) > 2 for numbers in grain])
    shift = np.linalg.norm(result.points - mesh.points, axis=1)
    assert shift[triple].max() <= 0.005 * 3**0.5
    assert shift.max() > 0.02


def test_layers_one_cell_apart_do_not_take_each_others_place():
    points, cells = generate.box((6, 6, 6))
    height = points[:, 2] + 0.06 * np.sin(3 * points[:, 0]) * np.sin(np.pi * points[:, 2])
    layers = np.isclose(points[cells].mean(axis=1)[:, 2], 3.5 / 6).astype(np.int64)
    mesh = parts(np.column_stack([points[:, :2], height]), cells, layers, jitter=0.4)
    result = hc.regularize(mesh, hausdorff=0.02)
    lower, upper = (np.isclose(points[:, 2], z) for z in (3 / 6, 4 / 6))
    between = find_interfaces(cells, layers)
    quads = between.quads
    for level in (lower, upper):
        own = quads[level[quads].all(axis=1)]
        assert len(own) == 36
        assert finely_measured(result.points, mesh.points, own, 8) <= 0.02 * 3**0.5
    assert result.report.after.scaled_jacobian.min > 0.7


def test_an_inclusion_that_touches_the_skin_and_itself_is_kept():
    points, cells = generate.box((6, 6, 6))
    centre = points[cells].mean(axis=1)
    one = (centre < [0.5, 0.5, 0.5]).all(axis=1)
    other = (centre > [0.5, 0.5, 0.5]).all(axis=1)
    # The two blocks touch in one node only.
    mesh = parts(points, cells, (one | other).astype(np.int64), jitter=0.4)
    result = hc.regularize(mesh)
    assert result.report.after.scaled_jacobian.min > 0.9
    between = np.unique(find_interfaces(cells, mesh.cell_data["material"]).quads)
    # Flat faces and straight edges are kept exactly.
    np.testing.assert_allclose(volumes(result.points, mesh), volumes(points, mesh), rtol=1e-12)
    middle = np.flatnonzero((points == 0.5).all(axis=1))
    assert middle in between
    np.testing.assert_array_equal(result.points[middle], points[middle])


def test_the_skin_slides_on_another_surface_and_the_fibre_on_itself():
    mesh, nodes = fibre()
    outside = SurfaceLocator(1.01 * mesh.points * [1, 1, 0] + mesh.points * [0, 0, 1], boundary_quads(mesh.cells)[0])
    faces = np.column_stack([np.full(len(outside.faces), 4), outside.faces]).ravel()
    result = hc.regularize(mesh, surface=pv.PolyData(outside.points, faces), hausdorff=0.01)
    bound = 0.01 * np.linalg.norm(np.ptp(mesh.points, axis=0))
    radius = np.hypot(*mesh.points[nodes, :2].T).mean()
    assert np.abs(np.hypot(*result.points[nodes, :2].T) - radius).max() <= bound
    skin = np.hypot(*mesh.points[:, :2].T) > 0.99 * np.hypot(*mesh.points[:, :2].T).max()
    assert np.hypot(*result.points[skin, :2].T).mean() > 1.005 * np.hypot(*mesh.points[skin, :2].T).mean()


def test_a_tangled_mesh_with_a_wavy_interface_is_unfolded():
    mesh = wavy_layers(8, jitter=0.7)
    result = hc.regularize(mesh)
    assert result.report.before.inverted > 20
    assert result.report.after.invalid == 0
    assert distances(mesh, result)[0] <= 0.005


def test_one_region_is_none():
    points, cells = generate.jittered(*generate.cylinder(4, 3, 4), 0.2, seed=4)
    plain = hc.regularize(hc.HexMesh(points, cells))
    for numbers in (np.ones(len(cells), int), np.arange(len(cells))):
        same = hc.regularize(meshed(points, cells, numbers))
        np.testing.assert_array_equal(same.points, plain.points)


def test_a_tangled_mesh_is_unfolded_with_its_interface_kept():
    points, cells, material, plane = two_materials()
    inner = ((points > 0) & (points < points.max(axis=0))).all(axis=1) & ~plane
    points = points + 0.2 * np.random.default_rng(5).uniform(-1, 1, points.shape) * inner[:, None]
    assert (hc.quality((points, cells)).scaled_jacobian <= 0).sum() > 5
    result = hc.regularize(meshed(points, cells, material))
    assert result.report.after.invalid == 0
    assert np.abs(result.points[plane, 0] - points[plane, 0]).max() < 1e-15


def test_an_interface_with_coincident_nodes_is_no_obstacle():
    points, cells, material, plane = two_materials()
    inside = np.flatnonzero(plane & (np.abs(points[:, 1:] - points[:, 1:].mean(axis=0)).max(axis=1) < 0.35))
    points = points.copy()
    points[inside[0]] = points[inside[1]]
    result = hc.regularize(meshed(points, cells, material))
    assert result.report.before.inverted > 0
    assert result.report.after.invalid == 0
    assert np.abs(result.points[plane, 0] - points[plane, 0]).max() < 1e-15


def test_the_command_line_keeps_those_of_an_array(tmp_path, capsys):
    from hexconformal.app.cli import main

    points, cells, material, plane = two_materials()
    path, better = tmp_path / "part.vtu", tmp_path / "better.vtu"
    hc.write(path, hc.HexMesh(points, cells, cell_data={"layer": material}))
    assert main(["regularize", str(path), str(better), "--interfaces", "layer"]) == 0
    assert "2 regions (array 'layer': 1, 2)" in capsys.readouterr().out
    assert np.abs(hc.read(better).points[plane, 0] - points[plane, 0]).max() < 1e-15


def test_interfaces_that_cannot_be_kept_within_their_bound_are_held(monkeypatch):
    mesh = wavy_layers(6, jitter=0.6)
    monkeypatch.setattr("hexconformal.regularization.stages.sheets_distance", lambda *_: 1.0)
    result = hc.regularize(mesh)
    nodes = np.unique(find_interfaces(mesh.cells, mesh.cell_data["material"]).quads)
    np.testing.assert_array_equal(result.points[nodes], mesh.points[nodes])
    assert any("their nodes are held" in note for note in result.report.notes)
    assert result.report.before.inverted > 0
    assert result.report.after.invalid == 0


@pytest.mark.long
def test_cells_that_cannot_be_unfolded_because_of_an_interface_say_so():
    points, cells = generate.box((6, 6, 6))
    layers = np.isclose(points[cells].mean(axis=1)[:, 2], 3.5 / 6).astype(np.int64)
    # One face of the layer has been pushed through the other.
    points = points.copy()
    points[np.flatnonzero((points == 0.5).all(axis=1)), 2] = 0.8
    told = hc.regularize(meshed(points, cells, layers), hausdorff=0.002).report
    assert told.after.inverted > 0
    assert any("faces inside that are kept: interfaces='ignore' lets these go" in note for note in told.notes)
    assert hc.regularize(meshed(points, cells, layers), interfaces="ignore").report.after.invalid == 0


def test_the_note_of_a_fixed_boundary_counts_the_nodes_of_interfaces_that_can_move():
    points, cells, material, plane = two_materials()
    mesh, inside = meshed(points, cells, material), 16  # of the 36 nodes of the plane
    told = {}
    for name, fixed in (("none", None), ("plane", plane)):
        report = hc.regularize(mesh, boundary="fixed", fixed=fixed, max_iterations=1).report
        (told[name],) = (note for note in report.notes if note.startswith(("16 nodes", "0 nodes")))
    assert told["none"] == f"{inside} nodes of faces inside slide in their planes, 20 stay"
    assert told["plane"] == "0 nodes of faces inside slide in their planes, 36 stay"
