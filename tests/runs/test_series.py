"""Time series for ParaView: readable after every frame, and without the frames of an earlier run."""

import os

import numpy as np
import pytest
import pyvista as pv
from meshes.files import mixed_grid
from meshes.hexahedra import block

from hexconformal import HexMesh, as_hex_mesh
from hexconformal.common.errors import OptionError, WriteError
from hexconformal.runs.series import Series


def test_series_is_readable_after_every_frame(tmp_path):
    mesh = as_hex_mesh(mixed_grid())
    with Series(tmp_path / "run.pvd") as series:
        for number, time in enumerate([0, 0.25, 1e-3 + 1]):
            series.add(time, mesh.replaced(points=mesh.points * (1 + number)))
            reader = pv.get_reader(tmp_path / "run.pvd")
            assert reader.time_values[-1] == time
            reader.set_active_time_value(time)
            frame = reader.read()[0]
            np.testing.assert_allclose(frame.points, mesh.points * (1 + number))
            assert list(frame.field_data["units"]) == ["mm"]
        with pytest.raises(OptionError, match="later"):
            series.add(0.5, mesh)
    assert sorted(os.listdir(tmp_path / "run_frames")) == ["run_0000.vtu", "run_0001.vtu", "run_0002.vtu"]
    assert str(tmp_path) not in (tmp_path / "run.pvd").read_text()


def test_a_shorter_series_removes_the_frames_of_a_longer_one(tmp_path):
    mesh = HexMesh(*block(1))
    for count in (4, 2):
        with Series(tmp_path / "run.pvd") as series:
            for time in range(count):
                series.add(time, mesh)
        (tmp_path / "run_frames" / "run_notes.vtu").write_text("not ours")
        (tmp_path / "run_frames" / "run_0007.txt").write_text("not ours")
    frames = ["run_0000.vtu", "run_0001.vtu", "run_0007.txt", "run_notes.vtu"]
    assert sorted(os.listdir(tmp_path / "run_frames")) == frames


def test_series_of_surfaces(tmp_path):
    with Series(tmp_path / "flow.pvd") as series:
        series.add(0.0, pv.Sphere())
    reader = pv.get_reader(tmp_path / "flow.pvd")
    assert reader.read()[0].n_points == pv.Sphere().n_points
    assert os.listdir(tmp_path / "flow_frames") == ["flow_0000.vtp"]
    with pytest.raises(WriteError, match="does not exist"):
        Series(tmp_path / "no" / "flow.pvd")
    with pytest.raises(WriteError, match="extension"):
        Series(tmp_path / "flow.vtu")
