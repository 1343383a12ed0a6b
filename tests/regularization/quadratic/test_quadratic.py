"""Regularizing quadratic hexahedra."""

import numpy as np
import pytest
import pyvista as pv
from meshes.hexahedra import separate
from meshes.quadratic_cells import random_cells, sampled_determinants

import hexconformal as hc
from hexconformal.elements import HEXAHEDRON27, LATTICE, determinant_bounds, valid_cells
from hexconformal.energy import CornerWeights
from hexconformal.formulation import Iteration
from hexconformal.io.convert import to_pyvista
from hexconformal.regularization.quadratic import QuadraticRegularization
from hexconformal.regularization.quadratic import run as quadratic_run
from hexconformal.regularization.quadratic.schedule import QuadraticSchedule
from hexconformal.regularization.quadratic.setting import QuadraticSetting
from hexconformal.regularization.quadratic.stages import minimize_distortion, raise_worst
from hexconformal.regularization.quadratic.unfolding import unfold

each_number = pytest.mark.parametrize("nodes", [20, 27])


def tangled(nodes, amount, n=3, seed=0):
    """A block of cells whose inner nodes, of all kinds, are moved by up to `amount` of a cell."""
    mesh = hc.elevated(hc.generate.box((n, n, n)), nodes)
    inside = ((mesh.points > 1e-9) & (mesh.points < 1 - 1e-9)).all(axis=1)
    moves = np.random.default_rng(seed).uniform(-amount / n, amount / n, mesh.points.shape)
    return mesh.replaced(mesh.points + inside[:, None] * moves), inside


def setting_of(mesh, **options):
    return QuadraticSetting.of(mesh, hc.Options(**{"boundary": "fixed"} | options), QuadraticSchedule())


@each_number
def test_a_shaken_block_becomes_the_block(nodes):
    mesh, inside = tangled(nodes, 0.4)
    assert (~hc.quality(mesh).valid).sum() > 5
    result = hc.regularize(mesh, boundary="fixed", gradient_tolerance=1e-9)
    assert result.converged
    np.testing.assert_array_equal(result.points[~inside], mesh.points[~inside])
    np.testing.assert_allclose(result.points, hc.elevated(hc.generate.box((3, 3, 3)), nodes).points, atol=1e-3)
    assert result.report.after.invalid == 0
    assert result.report.after.scaled_jacobian.min > 0.99
    assert result.report.boundary_moved == 0
    assert result.mesh.cell_data["scaled_jacobian"].min() == result.report.after.scaled_jacobian.min


@each_number
def test_spheres_of_the_design(nodes, shared):
    source = hc.as_volume_mesh(shared / "meshes" / "elements" / f"sphere_hex{nodes}_tangled.vtu")
    result = hc.regularize(source, boundary="fixed")
    report = result.report
    assert report.before.invalid >= 188
    assert report.after.invalid == 0
    assert report.after.scaled_jacobian.min >= 0.75
    cells = source.blocks[0]
    det = sampled_determinants(cells.cell_type, result.points[cells.cells], 9)
    assert (det.min(axis=1) / det.max(axis=1)).min() >= 0.10
    sphere = np.abs(np.linalg.norm(source.points, axis=1) - 1) < 1e-9
    assert sphere.sum() > 100
    np.testing.assert_array_equal(result.points[sphere], source.points[sphere])


@each_number
def test_no_valid_cell_is_lost_once_all_are_unfolded(nodes):
    mesh, _ = tangled(nodes, 0.3)
    setting = setting_of(mesh)
    block, points = mesh.blocks[0], setting.start
    for iteration in unfold(setting, points):
        points = iteration.points
    seen = setting.valid(points)
    for stage in (minimize_distortion(setting, points, 60, 1e-6), raise_worst(setting, points)):
        for iteration in stage:
            valid = determinant_bounds(setting.to_user(iteration.points), block.cells, block.cell_type)[0] > 0
            assert not (seen & ~valid).any()
            seen = valid
    assert seen.all()


def test_what_is_invalid_between_the_points_of_the_energy_is_not_stepped_to():
    x = random_cells(HEXAHEDRON27, 2000, 0.12)
    positive = (sampled_determinants(HEXAHEDRON27, x, 3) > 0).all(axis=1)
    unseen = x[positive & ~valid_cells(*separate(x), HEXAHEDRON27)][0]
    mesh = hc.MixedMesh.of_types(HEXAHEDRON27.ideal, {"hexahedron27": [range(27)]})
    setting = setting_of(mesh)
    problem = setting.problem(CornerWeights(), setting.start, np.ones(1, dtype=bool))
    start, trial = setting.start, setting.start + (unseen - mesh.points) / setting.unit
    assert np.isfinite(problem.objective.value(trial))
    assert problem.acceptable(start)
    assert not problem.acceptable(trial)
    assert problem.spoiled(trial).all()


