"""The report of a run."""

import json

import numpy as np
import pytest

from hexconformal.generate import box, jittered
from hexconformal.quality.assessment import quality
from hexconformal.regularization.report import Report


def test_report_says_what_happened():
    before = quality(jittered(*box((3, 3, 3)), amount=0.6, valid=False)).summary()
    after = quality(box((3, 3, 3), lengths=(1, 1, 1.5))).summary()
    report = Report(
        before,
        after,
        energy_before=np.inf,
        energy_after=np.float64(1.5),
        boundary_moved=3,
        largest_displacement=0.5,
        diagonal=2.0,
        iterations=7,
        seconds=0.25,
        reason="the worst cell no longer improves",
        converged=True,
        options={"boundary": "slide", "energy": "barrier", "hausdorff": 0.01, "fixed": np.array([1, 2])},
        hausdorff=0.0042,
        notes=("three nodes were kept",),
    )
    assert report.volume_change == pytest.approx(0.5)
    assert report.relative_displacement == 0.25
    text = str(report)
    assert "converged: the worst cell no longer improves" in text
    assert "note: three nodes were kept" in text
    assert "Hausdorff distance of the surface 0.0042 diagonals, allowed 0.01" in text
    assert "\nenergy" not in text  # infinite before: nothing to compare
    assert max(map(len, text.splitlines())) < 100
    row = next(line.split() for line in text.splitlines() if line.startswith("inverted cells"))
    assert row[-2:] == [str(before.inverted), "0"]
    back = json.loads(report.to_json())
    assert back == report.to_dict()
    assert back["energy_before"] is None
    assert back["energy_after"] == 1.5
    assert back["options"] == {"boundary": "slide", "energy": "barrier", "hausdorff": 0.01, "fixed": [1, 2]}
    assert back["hausdorff_bound"] == 0.01
    assert back["volume_change"] == pytest.approx(0.5)
    assert back["after"]["scaled_jacobian"]["percentiles"]["50"] == pytest.approx(1)
