"""The program on ranks: results, what is refused before the work, failures and interruptions."""

import json
import time
from pathlib import Path

import pytest
import pyvista as pv
from program import run

from hexconformal import HexMesh, generate, quality, write

PROGRAMS = Path(__file__).with_name("programs")
LIMITS = "--boundary fixed --emphasis mean --gradient-tolerance 1e-10"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    points, cells = generate.jittered(*generate.twisted_cube(6), 0.1, seed=1)
    write("part.vtu", HexMesh(points, cells, {"height": points[:, 2]}, {"number": range(len(cells))}))
    return tmp_path


def program(words):
    return ["-m", "hexconformal", *words.split()]


def test_a_file_is_regularized_and_measured_as_in_one_process(mpiexec, folder):
    words = f"--mpi {LIMITS} --report ranks.json --history ranks.csv"
    said = mpiexec(3, *program(f"regularize part.vtu better.pvtu {words}")).stdout
    assert said.count("216 cells") == said.count("wrote better.pvtu") == 1
    assert run(f"regularize part.vtu better.vtu {LIMITS} --report one.json") == 0
    ranks, one = (json.loads(Path(name).read_text()) for name in ("ranks.json", "one.json"))
    for measure in ("scaled_jacobian", "shape", "minimum_jacobian"):
        for figure in ("min", "mean", "max"):
            assert ranks["after"][measure][figure] == pytest.approx(one["after"][measure][figure], rel=1e-6)
    assert Path("ranks.csv").read_text().count("\n") == ranks["iterations"] + 2
    whole = pv.read("better.pvtu")
    assert whole.n_cells == 216
    assert {"height", "moved_by", "GlobalNodeId"} <= set(whole.point_data)
    assert {"number", "scaled_jacobian", "GlobalCellId"} <= set(whole.cell_data)
    assert (whole.cell_data["number"] == whole.cell_data["GlobalCellId"]).all()
    # Measured on another number of ranks.
    told = json.loads(mpiexec(2, *program("quality better.pvtu --mpi --json - --out measured.pvtu")).stdout)
    own = quality("better.vtu").summary()
    assert told["count"] == own.count
    assert told["scaled_jacobian"]["min"] == pytest.approx(own.scaled_jacobian.min, rel=1e-6)
    assert told["worst"][0]["scaled_jacobian"] == pytest.approx(own.worst[0].scaled_jacobian, rel=1e-6)
    assert (pv.read("measured.pvtu").cell_data["valid"] == 1).all()


def test_arrays_are_kept_where_the_first_rank_has_nothing(mpiexec, folder):
    Path("sub").mkdir()
    mpiexec(1, *program("quality part.vtu --out sub/one.pvtu --mpi"))
    mpiexec(3, *program("quality sub/one.pvtu --out three.pvtu --mpi"))  # the piece goes to the last rank
    assert not Path("three_0000.vtu").exists()
    told = Path("three.pvtu").read_text()
    for name in ("height", "number", "scaled_jacobian", "GlobalNodeId", "GlobalCellId"):
        assert f'Name="{name}"' in told, name


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("regularize part.vtu better.pvtu --constraint compatible", "cannot keep the compatible constraint yet"),
        ("regularize part.vtu better.pvtu --surface part.vtu", "cannot slide on another surface yet"),
        ("regularize part.vtu better.vtu --boundary fixed", "unknown extension .vtu"),
        ("regularize part.vtu better.pvtu --plot a.png", "--plot must go without --mpi"),
        ("regularize part.vtu better.pvtu --boundary soap", "boundary must be"),
        ("quality part.vtu --threads 0", "threads must be a positive number"),
        ("quality part.vtu --worst -1", "worst must be 0 or more"),
        ("quality nowhere.vtu", "nowhere.vtu does not exist"),
    ],
)
def test_what_is_not_there_is_said_once_before_the_work(mpiexec, folder, words, message):
    said = mpiexec(2, *program(f"{words} --mpi"), fails=True).stderr
    assert said.count(message) == 1, said
    assert "Traceback" not in said
    assert not list(folder.glob("better*"))


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("room", "which may get 20 cells, not the 125 at kept faces"),
        ("no such array", "must be 'auto', 'ignore' or an array on cells, not 'phase'; there are: kind"),
        ("no integers on a rank", "interfaces must be one integer for each"),
        ("too few numbers on a rank", "on rank 1: interfaces must be one integer for each of the 48 cells"),
        ("named", ""),
    ],
)
def test_what_cannot_be_done_is_refused_on_all_ranks(results, what, message):
    said = results("refused", 3)[what]
    assert [message in one for one in said] == [True] * 3, said
    assert bool(message) == bool(said[0])


def test_a_rank_that_fails_ends_all_with_its_message(mpiexec, folder):
    began = time.monotonic()
    words = f"regularize part.vtu better.pvtu --mpi {LIMITS}".split()
    said = mpiexec(3, PROGRAMS / "failing.py", *words, fails=True).stderr
    assert "error on rank 1: RuntimeError: the disk of this node is gone" in said
    assert time.monotonic() - began < 200
    assert not Path("better.pvtu").exists()


def test_a_signal_to_one_rank_leaves_the_last_valid_mesh(mpiexec, folder):
    words = f"regularize part.vtu better.pvtu --mpi {LIMITS} --report report.json".split()
    said = mpiexec(3, PROGRAMS / "interrupted.py", *words, fails=True).stderr
    assert "interrupted: the mesh of iteration 2 is in better.pvtu" in said
    report = json.loads(Path("report.json").read_text())
    assert (report["iterations"], report["reason"], report["converged"]) == (2, "interrupted", False)
    assert report["after"]["invalid"] == 0
    assert report["after"]["conformal_distortion"]["mean"] < report["before"]["conformal_distortion"]["mean"]
    assert pv.read("better.pvtu").n_cells == 216


def test_a_signal_to_one_rank_ends_all_where_there_is_nothing_to_keep(mpiexec, folder):
    # As the program is started, not by mpi4py, which ends all ranks by itself.
    words = ["quality", "part.vtu", "--out", "measured.pvtu", "--mpi"]
    said = mpiexec(3, PROGRAMS / "interrupted_early.py", *words, fails=True, module=(), timeout=100).stderr
    assert "interrupted: what was not complete was not written" in said
    assert not list(folder.glob("measured*"))
