"""A result is the same body: its volume, its edges, its surface in the mean, its proportions."""

from dataclasses import replace

import numpy as np
import pytest

import hexconformal as hc
from hexconformal import generate
from hexconformal.formulation import Schedules
from hexconformal.geometry import DistanceBarrier, SurfaceLocator, find_features, sharp_length
from hexconformal.mesh import boundary_depths, boundary_quads
from hexconformal.regularization import Regularization
from hexconformal.regularization.acceptance import no_worse_than
from hexconformal.regularization.options import Record


def rough_cylinder():
    """A cylinder, its nodes shaken, those of its skin as well."""
    points, cells = generate.cylinder(4, 3, 8)
    shaken = generate.jittered(points, cells, 0.3, keep_boundary=False)[0]
    return shaken, cells


def volume_drift(drift):
    schedules = replace(Schedules(), volume=replace(Schedules().volume, drift=drift))
    mesh = generate.jittered(*generate.ball(4, 2), 0.3)
    run = Regularization(mesh, hc.Options(hausdorff=0.02), schedules)
    list(run)
    return run.result().report


def test_a_body_that_drifts_gets_its_volume_back_and_says_so():
    left, back = volume_drift(0.5), volume_drift(1e-4)
    assert abs(left.volume_change) > 5e-4
    assert abs(back.volume_change) < 1e-10
    assert not any("made up for" in note for note in left.notes)
    assert any("made up for" in note for note in back.notes)
    assert back.after.scaled_jacobian.min > left.after.scaled_jacobian.min - 0.01


@pytest.mark.parametrize("band", [0.05, 1.0])
def test_curves_stay_within_their_band(band):
    points, cells = rough_cylinder()
    quads = boundary_quads(cells)[0]
    features = find_features(points, quads, cells=cells)
    assert len(features.edges) > 20
    result = hc.regularize((points, cells), features="keep", feature_band=band, hausdorff=0.01)
    rim = np.unique(features.edges)
    ends = points[features.edges]
    # Distance of every rim node from the straight edges of the rim that was.
    along = ends[:, 1] - ends[:, 0]
    shift = result.points[rim][:, None] - ends[:, 0]
    share = np.clip(np.einsum("nei,ei->ne", shift, along) / (along**2).sum(axis=1), 0.0, 1.0)
    away = np.linalg.norm(shift - share[..., None] * along, axis=2).min(axis=1).max()
    bound = 0.01 * result.report.diagonal
    assert away <= band * bound * 1.0001
    assert band < 1.0 or away > 0.2 * bound


def test_curves_that_are_let_go_cost_as_little_as_the_surface():
    points, cells = generate.cylinder(4, 3, 6)
    quads = boundary_quads(cells)[0]
    barrier = DistanceBarrier.around(SurfaceLocator(points, quads), 0.1, find_features(points, quads))
    rim = barrier.curves.nodes[:, 0]
    touched = np.zeros(len(points), dtype=bool)
    touched[rim[0]] = True
    loose, count = barrier.with_slack(touched)
    assert count == 1
    assert 0 < loose.curves.slack.sum() < len(rim)
    assert loose.with_slack(touched)[1] == 0
    lifted = points.copy()
    lifted[rim[0]] += [0.0, 0.0, 0.03]
    assert barrier.value(lifted) == np.inf > loose.value(lifted)


def test_thin_walls_are_drawn_back_the_more_strongly():
    points, cells = generate.box((6, 6, 1), (1.0, 1.0, 0.02))
    quads = boundary_quads(cells)[0]
    depths = boundary_depths(points, cells, *boundary_quads(cells))
    surface = SurfaceLocator(points, quads)
    thin, plain = (DistanceBarrier.around(surface, 0.05, depths=d) for d in (depths, None))
    swollen = points * [1.0, 1.0, 1.5]
    # The skin above and below is .02 thick, .6 of a bound less than two thirds of which the surface may move.
    assert thin.value(swollen) > 1.5 * plain.value(swollen) > 0.0
    thick = DistanceBarrier.around(surface, 0.05, depths=np.full(len(quads), 0.04))
    assert thick.value(swollen) == plain.value(swollen)


def test_the_surface_is_drawn_back_between_nodes_too():
    points, cells = generate.box((4, 4, 1))
    quads = boundary_quads(cells)[0]
    barrier = DistanceBarrier.around(SurfaceLocator(points, quads), 0.2)
    # Over an edge of the box nodes may stay on it while the surface leaves it.
    rounded = points.copy()
    along = (points[:, 0] == 1.0) & (points[:, 2] == 1.0)
    rounded[along, 0] -= 0.1
    assert np.linalg.norm(rounded[along] - points[along], axis=1).max() == pytest.approx(0.1)
    assert barrier.value(rounded) > 1.0


def test_a_report_tells_the_length_of_sharp_edges():
    points, cells = generate.jittered(*generate.box((4, 4, 4), (1.0, 2.0, 3.0)), 0.2)
    report = hc.regularize((points, cells)).report
    assert report.sharp_edges == pytest.approx((24.0, 24.0), rel=1e-9)
    assert "edges sharper than 45 degrees 24 long, 24 before" in str(report)


def test_edges_count_as_sharp_from_their_angle_on():
    points, cells = generate.cylinder(4, 3, 6)
    quads = boundary_quads(cells)[0]
    height, rim = np.ptp(points[:, 2]), np.hypot(points[:, 0], points[:, 1]).max()
    sides = len(np.unique(quads[np.isclose(np.hypot(*points[quads][..., :2].T), rim).T.all(axis=1)])) // 7
    around = 2 * sides * 2.0 * rim * np.sin(np.pi / sides)  # both rims, as polygons
    assert sharp_length(points, quads) == pytest.approx(around, rel=1e-9)
    # The sides meet at 360 / sides degrees: a smaller angle counts them, too.
    assert sharp_length(points, quads, 0.9 * 360 / sides) == pytest.approx(around + sides * height, rel=1e-9)


FIRST = Record(0, "input", 1.0, 1.0, 1.0, 0.5, 0.8, 0, 0.0, 2, 0.08)


@pytest.mark.parametrize(
    ("change", "better"),
    [
        ({"flat": 1, "min_scaled_jacobian": 0.2, "min_shape": 0.01}, True),
        ({"flat": 3, "min_scaled_jacobian": 0.9, "min_shape": 0.9}, False),
        ({"inverted": 1, "flat": 1}, False),
        ({"min_shape": 0.075}, True),
        ({"min_shape": 0.07}, False),
        ({"mean_scaled_jacobian": 0.79}, False),
        ({}, True),
    ],
)
def test_no_worse_counts_cells_without_volume_first_and_shapes_where_they_are_poor(change, better):
    assert no_worse_than(replace(FIRST, **change), FIRST) is better