@pytest.mark.parametrize("lost", [False, True])
def test_fewer_invalid_cells_are_better_and_what_spoils_a_valid_one_goes_back(lost, monkeypatch):
    mesh, _ = tangled(20, 0.0, n=3)
    points = mesh.points.copy()
    corner = np.flatnonzero((np.abs(points - 1 / 3) < 1e-9).all(axis=1))[0]
    points[corner] += 0.9 / 3  # folds all cells around
    after = mesh.points.copy()
    if lost:
        # Where x is 5/6 and y, z are 2/3 is a node in the middle of an edge of cells that were valid.
        node = np.flatnonzero(np.abs(after - [5 / 6, 2 / 3, 2 / 3]).max(axis=1) < 1e-9)[0]
        after[node, 0] -= 0.3
    run = QuadraticRegularization(mesh.replaced(points), hc.Options(boundary="fixed"))
    before = hc.quality(mesh.replaced(points)).valid
    now = hc.quality(mesh.replaced(after)).valid
    assert (~now).sum() < (~before).sum()
    assert (before & ~now).any() == lost
    trial = run._setting.start + (after - points) / run._setting.unit
    monkeypatch.setattr(quadratic_run, "unfold", lambda *arguments: iter([Iteration("untangle", trial)]))
    monkeypatch.setattr(quadratic_run, "minimize_distortion", lambda *arguments: iter([]))
    monkeypatch.setattr(quadratic_run, "raise_worst", lambda *arguments: iter([]))
    list(run)
    if lost:
        after[node] = points[node]
    np.testing.assert_allclose(run.points, after, atol=1e-14)


def test_the_boundary_is_all_nodes_of_outer_faces():
    mesh, inside = tangled(27, 0.0)
    np.testing.assert_array_equal(setting_of(mesh).boundary.on_it, ~inside)
    assert LATTICE.shape == (27, 3)


def test_cells_that_are_stretched_on_purpose_stay_so():
    plain = hc.elevated(hc.generate.box((3, 3, 3), (1, 1, 20)), 20)
    inside = ((plain.points > 1e-9) & (plain.points < np.array([1, 1, 20]) - 1e-9)).all(axis=1)
    moves = np.random.default_rng(0).uniform(-0.03, 0.03, plain.points.shape)
    report = hc.regularize(plain.replaced(plain.points + inside[:, None] * moves), boundary="fixed").report
    assert report.before.scaled_jacobian.min < 0.9
    assert report.after.scaled_jacobian.min > 0.99
    assert report.after.edge_ratio.min > 19


def test_what_cannot_be_unfolded_comes_back_as_it_was():
    mesh, inside = tangled(20, 0.0, n=2)
    points = mesh.points.copy()
    # A boundary node of one cell on the far side of it.
    points[0] = [0.9, 0.9, 0.9]
    result = hc.regularize(mesh.replaced(points), boundary="fixed")
    assert not result.converged
    assert "no way was found to unfold them as the boundary stays" in result.report.reason
    assert any("no valid mesh has these nodes where they are held: " in note for note in result.report.notes)
    before, after = hc.quality(mesh.replaced(points)), hc.quality(result.mesh)
    assert not (before.valid & ~after.valid).any()
    np.testing.assert_array_equal(result.points[~inside], points[~inside])


def test_a_grid_comes_back_as_a_grid_and_a_run_can_be_left():
    mesh, _ = tangled(20, 0.05)
    grid = to_pyvista(mesh)[0]
    result = hc.regularize(grid, boundary="fixed", max_iterations=2)
    assert type(result.mesh) is pv.UnstructuredGrid
    assert (result.report.iterations, result.report.reason) == (2, "limit of iterations")
    seen = []
    hc.regularize(grid, boundary="fixed", callback=seen.append)
    assert [record.iteration for record in seen] == list(range(len(seen)))
    energies = [record.energy for record in seen[1:]]
    assert energies == sorted(energies, reverse=True)


def test_options_without_effect_are_refused():
    mesh, _ = tangled(20, 0.0)
    with pytest.raises(hc.OptionError, match="there is no target, method: leave"):
        hc.regularize(mesh, boundary="fixed", target="input", method="newton")


