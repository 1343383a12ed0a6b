"""Runs that are stopped at the worst moments and gone on with: nothing is lost, and the series is that of the whole."""

import csv
import os
import signal
from xml.etree import ElementTree

import numpy as np
import pytest
import pyvista as pv
from meshes.surfaces import icosphere, shaken
from program import error_line

import hexconformal as hc
import surface
from hexconformal.app.cli import main
from hexconformal.common import interruptible, uninterrupted
from hexconformal.generate import box
from hexconformal.motion.mesh_motion import MeshMotion
from hexconformal.motion.motion_run import MotionRun
from hexconformal.runs import RunFolder
from hexconformal.runs.history import HistoryFile
from hexconformal.runs.series import Series
from surface.flow.checkpoint import FlowRun

STEPS = 7


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    points, cells = box((2, 2, 2))
    hc.write("box.vtu", hc.HexMesh(points, cells))
    lid = np.flatnonzero(points[:, 2] == 1)
    for name, steps, slope in (("lid", STEPS, 0.03), ("short", 2, 0.03), ("other", STEPS, 0.02)):
        rows = [f"{step},{node},0,0,{slope * step}" for step in range(1, steps + 1) for node in lid]
        (tmp_path / f"{name}.csv").write_text("\n".join(["step,node,dx,dy,dz", *rows]) + "\n")
    ball, cells = shaken(icosphere(1), 0.05)
    surface.write("ball.ply", (ball * [1.0, 0.8, 1.3], cells.triangles))
    return tmp_path


def move(folder, *words, boundary="lid"):
    return main(["move", "box.vtu", folder, "--motion", f"{boundary}.csv", "--quiet", *words])


def flow(folder, *words, steps=STEPS):
    return main(["flow", "ball.ply", folder, "--steps", str(steps), "--quiet", *words])


RUNS = {"move": (move, MotionRun), "flow": (flow, FlowRun)}


def entries(folder, what):
    return [entry.attrib[what] for entry in ElementTree.parse(f"{folder}/run.pvd").iter("DataSet")]


def times(folder):
    return entries(folder, "timestep")


def steps_in_history(folder):
    with open(f"{folder}/history.csv", newline="") as file:
        return [int(row["step"]) for row in csv.DictReader(file)]


def same(folder, whole):
    assert times(folder) == times(whole)
    assert steps_in_history(folder) == steps_in_history(whole)
    for name in (
        "last.vtu",
        *(entry.attrib["file"] for entry in ElementTree.parse(f"{whole}/run.pvd").iter("DataSet")),
    ):
        mine, theirs = pv.read(f"{folder}/{name}"), pv.read(f"{whole}/{name}")
        np.testing.assert_array_equal(mine.points, theirs.points)
        for array in theirs.point_data:
            np.testing.assert_array_equal(mine.point_data[array], theirs.point_data[array])


def at_call(monkeypatch, owner, name, number, act):
    """Act at the n-th call of a method, before it."""
    method, calls = getattr(owner, name), []

    def counted(self, *words):
        calls.append(0)
        if len(calls) == number:
            act()
        return method(self, *words)

    monkeypatch.setattr(owner, name, counted)


def killed(run, *patch):
    """Run a command in another process, which kills itself at a call."""
    if not hasattr(os, "fork"):
        pytest.skip("no processes of this kind")
    child = os.fork()
    if child == 0:
        with pytest.MonkeyPatch.context() as patched:
            at_call(patched, *patch, lambda: os.kill(os.getpid(), signal.SIGKILL))
            run()
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL


@pytest.mark.parametrize("name", RUNS)
def test_a_run_killed_before_its_last_mesh_gets_it_from_the_checkpoint(name, here):
    run, kind = RUNS[name]
    assert run("whole", "--every", "3") == 0
    killed(lambda: run("run", "--every", "3"), kind, "write", 1)
    assert not (here / "run" / "last.vtu").exists()
    assert run("run", "--every", "3", "--resume") == 0
    same("run", "whole")


def test_a_run_that_was_made_longer_has_the_last_mesh_of_its_last_step(here):
    assert flow("whole", "--every", "2") == 0
    assert flow("run", "--every", "2", steps=3) == 0
    assert len(times("run")) == 3  # of steps 0, 2 and 3, where it ended
    killed(lambda: flow("run", "--every", "2", "--resume"), FlowRun, "write", 1)
    assert flow("run", "--every", "2", "--resume") == 0
    same("run", "whole")


@pytest.mark.parametrize("name", RUNS)
def test_no_row_is_lost_when_a_resumed_run_is_killed_at_once(name, here):
    run, _ = RUNS[name]
    assert run("whole") == 0
    killed(lambda: run("run"), HistoryFile, "add", 5)
    before = steps_in_history("run")
    killed(lambda: run("run", "--resume"), HistoryFile, "add", 1)
    assert steps_in_history("run") == before
    assert run("run", "--resume") == 0
    same("run", "whole")


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM", "SIGHUP"])
@pytest.mark.parametrize(("owner", "method"), [(Series, "add"), (HistoryFile, "add")])
def test_a_signal_during_writing_takes_effect_after_it(number, owner, method, here, monkeypatch, capsys):
    number = getattr(signal, number, None) or pytest.skip("no such signal")
    assert move("whole") == 0
    with pytest.MonkeyPatch.context() as patched:
        at_call(patched, owner, method, 3, lambda: os.kill(os.getpid(), number))
        assert move("run") == 130
    assert "--resume" in error_line(capsys)
    done = steps_in_history("run")
    assert done == [1, 2] if owner is Series else done == [1, 2, 3]
    assert move("run", "--resume") == 0
    same("run", "whole")


