"""Quadratic hexahedra whose curved boundary slides: on the surface that there was, with what is kept of it."""

import numpy as np
import pytest

import hexconformal as hc
from hexconformal.formulation import Iteration
from hexconformal.generate import cylinder
from hexconformal.geometry import SurfaceLocator, hausdorff
from hexconformal.mesh import boundary_quads
from hexconformal.regularization.quadratic import QuadraticRegularization, unfolding
from hexconformal.regularization.quadratic import run as quadratic_run
from hexconformal.regularization.quadratic.curved_boundary import CurvedBoundary
from hexconformal.regularization.quadratic.cut_mesh import CutMesh
from hexconformal.regularization.quadratic.schedule import QuadraticSchedule
from hexconformal.regularization.quadratic.setting import QuadraticSetting

each_number = pytest.mark.parametrize("nodes", [20, 27])


def shaken_cylinder(nodes, amount=0.06, seed=0):
    """A cylinder of quadratic cells, whose side nodes lie on the cylinder, moved along it; those inside are moved too.

    Returns the mesh, (n,) nodes on the side, (n,) those at top and bottom, and the radius.
    """
    points, cells = cylinder(3, 1, 2)
    mesh = hc.elevated((points, cells), nodes)
    radius = np.linalg.norm(points[:, :2], axis=1).max()
    outside = np.abs(np.linalg.norm(points[:, :2], axis=1) - radius) < 1e-9
    quads = boundary_quads(cells)[0]
    on = np.unique(CutMesh(mesh, 2).faces(quads[outside[quads].all(axis=1)]).nodes)
    side = np.zeros(len(mesh.points), dtype=bool)
    side[on[on < len(side)]] = True
    x = mesh.points.copy()
    x[side, :2] *= (radius / np.linalg.norm(x[side, :2], axis=1))[:, None]
    ends = (x[:, 2] < 1e-9) | (x[:, 2] > x[:, 2].max() - 1e-9)
    rng, h = np.random.default_rng(seed), amount
    inside = ~side & ~ends
    x[inside] += rng.uniform(-h, h, (inside.sum(), 3))
    angles = np.arctan2(x[side, 1], x[side, 0]) + rng.uniform(-h, h, side.sum()) / radius
    x[side, :2] = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    free = side & ~ends
    x[free, 2] += rng.uniform(-h, h, free.sum())
    return mesh.replaced(x), side, ends, radius


def distance_from(mesh, places):
    """(k,) from a surface that is cut into so small parts that what is left is rounding, nearly."""
    cut = CutMesh(mesh, 32)
    quads = cut.faces(boundary_quads(mesh.table)[0]).nodes
    nodes = np.unique(quads)
    points = np.zeros((cut.count, 3))
    points[nodes] = cut.matrix(nodes) @ mesh.points
    return SurfaceLocator(points, quads).closest(places).distances


@pytest.mark.long
@each_number
def test_nodes_slide_on_the_curved_surface(nodes):
    mesh, side, ends, radius = shaken_cylinder(nodes)
    result = hc.regularize(mesh)
    report = result.report
    assert report.before.invalid >= 5
    assert report.after.invalid == 0
    # With the side fixed, as evenly as it can be, cells at the rim of the core have .8145.
    assert report.after.scaled_jacobian.min > 0.8
    assert report.after.scaled_jacobian.mean > 0.85
    assert result.converged
    moved = np.linalg.norm(result.points - mesh.points, axis=1)
    assert moved[side].max() > 0.03
    # Linear parts are off by the square of their size: of 30 degrees a fourth would be 2e-3, a 32nd 3e-5.
    assert distance_from(mesh, result.points[side]).max() < 2e-4
    height = mesh.points[:, 2].max()
    np.testing.assert_allclose(result.points[ends, 2] % height, mesh.points[ends, 2] % height, atol=1e-12)
    rims = side & ends
    np.testing.assert_allclose(np.linalg.norm(result.points[rims, :2], axis=1), radius, rtol=3e-3)
    assert 0.0 < report.mean_distance < report.hausdorff <= 0.005
    assert abs(report.volume_change) < 1e-3
    assert report.boundary_moved > 50
    kept, found = report.sharp_edges
    assert found == pytest.approx(kept, rel=1e-3)


