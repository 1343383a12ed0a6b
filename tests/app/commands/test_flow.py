"""The `flow` command: what it writes, and how runs go on."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import pyvista as pv
from program import frames, history

from hexconformal.app.cli import main


@pytest.fixture
def ellipsoid(tmp_path):
    sphere = pv.Icosphere(nsub=2)
    sphere.points *= [1.0, 1.2, 1.6]
    sphere.point_data["mine"] = np.arange(sphere.n_points)
    path = tmp_path / "ellipsoid.vtp"
    sphere.save(path)
    return path


WILLMORE = ["--flow", "willmore", "--conserve", "area,volume", "--stall", "0", "--quiet"]


def test_a_flow_leaves_frames_history_plot_and_last_surface(ellipsoid, tmp_path, capsys):
    folder = tmp_path / "new" / "run"
    words = ["flow", str(ellipsoid), str(folder), "--conserve", "volume", "--t-end", "0.1", "--outputs", "0.02,0.05"]
    assert main([*words, "--every", "100", "--remesh"]) == 0
    assert "reached t_end" in capsys.readouterr().out
    times = [time for time, _ in frames(folder / "run.pvd")]
    assert {0.0, 0.02, 0.05, 0.1} <= set(times)
    rows = history(folder / "history.csv")
    assert [int(row["step"]) for row in rows] == list(range(len(rows)))
    assert (np.diff([float(row["energy"]) for row in rows]) < 0).all()
    last = pv.read(folder / "last.vtu")
    assert (last.point_data["mine"] == np.arange(last.n_points)).all()
    assert {"normal", "mean_curvature", "curvature"} <= set(last.point_data)
    assert np.allclose(pv.read(frames(folder / "run.pvd")[-1][1]).points, last.points)
    assert pv.read(frames(folder / "run.pvd")[0][1]).points == pytest.approx(pv.read(ellipsoid).points)
    assert (folder / "history.png").stat().st_size > 5000


def test_a_run_that_goes_on_equals_the_one_that_never_stopped(ellipsoid, tmp_path):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    assert main(["flow", str(ellipsoid), str(whole), "--steps", "9", *WILLMORE]) == 0
    assert main(["flow", str(ellipsoid), str(parts), "--steps", "4", *WILLMORE]) == 0
    assert main(["flow", str(ellipsoid), str(parts), "--steps", "9", "--resume", *WILLMORE]) == 0
    assert history(parts / "history.csv") == history(whole / "history.csv")
    assert [time for time, _ in frames(parts / "run.pvd")] == [time for time, _ in frames(whole / "run.pvd")]
    assert (pv.read(parts / "last.vtu").points == pv.read(whole / "last.vtu").points).all()


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_a_killed_run_loses_no_step_that_it_told(ellipsoid, tmp_path):
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    words = ["flow", str(ellipsoid), str(killed), "--steps", "2000", "--growth", "1.0", *WILLMORE]
    process = subprocess.Popen([sys.executable, "-m", "hexconformal", *words])
    until = time.monotonic() + 60
    while time.monotonic() < until and (
        not (killed / "checkpoint.npz").exists() or len(history(killed / "history.csv")) < 4
    ):
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    process.wait()
    told = len(history(killed / "history.csv"))
    assert told >= 4
    end = str(told + 2)
    again = ["flow", str(ellipsoid), str(killed), "--steps", end, "--growth", "1.0", "--resume", *WILLMORE]
    assert main(again) == 0
    assert main(["flow", str(ellipsoid), str(whole), "--steps", end, "--growth", "1.0", *WILLMORE]) == 0
    assert history(killed / "history.csv") == history(whole / "history.csv")
    assert len(frames(killed / "run.pvd")) == len(frames(whole / "run.pvd"))


def test_a_run_is_not_overwritten_unasked(ellipsoid, tmp_path, capsys):
    words = ["flow", str(ellipsoid), str(tmp_path / "run"), "--steps", "1", "--quiet"]
    assert main([*words, "--resume"]) == 2
    assert "no run" in capsys.readouterr().err
    assert main(words) == 0
    assert main(words) == 2
    assert "--resume goes on" in capsys.readouterr().err
    assert main([*words, "--overwrite"]) == 0
    assert len(history(tmp_path / "run" / "history.csv")) == 2
    assert main([*words, "--flow", "willmore", "--resume"]) == 2
    assert "another flow" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize("name", ["history.csv", "history.png", "last.vtu", "run.pvd", "run_frames/run_0007.vtu"])
def test_files_of_others_are_not_replaced_unasked(ellipsoid, tmp_path, capsys, name):
    words = ["flow", str(ellipsoid), str(tmp_path / "run"), "--steps", "1", "--quiet"]
    mine = tmp_path / "run" / name
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    assert main(words) == 2
    assert mine.read_text() == "mine"
    told = capsys.readouterr().err
    assert "would be replaced" in told
    assert name.partition("/")[0] in told
    assert main([*words, "--overwrite"]) == 0
    assert not mine.exists() or mine.read_bytes() != b"mine"


@pytest.mark.long
@pytest.mark.parametrize(("rows", "code"), [(0, 0), (1, 0), (2, 0), (3, 2)])
def test_what_was_killed_before_its_first_checkpoint_begins_anew(ellipsoid, tmp_path, rows, code):
    words = ["flow", str(ellipsoid), str(tmp_path / "run"), "--steps", "2", "--quiet"]
    assert main(words) == 0
    run = tmp_path / "run"
    kept = (run / "history.csv").read_text()
    for name in ("checkpoint.npz", "last.vtu", "history.png"):
        (run / name).unlink(missing_ok=True)
    (run / "history.csv").write_text("".join(kept.splitlines(keepends=True)[:rows]))
    assert main(words) == code
    if code == 0:
        assert len((run / "history.csv").read_text().splitlines()) == len(kept.splitlines()) > 3


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--flow", "ricci"], "not 'ricci'"),
        (["--outputs", "soon"], "'soon'"),
        (["--every", "0"], "every must be 1 or more"),
        (["--conserve", "mass"], "'mass'"),
        (["--flow", "p-willmore", "--p", "0.5"], "p must be at least 1"),
    ],
)
def test_what_makes_no_sense_is_refused(ellipsoid, tmp_path, capsys, words, message):
    assert main(["flow", str(ellipsoid), str(tmp_path / "run"), "--steps", "1", *words]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "run" / "history.csv").exists()
