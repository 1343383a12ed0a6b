"""The command line as a whole: help, usage, errors in one line, the version."""

import subprocess
import sys

import pytest
import pyvista as pv
from program import error_line, run

import hexconformal as hc
from hexconformal.app.cli import main


def run_program(*words, **options):
    return subprocess.run(
        [sys.executable, "-m", "hexconformal", *words], capture_output=True, text=True, timeout=120, **options
    )


@pytest.mark.parametrize("command", ["regularize", "quality", "orient", "check", "demo"])
def test_help_has_examples(command, capsys):
    assert main([command, "--help"]) == 0
    said = capsys.readouterr().out
    assert f"examples:\n  hexconformal {command}" in said


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ("regularize missing.vtu out.vtu", 1, "missing.vtu does not exist"),
        ("regularize part.vtu nowhere/out.vtu", 1, "the folder"),
        ("regularize part.vtu out.xyz", 1, "unknown extension .xyz"),
        ("regularize part.vtu out.vtu --history nowhere/run.csv", 1, "nowhere/run.csv"),
        ("regularize part.vtu out.vtu --frames run.vtu", 1, "known are .pvd"),
        ("regularize part.vtu out.vtu --plot q.doc", 1, "unknown extension .doc"),
        ("regularize part.vtu out.vtu --plot part.vtu", 2, "part.vtu is the input"),
        ("regularize part.vtu out.vtu --report x --history x", 2, "x is an output already"),
        ("regularize part.vtu out.vtu --boundary slippery", 2, "'slide', 'fixed' or 'free', not 'slippery'"),
        ("regularize part.vtu out.vtu --fixed walls", 2, "names no point array"),
        ("regularize part.vtu out.vtu --target 1:2", 2, "target"),
        ("regularize part.vtu out.vtu --energy quaternionic --emphasis worst", 2, "quaternionic"),
        ("regularize part.vtu out.vtu --every 0", 2, "every"),
        ("regularize part.vtu out.vtu --hausdorff 2", 2, "hausdorff"),
        ("regularize part.vtu out.vtu --features sharp", 2, "'auto', 'keep' or 'soft', not 'sharp'"),
        ("regularize part.vtu out.vtu --surface missing.stl", 1, "missing.stl does not exist"),
        ("regularize part.vtu out.vtu --surface broken.vtu", 1, "cannot read broken.vtu"),
        ("regularize part.vtu out.vtu --surface part.vtu --conserve-volume", 2, "conserve_volume must go with"),
        ("regularize part.vtu out.vtu --surface part.vtu --boundary fixed", 2, "surface must go with boundary='slide'"),
        ("regularize part.vtu out.vtu --surface part.vtu --hausdorff 0", 2, "surface must go with boundary='slide'"),
        ("regularize part.vtu out.vtu --worst-picture part.vtu", 2, "part.vtu is the input"),
        ("regularize part.vtu out.xdmf", 1, "its companion out.h5 belongs to another file"),
        ("regularize tets.vtu out.vtu", 1, "tetra"),
        ("regularize broken.vtu out.vtu", 1, "cannot read broken.vtu"),
        ("quality missing.vtu", 1, "missing.vtu does not exist"),
        ("quality part.vtu --worst -1", 2, "worst"),
        ("quality part.vtu --out part.vtu", 2, "--overwrite"),
        ("quality part.vtu --picture worst.doc", 1, "unknown extension .doc"),
        ("quality part.vtu --picture worst.png --worst 0", 2, "count must be 1 or more"),
        ("orient part.vtu part.vtu", 2, "--overwrite"),
        ("check missing.vtu", 1, "missing.vtu does not exist"),
        ("demo part.vtu", 1, "cannot make the folder part.vtu"),
        ("demo --size 1", 2, "size must be 2 to 1000"),
        ("demo --size 99999999999999999999", 2, "size must be 2 to 1000"),
        ("regularize part.vtu out.vtu --max-iterations 99999999999999999999", 2, "max_iterations must be at most"),
        ("regularize part.vtu out.vtu/", 1, "cannot write out.vtu/: this is the name of a folder"),
        ("quality part.vtu --json q.json/", 1, "cannot write q.json/: this is the name of a folder"),
    ],
)
def test_errors_are_one_readable_line(here, capsys, words, code, said):
    pv.Sphere().delaunay_3d().save("tets.vtu")
    (here / "out.h5").write_bytes(b"of another file")
    (here / "broken.vtu").write_bytes((here / "part.vtu").read_bytes()[:-900])
    files = {path: path.read_bytes() for path in here.iterdir() if path.is_file()}
    assert run(words) == code
    line = error_line(capsys)
    assert line.startswith("error: ")
    assert said in line
    # Nothing was begun, nothing was lost.
    assert {path: path.read_bytes() for path in here.iterdir() if path.is_file()} == files


@pytest.mark.parametrize("words", [[], ["polish"], ["regularize", "part.vtu"], ["check", "part.vtu", "--loud"]])
def test_wrong_usage_ends_with_2(words, capsys):
    assert main(words) == 2
    assert "usage: hexconformal" in capsys.readouterr().err


def test_no_other_command_is_loaded():
    code = """
import sys
from hexconformal.app.cli import main, parser
main(["--help"])
main(["quality", "missing.vtu"])
heavy = {"hexconformal.regularization", "hexconformal.motion", "surface.remeshing", "surface.flow", "pyvista", "rich"}
heavy |= {"numba", "hexconformal.ranks", "hexconformal.geometry", "surface"}
assert not heavy & set(sys.modules), heavy & set(sys.modules)
assert parser("quality").format_usage() == parser().format_usage()
assert "hexconformal.motion" in sys.modules
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert (ran.returncode, ran.stderr) == (0, "error: missing.vtu does not exist\n")


def test_version_and_module_entry():
    done = run_program("--version")
    assert (done.returncode, done.stdout) == (0, f"hexconformal {hc.__version__}\n")


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        ("regularise a.vtu b.vtu", "did you mean regularize?"),
        ("regularize a.vtu b.vtu --hausdorf .01", "did you mean --hausdorff?"),
        ("quality a.vtu --plt=p.png", "did you mean --plot?"),
        ("quality a.vtu --unheard-of", ""),
    ],
)
def test_a_misspelt_word_is_answered_with_what_may_be_meant(capsys, words, meant):
    assert main(words.split()) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.endswith(meant)
    assert ("did you mean" in line) == bool(meant)
