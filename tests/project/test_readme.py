"""What the README shows runs as it is written there."""

import re
import shlex

import numpy as np
import pytest
import pyvista as pv
from paths import ROOT

import hexconformal as hc
from hexconformal import generate
from hexconformal.app.cli import main

README = ROOT / "README.md"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the files that the examples speak of."""
    place = tmp_path_factory.mktemp("readme")
    points, cells = generate.ball(core=8, layers=1)
    points = points + 0.01 * np.random.default_rng(0).normal(size=points.shape)
    hc.write(place / "part.vtu", hc.HexMesh(points, cells))
    hc.write(place / "part.msh", hc.HexMesh(points, cells))
    hc.write(place / "mirrored.inp", hc.HexMesh(points, cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]))
    hc.write(place / "layers.vtu", hc.HexMesh(*generate.boundary_layer((4, 4, 6))))
    sphere = pv.Sphere(radius=1.0, theta_resolution=60, phi_resolution=60)
    sphere.save(place / "part.stl")
    pv.Icosphere(nsub=2).scale([1.0, 1.2, 1.5]).save(place / "statue.ply")
    box, bricks = generate.box((3, 3, 3))
    hc.write(place / "box.vtu", hc.HexMesh(box, bricks))
    rows = [f"{t},{node},0,0,{-0.05 * t}" for t in (1, 2) for node in np.flatnonzero(box[:, 2] == box[:, 2].min())]
    (place / "motion.csv").write_text("\n".join(["time,node,dx,dy,dz", *rows]))
    return place


def test_python_examples_run(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    names = {}
    for block in blocks:
        exec(block, names)
    assert len(blocks) == 4
    assert names["measured"].valid.all()
    assert names["result"].report.after.scaled_jacobian.min > 0.5


def commands():
    lines = re.findall(r"^    hexconformal (.*?)(?:  +#.*)?$", README.read_text(encoding="utf-8"), re.MULTILINE)
    return [line.strip() for line in lines]


def test_every_command_is_shown():
    shown = {line.split()[0] for line in commands()}
    assert shown == {"check", "flow", "move", "orient", "quality", "regularize", "remesh"}


@pytest.mark.parametrize("line", commands())
def test_commands_run(line, folder, monkeypatch, capsys, request):
    monkeypatch.chdir(folder)
    if "picture" in line:
        request.getfixturevalue("rendering")
    assert main(shlex.split(line)) == 0
