"""What a run on quadratic hexahedra keeps of what its stages come to: stages are told what to come to here."""

import numpy as np
import pytest
from meshes.quadratic_cells import curved_cylinder

import hexconformal as hc
from hexconformal.formulation import Iteration
from hexconformal.regularization.quadratic import QuadraticRegularization
from hexconformal.regularization.quadratic import run as quadratic_run


@pytest.fixture
def stages(monkeypatch):
    """A function that says which points each stage comes to; no others."""

    def told(run, unfold=(), minimize=(), raising=(), gradient=0.0):
        def stage(phase, places):
            trials = [run._setting.start + (points - run.mesh.points) / run._setting.unit for points in places]
            return lambda *arguments: iter([Iteration(phase, trial, gradient=gradient) for trial in trials])

        monkeypatch.setattr(quadratic_run, "unfold", stage("untangle", unfold))
        monkeypatch.setattr(quadratic_run, "minimize_distortion", stage("lbfgs", minimize))
        monkeypatch.setattr(quadratic_run, "raise_worst", stage("stiffen", raising))

    return told


def row_of_boxes(*shears, nodes=20):
    """Boxes that do not touch, each of eight cells with its inner corner moved by a share of a cell."""
    blocks, start = [], 0
    for k, shear in enumerate(shears):
        mesh = hc.elevated(hc.generate.box((2, 2, 2)), nodes)
        centre = np.abs(mesh.points - 0.5).max(axis=1) < 1e-9
        blocks.append((mesh.points + 0.2 * shear * centre[:, None] + [2.0 * k, 0.0, 0.0], mesh.blocks[0].cells + start))
        start += len(mesh.points)
    points, cells = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    return hc.MixedMesh.of_types(points, {f"hexahedron{nodes}": cells})


def worst_and_mean(mesh):
    scaled = hc.quality(mesh).scaled_jacobian
    return scaled.min(), scaled.mean()


def fixed_run(mesh, **options):
    return QuadraticRegularization(mesh, hc.Options(boundary="fixed", **options))


def test_a_better_worst_cell_is_more_than_a_better_mean(stages):
    start, even, raised = (row_of_boxes(*shears) for shears in ((0.2, 0.2), (0.17, 0.0), (0.13, 0.13)))
    assert worst_and_mean(even)[0] < worst_and_mean(raised)[0] - 1e-3
    assert worst_and_mean(even)[1] > worst_and_mean(raised)[1] + 1e-3
    stages(run := fixed_run(start), minimize=[even.points], raising=[raised.points])
    list(run)
    np.testing.assert_allclose(run.result().points, raised.points, atol=1e-14)


def test_what_raising_loses_without_a_better_worst_cell_is_taken_back(stages):
    start, even, raised = (row_of_boxes(*shears) for shears in ((0.2, 0.2), (0.17, 0.0), (0.17, 0.1)))
    stages(run := fixed_run(start), minimize=[even.points], raising=[raised.points])
    list(run)
    np.testing.assert_allclose(run.points, raised.points, atol=1e-14)
    np.testing.assert_allclose(run.result().points, even.points, atol=1e-14)


def with_a_held_fold(mesh, amount):
    """The mesh with a middle of an edge of its boundary moved inwards: from .15 on a cell is invalid."""
    points = mesh.points.copy()
    points[mesh.blocks[0].cells[0, 8]] += amount
    return mesh.replaced(points)


def test_the_mean_is_no_price_for_a_cell_that_stays_invalid(stages):
    start = with_a_held_fold(row_of_boxes(0.0, 0.1), 0.2)
    after = with_a_held_fold(row_of_boxes(0.0, 0.15), 0.19)
    before, now = hc.quality(start), hc.quality(after)
    np.testing.assert_array_equal(now.valid, before.valid)
    assert before.valid.sum() == len(before.valid) - 1
    assert now.scaled_jacobian.min() > before.scaled_jacobian.min() + 1e-3
    assert now.scaled_jacobian.mean() < before.scaled_jacobian.mean()
    stages(run := fixed_run(start), minimize=[after.points])
    list(run)
    np.testing.assert_allclose(run.points, after.points, atol=1e-14)
    np.testing.assert_array_equal(run.result().points, start.points)


def test_nor_is_the_worst_cell_of_another_type(stages):
    straight, cells = hc.generate.box((2, 2, 2))
    centre = np.abs(straight - 0.5).max(axis=1) < 1e-9

    def beside(curved, shear):
        points = np.concatenate([curved.points, straight + shear * centre[:, None] + [0.0, 2.0, 0.0]])
        table = {"hexahedron20": curved.blocks[0].cells, "hexahedron": cells + len(curved.points)}
        return hc.MixedMesh.of_types(points, table)

    start = beside(with_a_held_fold(row_of_boxes(0.1), 0.2), 0.1)
    after = beside(with_a_held_fold(row_of_boxes(0.0), 0.19), 0.11)
    before, now = hc.quality(start), hc.quality(after)
    np.testing.assert_array_equal(now.valid, before.valid)
    assert now.scaled_jacobian.min() > before.scaled_jacobian.min() + 1e-3
    assert now.scaled_jacobian.mean() > before.scaled_jacobian.mean() + 1e-3
    assert now.scaled_jacobian[8:].min() < before.scaled_jacobian[8:].min() - 1e-3
    stages(run := fixed_run(start), minimize=[after.points])
    for record in run:
        if record.phase == "lbfgs":  # later, the type would be held
            break
    np.testing.assert_array_equal(run.result().points, start.points)


