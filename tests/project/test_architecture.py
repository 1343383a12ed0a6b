"""The rules of the house hold, and breaking one is noticed."""

import importlib.util
import shutil
import subprocess
import sys

import pytest
from paths import ROOT


@pytest.fixture(scope="module")
def architecture():
    """What reads the packages, and draws them."""
    spec = importlib.util.spec_from_file_location("architecture", ROOT / "docs" / "architecture.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["architecture"] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def source(tmp_path):
    """A copy of the source, to break."""
    return shutil.copytree(ROOT / "src", tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))


def test_the_rules_hold_and_the_picture_is_up_to_date():
    found = subprocess.run(
        [sys.executable, ROOT / "docs" / "architecture.py", "--check"], capture_output=True, text=True, check=False
    )
    assert found.returncode == 0, found.stderr


@pytest.mark.long
@pytest.mark.parametrize(
    ("place", "line", "told"),
    [
        ("kernel/threads.py", "from ..mesh import HexMesh", ("rooms import each other in a circle",)),
        (
            "kernel/threads.py",
            "from ..mesh import HexMesh",
            ("kernel imports hexconformal.mesh, but its",),
        ),
        ("mesh/arrays.py", "import surface", ("only hexconformal.app may know surface",)),
        (
            "mesh/arrays.py",
            "from ..elements.validity import is_valid",
            ("import it from hexconformal.elements",),
        ),
        ("energy/target.py", "from ..elements import DEPTH", ("DEPTH, which hexconformal.elements does not hand out",)),
        ("mesh/arrays.py", "from .hex_mesh import HexMesh", ("modules import each other in a circle",)),
        ("kernel/threads.py", "\n" * 400, ("hexconformal.kernel.threads has", "more than 350")),
    ],
)
def test_a_broken_rule_is_told(architecture, source, place, line, told):
    path = source / "hexconformal" / place
    path.write_text(path.read_text() + line + "\n")
    assert any(all(part in fault for part in told) for fault in architecture.faults(source))


@pytest.mark.long
def test_a_room_that_says_what_it_does_not_import_and_one_too_many_modules_are_told(architecture, source):
    package = source / "hexconformal" / "elements" / "__init__.py"
    package.write_text(package.read_text().replace("Imports `kernel`.", "Imports `kernel` and `common`."))
    for k in range(16):
        (source / "hexconformal" / "kernel" / f"spare_{k}.py").write_text('"""Spare."""\n')
    found = architecture.faults(source)
    assert "the docstring of hexconformal.elements says that it imports hexconformal.common, which it does not" in found
    assert any("hexconformal/kernel has" in fault for fault in found)
