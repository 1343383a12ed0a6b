"""The ParaView filters inside pvpython, where that is installed with a Python that can load our libraries."""

import json
import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from paths import DATA, ROOT

import hexconformal as hc

DOCS = ROOT / "docs" / "paraview.md"
LIBRARIES = ("numpy", "scipy", "numba", "llvmlite", "pyamg", "threadpoolctl", "hexconformal", "surface")

SCRIPT = """
import json, sys
from paraview.simple import *

def arrays(attributes):
    return {attributes[k].Name: attributes[k].GetRange(0) for k in range(attributes.GetNumberOfArrays())}

def report(filter):
    lines = servermanager.Fetch(filter).GetFieldData().GetAbstractArray("report")
    return [lines.GetValue(k) for k in range(lines.GetNumberOfValues())]

plugin, data, told = sys.argv[1:]
LoadPlugin(plugin, remote=False, ns=globals())
mesh = XMLUnstructuredGridReader(FileName=[data + "/jittered_ball.vtu"])
quality = HexahedraQuality(Input=mesh)
quality.UpdatePipeline()
regularize = RegularizeHexahedra(Input=mesh, MaxIterations=5)
regularize.UpdatePipeline()
result = {
    "quality": arrays(quality.CellData),
    "properties": [p for p in regularize.ListProperties() if p not in ("Input", "ReloadPythonModule")],
    "boundary": list(regularize.GetProperty("Boundary").Available),
    "cells": arrays(regularize.CellData),
    "points": arrays(regularize.PointData),
    "report": report(regularize),
}
regularize.Target = "nonsense"
regularize.UpdatePipeline()
result["left after an error"] = servermanager.Fetch(regularize).GetNumberOfCells()
remesh = RemeshSurface(Input=Sphere(), MaxIterations=3)
remesh.UpdatePipeline()
result["surface"] = {**arrays(remesh.CellData), **arrays(remesh.PointData)}
blocks = HexahedraQuality(Input=GroupDatasets(Input=[mesh, mesh]))
blocks.UpdatePipeline()
result["block"] = servermanager.Fetch(blocks).GetBlock(1).GetCellData().GetArray("volume").GetRange()
result["imported"] = [name for name in ("pyvista", "meshio") if name in sys.modules]
with open(told, "w") as file:
    json.dump(result, file)
"""


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    """A folder for PYTHONPATH as the docs want it: what the library needs, and no vtk."""
    program = shutil.which("pvpython")
    if program is None:
        pytest.skip("pvpython is not installed")
    code = "import sys, paraview.simple; print(sys.version_info[:2])"
    tried = subprocess.run([program, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    if tried.returncode != 0:
        pytest.skip("pvpython does not start")
    if tried.stdout.strip() != str(sys.version_info[:2]):
        pytest.skip(f"pvpython has another Python: {tried.stdout.strip()}")
    folder = tmp_path_factory.mktemp("libraries")
    for name in LIBRARIES:
        place = Path(find_spec(name).origin)
        place = place.parent if place.name == "__init__.py" else place
        (folder / place.name).symlink_to(place)
        compiled = place.parent / f"{name}.libs"
        if compiled.exists():
            (folder / compiled.name).symlink_to(compiled)
    # The remedy for an old ParaView under a new Python, as the docs have it.
    remedy = re.search(r"^    echo '(import inspect.*)' > .*sitecustomize.py$", DOCS.read_text(), re.MULTILINE)
    (folder / "sitecustomize.py").write_text(remedy[1])
    return folder


def test_the_filters_run_in_pvpython(libraries, tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    plugin = libraries / "hexconformal" / "app" / "hexconformal_plugin.py"
    words = ["pvpython", tmp_path / "script.py", plugin, DATA, tmp_path / "told.json"]
    environment = {**os.environ, "PYTHONPATH": str(libraries)}
    ran = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=600, check=False)
    assert ran.returncode == 0, ran.stderr
    told = json.loads((tmp_path / "told.json").read_text())
    measured = hc.quality(DATA / "jittered_ball.vtu")
    assert set(told["quality"]) == set(measured.arrays())
    assert told["quality"]["scaled_jacobian"][0] == pytest.approx(measured.scaled_jacobian.min())
    assert sorted(told["properties"]) == [
        "Boundary", "Emphasis", "Features", "Hausdorff", "Linearize", "MaxIterations", "OtherCells", "Target",
    ]  # fmt: skip
    assert told["boundary"] == ["slide", "fixed", "free"]
    assert told["cells"]["scaled_jacobian"][0] > measured.scaled_jacobian.min()
    assert set(told["points"]) == {"moved_by"}
    assert "1080 cells, 5 iterations" in told["report"][0]
    assert told["left after an error"] == 0
    assert "Regularize Hexahedra: target must be 'auto', 'cube', 'input' or 'a:b:c', not 'nonsense'" in ran.stderr
    assert "Traceback" not in ran.stderr
    assert set(told["surface"]) == {"min_angle", "min_angle_change", "Normals"}
    assert told["block"] == pytest.approx([measured.volume.min(), measured.volume.max()])
    assert told["imported"] == []