@pytest.mark.long
def test_what_does_not_move_is_the_same_to_the_last_bit():
    mesh, side, _, _ = shaken_cylinder(20)
    held = side & (mesh.points[:, 0] > 0)
    result = hc.regularize(mesh, fixed=held)
    np.testing.assert_array_equal(result.points[held], mesh.points[held])
    assert result.report.after.invalid == 0
    assert (result.points[side & ~held] != mesh.points[side & ~held]).any()


@pytest.mark.long
def test_components_that_are_held_stay_though_the_surface_bends():
    mesh, side, _, _ = shaken_cylinder(20)
    held = np.zeros((len(mesh.points), 3), dtype=bool)
    held[side & (mesh.points[:, 0] > 0), 2] = True
    result = hc.regularize(mesh, fixed=held)
    np.testing.assert_array_equal(result.points[held[:, 2], 2], mesh.points[held[:, 2], 2])
    assert (result.points[held[:, 2], 0] != mesh.points[held[:, 2], 0]).any()


@pytest.mark.long
@pytest.mark.parametrize("bound", [0.0, 2e-3])
def test_the_bound_holds_between_nodes_too(bound):
    mesh, _, _, _ = shaken_cylinder(20, 0.05)
    result = hc.regularize(mesh, hausdorff=bound)
    assert result.report.hausdorff <= bound
    cut, moved = CutMesh(mesh, 8), CutMesh(result.mesh, 8)
    quads = cut.faces(boundary_quads(mesh.table)[0]).nodes
    diagonal = np.linalg.norm(np.ptp(mesh.points, axis=0))
    assert hausdorff(moved.places(result.points), cut.places(mesh.points), quads) <= bound * diagonal + 1e-4


@pytest.mark.long
def test_more_room_gives_more():
    mesh, _, _, _ = shaken_cylinder(20, 0.05)
    worst = [
        hc.regularize(mesh, **options).report.after.scaled_jacobian.min
        for options in ({"boundary": "fixed"}, {"hausdorff": 0.0}, {"hausdorff": 0.005})
    ]
    assert worst[0] - 1e-3 <= worst[1] <= worst[2]
    assert worst[2] > worst[0] + 0.01


@pytest.mark.long
def test_an_interface_inside_slides_on_itself():
    points, cells = cylinder(3, 1, 2)
    radii = np.linalg.norm(points[cells].mean(axis=1)[:, :2], axis=1)
    mesh = hc.elevated((points, cells), 27)
    core = (radii < radii.mean()).astype(np.int64)
    result = hc.regularize(mesh.replaced(shaken_inside(mesh)), interfaces=core)
    assert result.report.after.invalid == 0
    (row,) = result.report.interfaces
    assert row.quads >= 8
    assert row.moved > 10
    assert row.distance <= 0.005


def test_interfaces_are_as_far_off_as_their_curved_faces():
    # Two cells on each other; nodes of the face between them move along it: at the nodes nothing is off.
    x = np.linspace(-1.0, 1.0, 3)
    linear = np.array([[a, b, c] for c in x for b in (-1.0, 1.0) for a in (-1.0, 1.0)])
    table = np.array([[0, 1, 3, 2, 4, 5, 7, 6], [4, 5, 7, 6, 8, 9, 11, 10]])
    flat = hc.elevated((linear, table), 27)
    mesh = flat.replaced(flat.points + 0.3 * np.outer(1.0 - flat.points[:, 0] ** 2, [0.0, 0.0, 1.0]))
    there = (np.abs(flat.points[:, 2]) < 1e-9) & (np.abs(flat.points[:, 0]) < 1e-9) & (np.abs(flat.points[:, 1]) < 0.9)
    moved, shift = mesh.points.copy(), 0.3
    moved[there] += [shift, 0.0, -0.3 * shift**2]
    options = hc.Options(interfaces=np.array([0, 1]), hausdorff=0.05)
    boundary = CurvedBoundary.of(mesh, options, QuadraticSchedule())
    cut = CutMesh(mesh, 32)
    nodes, quads = np.unique(cut.faces(boundary.sheets).nodes, return_inverse=True)
    fine = [cut.matrix(nodes) @ points for points in (moved, mesh.points)]
    apart = hausdorff(*fine, quads.reshape(-1, 4)) / boundary.diagonal
    assert apart > 0.01
    assert boundary.distance(moved) == pytest.approx(apart, rel=0.1)