@pytest.mark.parametrize("step", [2, 3, 5])
def test_an_interrupted_run_has_the_series_of_the_whole(step, here, monkeypatch):
    assert move("whole", "--every", "3") == 0
    with pytest.MonkeyPatch.context() as patched:
        at_call(patched, MeshMotion, "_solve", step, lambda: os.kill(os.getpid(), signal.SIGINT))
        assert move("run", "--every", "3") == 130
    np.testing.assert_array_equal(  # not somewhere within a step
        pv.read("run/last.vtu").points[:, 2].max(), 1 + 0.03 * (step - 1)
    )
    assert move("run", "--every", "3", "--resume") == 0
    same("run", "whole")


def test_an_interruption_before_the_first_step_leaves_nothing_in_the_way(here, capsys):
    with pytest.MonkeyPatch.context() as patched:
        at_call(patched, Series, "add", 1, lambda: (_ for _ in ()).throw(KeyboardInterrupt))
        assert move("run") == 130
    assert "interrupted" in error_line(capsys)
    assert move("run") == 0


@pytest.mark.parametrize("command", ["regularize box.vtu out.vtu --max-iterations 1", "remesh ball.ply out.vtp"])
@pytest.mark.parametrize("number", ["SIGTERM", "SIGHUP"])
def test_a_signal_while_the_result_is_written(command, number, here, monkeypatch, capsys):
    number = getattr(signal, number, None) or pytest.skip("no such signal")
    from hexconformal.app.commands.results import job

    def written(*words):
        os.kill(os.getpid(), number)
        return write(*words)

    write = job._write_or_fall_back
    monkeypatch.setattr(job, "_write_or_fall_back", written)
    assert main([*command.split(), "--quiet"]) == 130
    out = command.split()[2]
    assert error_line(capsys).endswith(f"is in {out}\n")
    assert pv.read(out).n_points > 0


def test_signals_that_are_ignored_stay_so_and_others_get_their_handlers_back():
    if not hasattr(signal, "SIGHUP"):
        pytest.skip("no such signal")
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with interruptible(), uninterrupted():
            os.kill(os.getpid(), signal.SIGHUP)
        got = []
        signal.signal(signal.SIGHUP, lambda *words: got.append(words[0]))
        with uninterrupted(), uninterrupted():
            os.kill(os.getpid(), signal.SIGHUP)
            assert got == []
        assert got == [signal.SIGHUP]
        with interruptible(), pytest.raises(KeyboardInterrupt), uninterrupted():
            os.kill(os.getpid(), signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize(
    ("damage", "boundary", "said"),
    [
        (lambda run: None, "short", "the table must have the 7 steps that are done already, and more; it has 2"),
        (lambda run: None, "other", "the table must be that of the run up to step 7"),
        (lambda run: (run / "history.csv").unlink(), "lid", "cannot go on with the history"),
        (lambda run: (run / "history.csv").write_text("step,time\n1,1\n"), "lid", "another kind of run"),
        (lambda run: cut(run / "history.csv"), "lid", "steps without a row: 4 (ids 4, 5, 6, 7)"),
        (lambda run: (run / "history.csv").write_bytes(b"\xff\xfe\0"), "lid", "cannot go on with the history"),
        (lambda run: (run / "run.pvd").unlink(), "lid", "cannot go on with the series"),
        (lambda run: (run / "run.pvd").write_text("<VTKFile>"), "lid", "cannot go on with the series"),
        (lambda run: (run / "run_frames" / "run_0002.vtu").unlink(), "lid", "missing: 1 (run_frames/run_0002.vtu)"),
        (lambda run: (run / "run.pvd").write_text("<VTKFile/>"), "lid", "it lists no frames"),
        (lambda run: (run / "checkpoint.npz").write_bytes(b"x"), "lid", "cannot read the checkpoint"),
        (lambda run: without(run / "checkpoint.npz", "prescribed"), "lid", "is damaged (KeyError: 'prescribed')"),
        (lambda run: without(run / "checkpoint.npz", "problem"), "lid", "cannot read the checkpoint"),
    ],
)
def test_a_damaged_folder_or_another_table_is_a_clear_error(damage, boundary, said, here, capsys):
    assert move("run") == 0
    damage(here / "run")
    files = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
    assert move("run", "--resume", boundary=boundary) in (1, 2)
    assert said in error_line(capsys)
    assert {path: path.read_bytes() for path in here.rglob("*") if path.is_file()} == files


def cut(path):
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:4]))


def without(path, name):
    with np.load(path) as file:
        kept = {key: file[key] for key in file.files if key != name}
    np.savez(path, **kept)


def test_frames_that_are_kept_are_not_replaced(here):
    assert RunFolder(here / "run").frames.name == "run.pvd"
    assert move("run", "--every", "3") == 0
    assert times("run") == ["0.0", "3.0", "6.0", "7.0"]
    assert move("run", "--every", "6", "--resume") == 0
    assert times("run") == ["0.0", "6.0", "7.0"]
    heights = [
        pv.read(f"run/{entry.attrib['file']}").bounds[5] for entry in ElementTree.parse("run/run.pvd").iter("DataSet")
    ]
    np.testing.assert_allclose(heights, [1, 1.18, 1.21])
