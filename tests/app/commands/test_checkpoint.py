"""`regularize --checkpoint`: a run that was killed or interrupted goes on, and none is lost by accident."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from program import error_line, history, interrupted, run

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements import is_valid

WORDS = "regularize part.vtu better.vtu --quiet --checkpoint run.npz"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mesh = generate.jittered(*generate.cylinder(5, 4, 8), 0.35, seed=4)
    hc.write("part.vtu", hc.HexMesh(*mesh))
    return tmp_path


def killed(folder, words, lines):
    """SIGKILL once there is a checkpoint, and the history has so many lines."""
    program = subprocess.Popen([sys.executable, "-m", "hexconformal", *words.split()], cwd=folder)
    rows, until = folder / "run.csv", time.monotonic() + 100
    while time.monotonic() < until and program.poll() is None:
        if (folder / "run.npz").exists() and rows.exists() and rows.read_text().count("\n") >= lines:
            break
        time.sleep(0.005)
    program.send_signal(signal.SIGKILL)
    return program.wait()


def scaled_jacobian(name):
    return json.loads(Path(name).read_text())["after"]["scaled_jacobian"]


@pytest.mark.long
def test_a_run_that_is_killed_goes_on_and_ends_as_one_that_was_not(folder):
    assert killed(folder, f"{WORDS} --history run.csv", 5) == -signal.SIGKILL
    assert not (folder / "better.vtu").exists()
    with np.load("run.npz") as file:
        before, reached = hc.read("part.vtu"), file["points"]
    assert (reached != before.points).any()
    assert is_valid(reached, before.cells).all()
    assert run(f"{WORDS} --resume --history run.csv --report resumed.json") == 0
    assert [row["phase"] for row in history("run.csv")[:2]] == ["input", "start"]
    assert run("regularize part.vtu whole.vtu --quiet --report whole.json") == 0
    one, other = scaled_jacobian("whole.json"), scaled_jacobian("resumed.json")
    assert other["min"] == pytest.approx(one["min"], abs=5e-3)
    assert other["mean"] == pytest.approx(one["mean"], abs=1e-3)
    after = hc.read("better.vtu")
    assert is_valid(after.points, after.cells).all()
    # What it came to is kept as well: a run from there gains next to nothing.
    with np.load("run.npz") as file:
        assert np.array_equal(file["points"], after.points)
    assert run(f"{WORDS} --resume --report again.json") == 0
    assert scaled_jacobian("again.json")["min"] == pytest.approx(other["min"], abs=2e-3)


def test_what_an_interruption_leaves_is_kept_too(folder):
    interrupted(folder, WORDS, signal.SIGTERM, 4)
    with np.load("run.npz") as file:
        assert np.array_equal(file["points"], hc.read("better.vtu").points)
    assert run(f"{WORDS} --resume --report report.json") == 0
    report = json.loads((folder / "report.json").read_text())
    assert "begun where an earlier run had come to" in report["notes"]
    assert report["converged"]


def test_without_a_checkpoint_a_run_begins_with_the_input(folder):
    assert run(f"{WORDS} --resume --max-iterations 2 --history run.csv") == 0
    assert [row["phase"] for row in history("run.csv")][:2] == ["input", "thicken"]
    assert (folder / "run.npz").exists()


def test_no_run_is_lost_by_accident(folder, capsys):
    assert run(f"{WORDS} --max-iterations 2") == 0
    kept = (folder / "run.npz").read_bytes()
    for words, said in (
        (WORDS, "run.npz holds a run: --resume goes on with it, --overwrite starts anew"),
        (f"{WORDS} --resume --hausdorff 0.01", "run.npz belongs to another mesh, or a run with other options"),
        ("regularize part.vtu better.vtu --resume", "--resume must go with --checkpoint"),
        ("regularize part.vtu better.vtu --checkpoint better.vtu --overwrite", "better.vtu is an output already"),
        ("regularize part.vtu better.vtu --checkpoint part.vtu", "part.vtu is the input already"),
        (f"{WORDS} --resume --surface part.stl", "without another surface to slide on"),
    ):
        assert run(words) == 2, words
        assert said in error_line(capsys)
        assert (folder / "run.npz").read_bytes() == kept
    (folder / "run.npz").write_bytes(kept[: len(kept) // 2])
    assert run(f"{WORDS} --resume") == 1
    assert "cannot read the checkpoint run.npz" in error_line(capsys)
    assert run(f"{WORDS} --overwrite --max-iterations 1") == 0
    assert len((folder / "run.npz").read_bytes()) == len(kept)