@pytest.mark.parametrize("boundary", ["fixed", "slide"])
def test_linear_hexahedra_beside_quadratic_ones(boundary):
    curved, _ = tangled(20, 0.4)
    straight, cells = hc.generate.box((3, 3, 3))
    inside = ((straight > 1e-9) & (straight < 1 - 1e-9)).all(axis=1)
    linear = straight + inside[:, None] * np.random.default_rng(1).uniform(-0.25, 0.25, straight.shape)
    points, count = np.vstack([curved.points, linear + [2.0, 0.0, 0.0]]), len(curved.points)
    both = hc.MixedMesh.of_types(points, {"hexahedron20": curved.blocks[0].cells, "hexahedron": cells + count})
    assert hc.quality(both).valid[27:].sum() < 20
    report = (result := hc.regularize(both, boundary=boundary, gradient_tolerance=1e-9)).report
    assert report.after.invalid == 0
    assert {name: one.count for name, one in report.after.types.items()} == {"hexahedron": 27, "hexahedron20": 27}
    np.testing.assert_allclose(result.points[count:] - [2.0, 0.0, 0.0], straight, atol=2e-3)


def test_a_type_whose_worst_cell_would_become_worse_stays(monkeypatch):
    curved, _ = tangled(20, 0.0, n=2)
    straight, cells = hc.generate.box((2, 2, 2))
    count, middle = len(curved.points), int(np.argmin(np.linalg.norm(straight - 0.5, axis=1)))
    points = np.vstack([curved.points, straight + [2.0, 0.0, 0.0]])
    cells = {"hexahedron20": curved.blocks[0].cells, "hexahedron": cells + count}
    points[count + middle] += 0.1
    run = QuadraticRegularization(hc.MixedMesh.of_types(points, cells), hc.Options(boundary="fixed"))
    better = points.copy()
    better[count + middle] -= 0.09
    better[np.linalg.norm(points - 0.5, axis=1).argmin()] += 0.01  # worse than it was, better than the worst of all
    trial = run._setting.start + (better - points) / run._setting.unit
    monkeypatch.setattr(quadratic_run, "minimize_distortion", lambda *arguments: iter([]))
    monkeypatch.setattr(quadratic_run, "raise_worst", lambda *arguments: iter([Iteration("stiffen", trial)]))
    list(run)
    np.testing.assert_array_equal(run.result().points[:count], points[:count])
    np.testing.assert_allclose(run.result().points[count:], better[count:], atol=1e-14)


def test_where_a_linear_face_meets_a_quadratic_one_both_are_refused():
    mesh = hc.elevated(hc.generate.box((2, 1, 1)), 20)
    cells = mesh.blocks[0].cells
    both = hc.MixedMesh.of_types(mesh.points, {"hexahedron20": cells[:1], "hexahedron": cells[1:, :8]})
    with pytest.raises(
        hc.MeshError, match=r"another node in their middle, or none, .*: 2 \(ids 0, 1\); give all the same"
    ):
        hc.regularize(both, boundary="fixed")


def test_where_a_linear_edge_meets_a_quadratic_one_both_are_refused():
    points, cells = hc.generate.box((2, 2, 1))
    mesh = hc.elevated((points, cells), 20)
    # The first and the last of two by two cells have one edge in common.
    both = {"hexahedron": cells[:1], "hexahedron20": mesh.blocks[0].cells[3:]}
    with pytest.raises(
        hc.MeshError, match=r"cells with edges that have another node .*: 2 \(ids 0, 1\); give all the same"
    ):
        hc.regularize((mesh.points, both))


@each_number
def test_right_angles_are_not_raised(nodes):
    mesh, _ = tangled(nodes, 0.0)
    setting = setting_of(mesh.replaced(mesh.points + 1e-3 * mesh.points[:, [1, 2, 0]]))
    assert 1e-7 < max(setting.worst_angles(setting.start).values()) < 1e-3
    assert list(raise_worst(setting, setting.start)) == []


def test_a_run_for_linear_cells_says_that_these_are_none():
    mesh, _ = tangled(20, 0.0)
    with pytest.raises(hc.MeshError, match=r"27 hexahedra of 20 nodes; .* works on them as they are"):
        hc.Regularization(mesh)


@each_number
def test_one_cell_that_cannot_be_unfolded_leaves_the_others_to_be_made_better(nodes):
    mesh, _ = tangled(nodes, 0.06, n=4)
    points = mesh.points.copy()
    points[mesh.blocks[0].cells[0, 8], 0] += 0.3 / 4  # the middle of an edge of the boundary, behind a quarter of it
    before = hc.quality(mesh.replaced(points))
    assert (~before.valid).sum() == 1
    result = hc.regularize(mesh.replaced(points), boundary="fixed")
    after = hc.quality(result.mesh)
    np.testing.assert_array_equal(after.valid, before.valid)
    assert "cells that stay invalid: 1 (ids 0); no way was found" in result.report.reason
    assert after.scaled_jacobian[1:].mean() > before.scaled_jacobian[1:].mean() + 0.1
    assert after.scaled_jacobian[0] == before.scaled_jacobian[0]
    assert np.isnan(result.report.energy_before)


