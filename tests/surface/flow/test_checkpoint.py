"""Flows that are resumed from a checkpoint."""

import numpy as np
import pytest
from meshes.surfaces import as_arrays, icosphere

from hexconformal import OptionError, ReadError
from surface.flow import Evolution, MeanCurvature, Stepping, Willmore, load, save


def test_a_resumed_run_equals_the_one_that_never_stopped(tmp_path):
    points, cells = icosphere(2)
    flow = Willmore((points * [1.0, 1.0, 1.6], cells.triangles), ("area", "volume"))

    def run(steps):
        return Evolution(flow, Stepping(steps=steps, stall=0.0, remesh=3))

    whole = [moment.points for moment in run(12)]
    first = run(7)
    list(first)
    save(tmp_path / "run.npz", first)
    second = run(12)
    load(tmp_path / "run.npz", second)
    rest = list(second)
    assert [moment.record.step for moment in rest] == [8, 9, 10, 11, 12]
    assert np.abs(rest[-1].points - whole[-1]).max() <= 1e-12


def test_checkpoints_of_other_runs_and_other_files_are_refused(tmp_path):
    one, other = (Evolution(Willmore(as_arrays(icosphere(level))), Stepping(steps=1)) for level in (1, 2))
    save(tmp_path / "run.npz", one)
    with pytest.raises(OptionError, match="another surface"):
        load(tmp_path / "run.npz", other)
    with pytest.raises(OptionError, match="another surface or another flow"):
        load(tmp_path / "run.npz", Evolution(MeanCurvature(as_arrays(icosphere(1))), Stepping(steps=1)))
    (tmp_path / "text.npz").write_text("nothing")
    with pytest.raises(ReadError, match="text"):
        load(tmp_path / "text.npz", one)
    with pytest.raises(ReadError, match="absent"):
        load(tmp_path / "absent.npz", one)
