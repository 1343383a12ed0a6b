"""Rooms that are loaded when one of their names is asked for: the package hands out the same as if it had them all."""

import ast
import subprocess
import sys
from importlib import import_module

import pytest

import hexconformal
import surface

PACKAGES = pytest.mark.parametrize("package", [hexconformal, surface], ids=lambda package: package.__name__)


def imported(package):
    """The names that the source of a package imports from its rooms, for type checkers too, with the room of each."""
    with open(package.__file__, encoding="utf-8") as file:
        found = [node for node in ast.walk(ast.parse(file.read())) if isinstance(node, ast.ImportFrom) and node.level]
    return {alias.name: node.module for node in found for alias in node.names}


@PACKAGES
def test_what_type_checkers_see_is_what_there_is(package):
    names = imported(package)
    assert set(package.__all__) - {"__version__"} <= set(names)
    for name in package.__all__:
        if names[name] is None:
            assert getattr(package, name) is import_module(f"{package.__name__}.{name}")
        else:
            assert getattr(package, name) is getattr(import_module(f"{package.__name__}.{names[name]}"), name)


@PACKAGES
def test_other_names_are_refused_as_usual(package):
    with pytest.raises(AttributeError, match=f"module '{package.__name__}' has no attribute 'regularise'"):
        package.regularise  # noqa: B018
    assert not hasattr(package, "regularise")


def test_a_room_is_loaded_when_it_is_asked_for():
    code = """
import sys
import hexconformal, surface
def later():
    rooms = {"regularization", "motion", "runs", "formulation", "solver", "remeshing", "flow", "constraint"}
    return {name.partition(".")[2] for name in sys.modules if name.startswith(("hexconformal.", "surface."))} & rooms
assert not later(), later()
hexconformal.Options
assert "regularization" in later()
surface.remesh
assert "remeshing" in later()
assert not {"motion", "flow"} & later()
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=False)
    assert ran.returncode == 0, ran.stderr
