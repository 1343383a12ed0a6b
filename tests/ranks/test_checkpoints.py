"""Checkpoints by rank: any number of ranks goes on from them, they are whole or not taken, and know their mesh."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from program import run

from hexconformal import HexMesh, Options, generate, quality, read, write
from hexconformal.regularization import Checkpoint

PROGRAMS = Path(__file__).with_name("programs")
LIMITS = "--boundary fixed --emphasis mean --gradient-tolerance 1e-10"
KEPT = "--checkpoint run.npz"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("part.vtu", HexMesh(*generate.jittered(*generate.twisted_cube(6), 0.1, seed=1)))
    return tmp_path


def program(words):
    return ["-m", "hexconformal", *words.split()]


def measures(name):
    after = json.loads(Path(name).read_text())["after"]
    return [after[measure][figure] for measure in ("scaled_jacobian", "shape") for figure in ("min", "mean")]


def test_two_ranks_leave_what_three_and_one_process_go_on_with(mpiexec, folder):
    words = f"regularize part.vtu better.pvtu --mpi {LIMITS} {KEPT}"
    mpiexec(2, PROGRAMS / "interrupted.py", *words.split(), fails=True)
    files = sorted(path.name for path in folder.glob("run*.npz"))
    assert files[0] == "run.npz"
    assert [re.fullmatch(r"run_[01]_000[01].npz", name) is not None for name in files[1:]] == [True, True]
    reached = read("better.pvtu")
    for name in files:
        shutil.copy(name, f"kept_{name}")
    # Each node is in one part, at the place where the mesh that was written has it.
    parts = [np.load(name) for name in files[1:]]
    ids = np.concatenate([part["ids"] for part in parts])
    assert len(np.unique(ids)) == len(ids) == len(reached.points)
    assert min(len(part["ids"]) for part in parts) > 0.4 * len(ids)
    order = np.argsort(reached.point_data["GlobalNodeId"])
    assert np.array_equal(np.concatenate([part["points"] for part in parts])[np.argsort(ids)], reached.points[order])
    for part in parts:
        part.close()

    assert run(f"regularize part.vtu whole.vtu {LIMITS} --report whole.json --quiet") == 0
    mpiexec(3, *program(f"{words} --resume --report three.json --history three.csv"))
    assert [line.split(",")[1] for line in Path("three.csv").read_text().splitlines()[1:3]] == ["input", "start"]
    assert len(list(folder.glob("run_*.npz"))) == 3
    assert "begun where an earlier run had come to" in json.loads(Path("three.json").read_text())["notes"]
    for path in folder.glob("run*.npz"):
        path.unlink()
    for name in files:
        shutil.copy(f"kept_{name}", name)
    assert run(f"regularize part.vtu one.vtu {LIMITS} {KEPT} --resume --report one.json --quiet") == 0
    assert [path.name for path in folder.glob("run*.npz")] == ["run.npz"]
    for name in ("three.json", "one.json"):
        assert measures(name) == pytest.approx(measures("whole.json"), rel=1e-6)
    assert "begun where an earlier run had come to" in json.loads(Path("one.json").read_text())["notes"]


def test_a_set_that_is_not_whole_is_not_taken(mpiexec, folder):
    words = f"regularize part.vtu better.pvtu --mpi {LIMITS} {KEPT}"
    mpiexec(2, PROGRAMS / "torn.py", *words.split(), fails=True)
    # The second set is there, and a part of the third, which took the name of one of the first.
    assert sorted(path.name for path in folder.glob("run_*.npz")) == [
        "run_0_0000.npz",
        "run_0_0001.npz",
        "run_1_0000.npz",
    ]
    shutil.copy("run_1_0000.npz", "later.npz")
    shutil.copy("run_0_0000.npz", "first.npz")
    said = mpiexec(2, *program(words), fails=True).stderr
    assert said.count("run.npz holds a run: --resume goes on with it, --overwrite starts anew") == 1
    shutil.copy("later.npz", "run_0_0000.npz")
    said = mpiexec(2, *program(f"{words} --resume"), fails=True).stderr
    assert "the checkpoint run_0_0000.npz belongs to another set than run.npz names" in said
    assert run(f"regularize part.vtu one.vtu {LIMITS} {KEPT} --resume --quiet") == 2
    assert run(f"regularize part.vtu one.vtu {LIMITS} {KEPT} --hausdorff 0.01 --resume --quiet") == 2
    shutil.copy("first.npz", "run_0_0000.npz")
    mpiexec(3, *program(f"{words} --resume --report three.json"))
    assert run(f"regularize part.vtu whole.vtu {LIMITS} --report whole.json --quiet") == 0
    assert measures("three.json") == pytest.approx(measures("whole.json"), rel=1e-6)
    assert quality("better.pvtu").valid.all()


RANKS = (1, 2, 3)


def test_a_mesh_is_the_same_on_any_ranks_that_have_it(results, tmp_path):
    found = [results("starts", ranks) for ranks in RANKS]
    points, cells = generate.jittered(*generate.ball(3, 2), 0.2, seed=1)
    known = Checkpoint(tmp_path / "run.npz", (points, cells), Options()).fingerprint
    for one in found:
        assert one["dealt out"] == one["on the last"] == known
        assert known not in (one["moved"], one["turned"])
    assert len({str(one["moved"]) for one in found}) == len({str(one["turned"]) for one in found}) == 1


@pytest.mark.parametrize("ranks", RANKS)
def test_runs_begin_where_they_are_told_or_say_why_not_on_all_ranks(results, ranks):
    found = results("starts", ranks)
    for name in ("points", "reached"):
        assert found[f"{name}, energy"] == pytest.approx(1.0, rel=1e-9)
        assert found[f"{name}, away"] < 1e-12
    assert found["refused: apart"][0] == "" or ranks > 1  # one rank has no copies
    for name, said in (
        ("few", "OptionError: .*start must be the .* points of the piece"),
        ("held", rf"MeshError: .*nodes that are held are not where the mesh has them: 1 \(ids {found['outer']}\)"),
        ("turned", "MeshError: .*start: cells that are valid in the mesh are not"),
        ("far", "MeshError: start: the surface is .* more than hausdorff = 0.005 allows"),
        ("nan", "MeshError: .*start: points with NaN"),
        ("apart", rf"OptionError: .*copies of a node must be at one place .*: 1 \(ids {found['inner']}\)"),
        ("not everywhere", rf"OptionError: .*copies of a node must be at one place .*: 1 \(ids {found['inner']}\)"),
        ("boundary", "OptionError: .*boundary must be the same on all ranks, not 'fixed', and 'slide' on rank 0"),
        ("none on a rank", "OptionError: .*start must be the same on all ranks, not an array, and None on rank 0"),
    )[: None if ranks > 1 else 5]:  # the others are of several ranks
        assert [re.match(said, one) is not None for one in found[f"refused: {name}"]] == [True] * ranks, name