@pytest.mark.parametrize(("taken", "reason"), [(2, "the energy falls no more"), (3, "limit of iterations")])
def test_a_run_whose_gradient_is_large_ends_by_its_limit_only_where_it_is_reached(stages, taken, reason):
    start, better = row_of_boxes(0.2), row_of_boxes(0.1)
    run = fixed_run(start, emphasis="mean", max_iterations=3)
    stages(run, minimize=[better.points] * taken, gradient=0.5)
    list(run)
    report = run.result().report
    assert (report.reason, report.converged) == (reason, taken == 2)


def handed_to_minimize(monkeypatch, run):
    """The setting and the points with which the distortion is minimized."""
    seen = []

    def minimize(setting, points, *limits):
        seen.append((setting, points))
        return iter([])

    monkeypatch.setattr(quadratic_run, "minimize_distortion", minimize)
    list(run)
    ((setting, points),) = seen
    return setting, points


@pytest.mark.parametrize("better", ["sliding", "held"])
def test_where_the_boundary_slides_and_where_it_stays_what_unfolds_more_is_gone_on_with(monkeypatch, better):
    mesh = curved_cylinder(20)
    centre = np.linalg.norm(mesh.points - [0.0, 0.0, 1.0], axis=1).argmin()
    folded, rest = mesh.points.copy(), 0.25 * np.eye(len(mesh.points))[centre][:, None] * [1.0, 0.0, 0.0]
    folded[centre, 0] += 0.8
    run = QuadraticRegularization(mesh.replaced(folded), hc.Options())
    assert not run._valid.all()

    def unfold(setting, points):
        held = not setting.boundary.admissible.free(len(points))[setting.boundary.on_it].any()
        trial = points + (mesh.points + rest - folded) / setting.unit
        return iter([Iteration("untangle", trial if held == (better == "held") else points)])

    monkeypatch.setattr(quadratic_run, "unfold", unfold)
    _, points = handed_to_minimize(monkeypatch, run)
    np.testing.assert_allclose(run._setting.to_user(points), mesh.points + rest, atol=1e-12)


def test_what_stays_folded_is_held_and_counts_for_nothing(stages, monkeypatch):
    mesh = with_a_held_fold(row_of_boxes(0.1), 0.2)
    stages(run := fixed_run(mesh))
    setting, points = handed_to_minimize(monkeypatch, run)
    assert np.flatnonzero(setting.left_out).tolist() == [0]
    assert not setting.free[mesh.blocks[0].cells[0]].any()
    assert setting.free.any()
    np.testing.assert_array_equal(points, setting.start)
    assert run.history[-1].phase == "go back"


def test_of_what_takes_the_surface_too_far_a_share_is_taken(stages):
    # A lid that stands out, whose middle lies beside the middle; on its way there the lid becomes another.
    mesh = hc.elevated(hc.generate.box((1, 1, 1), (2.0, 2.0, 2.0)), 27)
    (middle,) = np.flatnonzero(np.abs(mesh.points - [1.0, 1.0, 2.0]).max(axis=1) < 1e-9)
    better = mesh.points.copy()
    better[middle, 2] += 0.4
    start = better.copy()
    start[middle] += [0.2, 0.0, -0.016]
    run, bound = QuadraticRegularization(mesh.replaced(start), hc.Options(hausdorff=0.005)), 0.005
    assert run._setting.boundary.distance(better) > 1.5 * bound
    stages(run, minimize=[better])
    list(run)
    np.testing.assert_allclose(run.points, better, atol=1e-14)
    result = run.result()
    assert 0.5 * bound < result.report.hausdorff <= bound
    assert result.points[middle, 0] < start[middle, 0] - 0.03


def test_fewer_invalid_cells_are_worth_a_lower_mean(stages):
    start = with_a_held_fold(row_of_boxes(*6 * [0.0]), 0.15)
    after = row_of_boxes(0.0, *5 * [0.2])
    assert (~hc.quality(start).valid).sum() == 1
    assert hc.quality(after).valid.all()
    assert worst_and_mean(after)[1] < worst_and_mean(start)[1]
    stages(run := fixed_run(start), minimize=[after.points])
    for record in run:
        if record.phase == "lbfgs":  # later, the type would be held
            break
    np.testing.assert_allclose(run.result().points, after.points, atol=1e-14)


def test_a_share_of_the_way_that_loses_a_valid_cell_is_not_taken(stages, monkeypatch):
    # Two cells unfold, and a third turns about, half-way of which it is flat; at the end it is as it was.
    single = hc.elevated(hc.generate.box((1, 1, 1)), 20)
    cells = np.concatenate([single.blocks[0].cells + 20 * k for k in range(4)])
    good = np.concatenate([single.points + [2.0 * k, 0.0, 0.0] for k in range(4)])
    start, after = good.copy(), good.copy()
    start[cells[:2, 8]] += 0.35
    after[40:60] = (single.points - 0.5) * [-1.0, -1.0, 1.0] + [4.5, 0.5, 0.5]
    mesh = hc.MixedMesh.of_types(start, {"hexahedron20": cells})
    half = hc.quality(mesh.replaced((start + after) / 2)).valid
    assert hc.quality(mesh).valid.tolist() == [False, False, True, True]
    assert half.tolist() == [True, True, False, True]
    stages(run := QuadraticRegularization(mesh, hc.Options(boundary="free")), minimize=[after])
    list(run)
    np.testing.assert_allclose(run.result().points, after, atol=1e-12)
    monkeypatch.setattr(quadratic_run, "_SHARES", (0.5,))
    np.testing.assert_array_equal(run.result().points, start)
