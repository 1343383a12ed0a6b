"""The notebooks of the examples run from top to bottom, and come without outputs."""

import ast
import json
import shutil
import sys
from pathlib import Path
from types import ModuleType

import pytest
from paths import ROOT

NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))


def code_cells(path):
    notebook = json.loads(path.read_text(encoding="utf-8"))
    return [(cell, "".join(cell["source"])) for cell in notebook["cells"] if cell["cell_type"] == "code"]


@pytest.fixture
def shown(monkeypatch):
    """Pictures that a notebook shows, as a list that grows; IPython itself is not needed."""
    pictures = []
    display = ModuleType("IPython.display")
    display.Image = lambda filename: pictures.append(Path(filename).read_bytes())
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    return pictures


@pytest.fixture
def beside_data(tmp_path, monkeypatch):
    """A folder like that of the examples, with the data next to it."""
    shutil.copytree(ROOT / "data", tmp_path / "data")
    (tmp_path / "examples").mkdir()
    monkeypatch.chdir(tmp_path / "examples")
    return tmp_path / "examples"


def test_there_are_two():
    assert [path.stem for path in NOTEBOOKS] == ["hexahedra", "surface_flow"]


@pytest.mark.long
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs(path, shown, beside_data, rendering):
    names = {}
    for number, (_, code) in enumerate(code_cells(path)):
        exec(compile(code, f"{path.name}, code cell {number}", "exec"), names)
    assert len(shown) == sum("Image(pictures" in code for _, code in code_cells(path))
    assert all(picture.startswith(b"\x89PNG") for picture in shown)
    assert list(beside_data.iterdir()) == []  # what it writes goes elsewhere
    if path.stem == "hexahedra":
        assert names["result"].report.after.scaled_jacobian.min > 0.6
        assert names["untangled"].report.before.inverted > 0
        assert names["untangled"].report.after.invalid == 0
    else:
        assert names["remeshed"][-1].record.min_angle > 3 * names["carried"][-1].record.min_angle
        assert names["remeshed"][-1].record.energy < names["remeshed"][0].record.energy


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_comes_without_outputs(path):
    for cell, code in code_cells(path):
        assert cell["outputs"] == []
        assert cell["execution_count"] is None
        ast.parse(code)