def test_where_the_worst_corner_is_held_the_others_become_better():
    mesh, _ = tangled(27, 0.03, n=4)
    weights = np.clip(1 - 2 * mesh.points, 0, 1).prod(axis=1)[:, None]
    mesh = mesh.replaced(mesh.points + weights * [0.125, 0.125, 0.0])
    report = hc.regularize(mesh, boundary="fixed").report
    assert report.after.scaled_jacobian.min == pytest.approx(report.before.scaled_jacobian.min, abs=1e-6)
    assert report.after.scaled_jacobian.mean > report.before.scaled_jacobian.mean + 0.02
    assert report.energy_after < report.energy_before


def test_the_mean_does_not_fall_for_a_better_worst_cell():
    mesh = hc.as_volume_mesh(hc.generate.curved_cylinder(2, 1, 3, nodes=27))
    low, size = mesh.points.min(axis=0), np.ptp(mesh.points, axis=0)
    weights = np.clip(1 - 2 * (mesh.points - low) / size, 0, 1).prod(axis=1)[:, None]
    mesh = mesh.replaced(mesh.points + 0.06 * size.max() * weights * [1.0, 1.0, 0.9])
    report = hc.regularize(mesh, boundary="fixed").report
    assert report.after.scaled_jacobian.min >= report.before.scaled_jacobian.min - 1e-6
    assert report.after.scaled_jacobian.mean >= report.before.scaled_jacobian.mean - 1e-12


def test_a_run_that_is_left_while_it_unfolds_says_so():
    mesh, _ = tangled(20, 0.45)
    run = QuadraticRegularization(mesh, hc.Options(boundary="fixed"))
    next(iter(run))
    report = run.result().report
    assert (report.reason, report.converged) == ("interrupted", False)


def test_nodes_that_the_file_names_do_not_stand_in_the_way(tmp_path):
    mesh, _ = tangled(20, 0.1)
    path = tmp_path / "named.inp"
    hc.write(path, mesh)
    for boundary in ("fixed", "free"):
        assert hc.regularize(str(path), boundary=boundary, max_iterations=2).report.after.invalid == 0


def test_points_that_lose_a_valid_cell_are_none_to_stop_at(monkeypatch):
    mesh, _ = tangled(20, 0.0, n=3)
    points, after = mesh.points.copy(), mesh.points.copy()
    points[np.abs(points - 1 / 3).max(axis=1).argmin()] += 0.9 / 3  # folds all cells around
    after[np.abs(after - [5 / 6, 2 / 3, 2 / 3]).max(axis=1).argmin(), 0] -= 0.3  # folds others, and fewer
    run = QuadraticRegularization(mesh.replaced(points), hc.Options(boundary="fixed"))
    trial = run._setting.start + (after - points) / run._setting.unit
    monkeypatch.setattr(quadratic_run, "unfold", lambda *arguments: iter([]))
    monkeypatch.setattr(quadratic_run, "minimize_distortion", lambda *arguments: iter([Iteration("lbfgs", trial)]))
    for record in run:
        if record.phase == "lbfgs":
            break
    np.testing.assert_array_equal(run.points, points)


def test_the_best_of_what_raising_comes_to_is_kept(monkeypatch):
    mesh, _ = tangled(20, 0.1)
    exact = hc.elevated(hc.generate.box((3, 3, 3)), 20).points
    run = QuadraticRegularization(mesh, hc.Options(boundary="fixed"))
    trials = [run._setting.start + share * (exact - mesh.points) / run._setting.unit for share in (0.9, 0.5)]
    monkeypatch.setattr(quadratic_run, "minimize_distortion", lambda *arguments: iter([]))
    monkeypatch.setattr(
        quadratic_run, "raise_worst", lambda *arguments: iter([Iteration("stiffen", trial) for trial in trials])
    )
    list(run)
    np.testing.assert_allclose(run.points, mesh.points + 0.9 * (exact - mesh.points), atol=1e-14)


def test_points_with_a_worse_cell_than_there_was_are_none_to_stop_at(monkeypatch):
    mesh, _ = tangled(20, 0.05)
    exact = hc.elevated(hc.generate.box((3, 3, 3)), 20).points
    run = QuadraticRegularization(mesh, hc.Options(boundary="fixed"))
    trial = run._setting.start - 0.3 * (exact - mesh.points) / run._setting.unit
    monkeypatch.setattr(quadratic_run, "minimize_distortion", lambda *arguments: iter([Iteration("lbfgs", trial)]))
    monkeypatch.setattr(quadratic_run, "raise_worst", lambda *arguments: iter([]))
    for record in run:
        if record.phase == "lbfgs":
            break
    np.testing.assert_array_equal(run.points, mesh.points)
