"""The program as others find it: closed streams, terminals that know ASCII only, names with escape sequences, modes."""

import os
import stat
import subprocess
import sys

import numpy as np
import pytest
import pyvista as pv

import hexconformal as hc
from hexconformal.app.cli import main
from hexconformal.app.terminal import printable
from hexconformal.generate import box, jittered

ESCAPES = "\x1b[31m\x1b]0;title\x07\u202egnp\x9b"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    points, cells = jittered(*box((2, 2, 2)), 0.2)
    hc.write("part.vtu", hc.HexMesh(points, cells))
    return tmp_path


def program(words, redirections="", **environment):
    line = f'exec "{sys.executable}" -m hexconformal {words} {redirections}'
    environment = {**os.environ, **environment}
    return subprocess.run(["sh", "-c", line], capture_output=True, timeout=120, check=False, env=environment)


@pytest.mark.long
@pytest.mark.skipif(os.name != "posix", reason="streams of another kind")
@pytest.mark.parametrize("words", ["check part.vtu", "check missing.vtu", "--version", "regularize part.vtu out.vtu"])
@pytest.mark.parametrize("streams", [">&-", "2>&-", "<&- >&- 2>&-", ">/dev/full", "2>/dev/full"])
def test_streams_that_are_closed_or_full(words, streams, here):
    if "full" in streams and not os.path.exists("/dev/full"):
        pytest.skip("no such device")
    ran = program(f"{words} --max-iterations 1" if "regularize" in words else words, streams, PYTHONUNBUFFERED="")
    expected = 1 if words == "check missing.vtu" or streams == ">/dev/full" else 0
    assert ran.returncode == expected, ran.stderr
    assert b"Traceback" not in ran.stderr
    assert ran.stderr.count(b"\n") <= 1 or "regularize" in words
    if "regularize" in words:
        assert len(hc.read("out.vtu").cells) == 8  # nothing was printed into it


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_terminals_of_few_letters(encoding, here):
    os.rename("part.vtu", "größe_☃.vtu")
    ran = program("check größe_☃.vtu", PYTHONIOENCODING=encoding)
    assert ran.returncode == 0, ran.stderr
    assert b"\\u2603.vtu: 8 hexahedra" in ran.stdout
    ran = program("check fehlt_☃.vtu", PYTHONIOENCODING=encoding)
    assert ran.returncode == 1
    assert b"\\u2603.vtu does not exist" in ran.stderr


def test_names_are_printed_without_what_a_terminal_obeys(here, capsys):
    assert printable(ESCAPES) == "\\x1b[31m\\x1b]0;title\\x07\\u202egnp\\x9b"
    grid = pv.read("part.vtu")
    grid.cell_data["a\x1b[2J"] = np.arange(8.0)
    name = f"{ESCAPES}\nnote.vtu"
    grid.save("array.vtu")
    os.rename("part.vtu", name)
    for words in (
        ["check", name],
        ["quality", name],
        ["regularize", name, f"{ESCAPES}.vtu", "--max-iterations", "1"],
        ["regularize", name, f"out{ESCAPES}.inp", "--max-iterations", "1"],
        ["regularize", "array.vtu", "array.inp", "--max-iterations", "1"],
        ["regularize", name, "out.vtu", "--sizes", ESCAPES],
        ["regularize", name, "out.vtu", "--boundary", ESCAPES],
        ["check", f"missing{ESCAPES}.vtu"],
        ["check", f"missing{ESCAPES}.xyz\x1b"],
        ["orient", name, f"turned{ESCAPES}.vtu"],
        [ESCAPES],
        ["check", name, f"--{ESCAPES}"],
    ):
        main(words)
        said = "".join(capsys.readouterr())
        assert said
        assert not set(said) & {"\x1b", "\x07", "\x9b", "\u202e"}, words
        assert "\nnote.vtu" not in said


@pytest.mark.skipif(os.name != "posix", reason="modes of another kind")
def test_modes_are_those_of_any_program(here):
    before = os.umask(0o027)
    try:
        outputs = "--history a.csv --report a.json --frames a.pvd"
        assert main(f"regularize part.vtu out.vtu --max-iterations 1 {outputs} --quiet".split()) == 0
        made = [path for path in here.rglob("*") if path.name != "part.vtu"]
        assert {oct(stat.S_IMODE(path.stat().st_mode)) for path in made if path.is_file()} == {"0o640"}
        assert {oct(stat.S_IMODE(path.stat().st_mode)) for path in made if path.is_dir()} == {"0o750"}
        # One that is replaced keeps who may read it.
        (here / "out.vtu").chmod(0o604)
        assert main(["orient", "part.vtu", "out.vtu"]) == 0
        assert stat.S_IMODE((here / "out.vtu").stat().st_mode) == 0o604
    finally:
        os.umask(before)


LIMITED = """
import resource, sys
from hexconformal.app.cli import main
import meshio, pyvista, vtkmodules.vtkIOXML
main("regularize part.vtu out.vtu --max-iterations 1 --quiet".split())
with open("/proc/self/statm") as file:
    used = int(file.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + int(sys.argv[1]) * 2**20,) * 2)
sys.exit(main(sys.argv[2:]))
"""


@pytest.mark.long
@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="memory is told elsewhere")
@pytest.mark.parametrize("megabytes", [1, 30, 60, 120, 200])
def test_little_memory_is_told_in_a_line(megabytes, here):
    points, cells = box((90, 90, 90))
    hc.write("large.vtu", hc.HexMesh(points, cells))
    words = [sys.executable, "-c", LIMITED, str(megabytes), "check", "large.vtu"]
    ran = subprocess.run(words, capture_output=True, text=True, timeout=300, check=False)
    assert ran.returncode == 1
    assert "memory" in ran.stderr
    assert ran.stderr.count("\n") == 1, ran.stderr