@pytest.mark.long
def test_a_share_of_the_way_is_on_the_surface_too(monkeypatch):
    mesh, side, _, _ = shaken_cylinder(20)
    monkeypatch.setattr(quadratic_run, "_SHARES", (0.5,))
    result = hc.regularize(mesh)
    assert np.linalg.norm(result.points - mesh.points, axis=1)[side].max() > 0.04
    # Half-way along straight lines they would be 1.2e-3 off.
    assert distance_from(mesh, result.points[side]).max() < 2e-4


def shaken_inside(mesh):
    """The points with those that are on no outer face moved."""
    cut = CutMesh(mesh, 2)
    on = np.unique(cut.faces(boundary_quads(mesh.table)[0]).nodes)
    inside = np.ones(len(mesh.points), dtype=bool)
    inside[on[on < len(inside)]] = False
    moves = np.random.default_rng(0).uniform(-0.02, 0.02, mesh.points.shape)
    return mesh.points + inside[:, None] * moves


@pytest.mark.long
def test_nodes_that_are_coupled_move_together():
    mesh, side, ends, _ = shaken_cylinder(20, 0.05)
    top = np.flatnonzero(ends & (mesh.points[:, 2] > 0.1) & ~side)
    bottom = np.array([
        np.flatnonzero(ends & (np.abs(mesh.points - [*mesh.points[k, :2], 0.0]).max(axis=1) < 1e-9))[0] for k in top
    ])  # fmt: skip
    result = hc.regularize(mesh, couplings=np.column_stack([top, bottom]))
    shift = result.points - mesh.points
    np.testing.assert_allclose(shift[top, :2], shift[bottom, :2], atol=1e-14)
    assert result.report.after.invalid == 0


@pytest.mark.long
def test_worst_angles_are_raised_where_that_is_asked_for():
    mesh, _, _, _ = shaken_cylinder(20)
    mean, worst = (hc.regularize(mesh, emphasis=emphasis).report.after for emphasis in ("mean", "worst"))
    assert worst.scaled_jacobian.min > mean.scaled_jacobian.min + 0.02


def test_a_run_that_is_left_is_within_its_bound():
    mesh, _, _, _ = shaken_cylinder(20, 0.05)
    run = QuadraticRegularization(mesh, hc.Options())
    for record in run:
        if record.phase == "lbfgs":
            break
    report = run.result().report
    assert report.reason == "interrupted"
    assert not report.converged
    assert report.after.invalid <= report.before.invalid
    assert report.hausdorff <= 0.005


@pytest.mark.long
def test_what_does_not_unfold_while_the_boundary_slides_may_where_it_stays(monkeypatch):
    mesh = shaken_cylinder(27)[0]
    held = []

    def unfold(setting, points):
        held.append(not setting.boundary.admissible.free(len(points))[setting.boundary.on_it].any())
        return unfolding.unfold(setting, points) if held[-1] else iter([Iteration("untangle", points)])

    monkeypatch.setattr(quadratic_run, "unfold", unfold)
    report = hc.regularize(mesh).report
    assert report.before.invalid > 0
    assert held == [False, True]
    assert report.after.invalid == 0


def test_a_bound_too_small_to_be_followed_is_as_none():
    mesh = hc.as_volume_mesh(hc.generate.curved_cylinder(2, 1, 2, nodes=27))
    skin = QuadraticSetting.of(mesh, hc.Options(boundary="fixed"), QuadraticSchedule()).boundary.on_it
    shaken = mesh.points + ~skin[:, None] * np.random.default_rng(0).uniform(-0.1, 0.1, mesh.points.shape)
    none, small = (hc.regularize(mesh.replaced(shaken), hausdorff=bound) for bound in (0.0, 1e-6))
    assert small.report.before.invalid > 10
    np.testing.assert_array_equal(small.points, none.points)
    assert any("curved parts stay: faces bend too far for a hausdorff below" in note for note in small.report.notes)
