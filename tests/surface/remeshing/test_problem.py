"""Steps along the surface that keep its volume."""

import numpy as np
import pytest
from meshes.surfaces import as_arrays, icosphere, no_cells, shaken

import surface
from hexconformal.geometry import Faces, enclosed_volume


@pytest.mark.parametrize(("hausdorff", "told"), [(1e-4, True), (0.05, False)])
def test_without_projection_the_bound_is_only_compared(hausdorff, told):
    points, cells = shaken(icosphere(2), 0.05)
    report = surface.remesh((points, cells.triangles), project=False, max_iterations=5, hausdorff=hausdorff).report
    assert 1e-4 < report.hausdorff < 0.05
    assert any("farther than hausdorff" in note for note in report.notes) is told


def test_without_projection_the_simpson_normal_keeps_the_volume():
    shape = shaken(icosphere(3), 0.02)
    result = surface.remesh(
        as_arrays(shape), energy="quaternionic", target="flat", project=False, normal="simpson", max_iterations=3
    )
    assert abs(result.report.volume_change) < 1e-6
    assert result.report.after.mean_dilatation < result.report.before.mean_dilatation


def test_several_pieces_keep_their_own_volume():
    points, cells = shaken(icosphere(2), 0.05)
    two = np.concatenate([points, 0.5 * points[:, [1, 2, 0]] + [3, 0, 0]])
    triangles = np.concatenate([cells.triangles, cells.triangles + len(points)])
    result = surface.remesh((two, triangles))
    for part in (triangles[: len(cells)], triangles[len(cells) :]):
        one = Faces(part, no_cells(4))
        assert enclosed_volume(result.points, one) == pytest.approx(enclosed_volume(two, one), rel=1e-6)


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
