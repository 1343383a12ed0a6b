"""No code from the current folder is run: what came with a mesh may be there."""

import os
import signal
import subprocess
import sys

import pytest

import hexconformal as hc
from hexconformal.common import run_python
from hexconformal.generate import box, jittered

PROGRAM = (
    "import sys; sys.path[:] = sys.argv.pop(1).split(chr(10)); from hexconformal.app import main; sys.exit(main())"
)
TRAPS = ("vtkmodules", "vtk", "numpy", "pyvista", "meshio", "h5py", "netCDF4", "matplotlib", "resource", "site", "os")
TRAPS += ("sitecustomize", "usercustomize", "encodings", "re", "hexconformal")


@pytest.fixture
def trapped(tmp_path):
    """A folder with a mesh, and with modules that leave a mark when they are imported."""
    points, cells = jittered(*box((2, 2, 2)), 0.2)
    hc.write(tmp_path / "part.vtk", hc.HexMesh(points, cells))
    for name in TRAPS:
        (tmp_path / f"{name}.py").write_text(f'open({str(tmp_path / "mark")!r}, "a").write("{name} ")\n')
    (tmp_path / ".numba_config.yaml").write_text(f"cache_dir: {tmp_path / 'machine_code'}\n")
    return tmp_path


def run(folder, *words, as_module=False):
    if as_module:
        paths = os.pathsep.join(path for path in sys.path if os.path.isabs(path))
        command = [sys.executable, "-m", "hexconformal", *words]
        environment = {**os.environ, "PYTHONPATH": paths}
        return subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
        )
    # As the installed program is: its own folder is the first to import from, the current one is none.
    paths = "\n".join(path for path in sys.path if os.path.isabs(path))
    command = [sys.executable, "-I", "-c", PROGRAM, paths, *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.long
@pytest.mark.parametrize(
    "words", ["check part.vtk", "regularize part.vtk out.vtu --max-iterations 1 --picture both.png", "demo --size 3"]
)
def test_modules_in_the_current_folder_are_not_run(trapped, words):
    ran = run(trapped, *words.split())
    assert not (trapped / "mark").exists(), (trapped / "mark").read_text()
    assert not (trapped / "machine_code").exists()
    assert ran.returncode == 0 or "graphics driver" in ran.stderr, ran.stderr


def test_nor_by_python_m(trapped):
    for name in ("site", "os", "sitecustomize", "usercustomize", "encodings", "re", "hexconformal"):
        (trapped / f"{name}.py").unlink()  # Python itself imports these before the program can prevent it
    ran = run(trapped, "check", "part.vtk", as_module=True)
    assert not (trapped / "mark").exists(), (trapped / "mark").read_text()
    assert ran.returncode == 0, ran.stderr


def test_a_child_has_the_modules_of_its_parent_but_those_of_the_current_folder(trapped, monkeypatch):
    monkeypatch.chdir(trapped)
    monkeypatch.setattr(sys, "path", [str(trapped), "", *sys.path])
    assert run_python("import vtkmodules.vtkIOLegacy, numpy, os") == 0
    assert not (trapped / "mark").exists()


def test_a_child_is_ended_in_time_and_gets_so_much_memory():
    assert run_python("while True: pass", seconds=0.5) is None
    assert run_python("import os; os.abort()") == -signal.SIGABRT
    pytest.importorskip("resource")
    assert run_python("bytes(1 << 30)", memory=1 << 29) == 1
    assert run_python("bytes(1 << 27)", memory=1 << 29) == 0
