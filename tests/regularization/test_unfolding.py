"""Unfolding where the boundary is flat."""

import numpy as np

import hexconformal as hc


def test_an_outline_that_would_be_left_too_far_behind_is_kept_by_a_barrier():
    points, cells = hc.generate.box((6, 6, 6))
    node = np.isclose(points, [1 / 6, 0.5, 1.0]).all(axis=1)
    points[node, 0] = -0.01 * np.sqrt(3)  # past the edge, in the plane of the face
    report = hc.regularize((points, cells)).report
    assert report.before.invalid == 2
    assert report.after.invalid == 0
    assert 0.001 < report.hausdorff <= 0.005
    assert any("features='soft' instead" in note for note in report.notes)
