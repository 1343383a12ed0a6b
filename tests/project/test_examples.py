"""The scripts of the examples run, on little, and leave their pictures."""

import sys
from importlib import import_module

import numpy as np
import pytest
from meshes.surfaces import icosphere
from paths import ROOT

import surface


@pytest.mark.parametrize(
    ("name", "arguments"), [("statue", ["ball.ply", "--steps", "2"]), ("discoid", ["--size", "3", "--steps", "3"])]
)
def test_flows_are_drawn_step_by_step(rendering, tmp_path, monkeypatch, capsys, name, arguments):
    from PIL import Image

    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    points, cells = icosphere(2)
    surface.write("ball.ply", surface.SurfaceMesh(points * [1.0, 1.0, 1.4], cells))
    monkeypatch.setattr(sys, "argv", [f"{name}.py", *arguments, "--picture", "drawn.png"])
    import_module(name).main()
    assert "wrote drawn.png" in capsys.readouterr().out
    assert np.ptp(np.asarray(Image.open("drawn.png").convert("L"))) > 200
