"""What a command loads: libraries that take long to load only where they are needed."""

import subprocess
import sys

import pytest

import hexconformal as hc
from hexconformal.generate import box

HEAVY = {"h5py", "matplotlib", "meshio", "mpi4py", "netCDF4", "numba", "pyamg", "pyvista", "rich", "vtk", "vtkmodules"}
CODE = """
import sys
from hexconformal.app import main
main({words!r})
print("loaded", *{heavy!r} & {{name.partition(".")[0] for name in sys.modules}}, *(
    name for name in ("scipy.sparse", "surface", "hexconformal.generate", "hexconformal.solver") if name in sys.modules
))
"""


def loaded_by(*words):
    code = CODE.format(words=words, heavy=HEAVY)
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True)
    return set(ran.stdout.splitlines()[-1].split()[1:])


@pytest.mark.parametrize(
    "words", [("--help",), ("--version",), ("quality", "--help"), ("check", "--help")], ids=" ".join
)
def test_help_loads_no_library_but_numpy(words):
    assert loaded_by(*words) == set()


def test_importing_loads_no_library_but_numpy():
    code = f"import sys, hexconformal; print(*{HEAVY!r} & set(sys.modules))"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True)
    assert ran.stdout.split() == []


def test_measuring_a_vtu_file_takes_vtk_and_numba_alone(tmp_path):
    hc.write(tmp_path / "box.vtu", hc.HexMesh(*box((2, 2, 2)), cell_data={"material": [1, 2] * 4}))
    assert loaded_by("quality", str(tmp_path / "box.vtu")) == {"numba", "vtkmodules"}
