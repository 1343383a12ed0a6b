"""`hexconformal quality`: the worst cells, measures in a mesh, pictures, JSON."""

import json

import numpy as np
import pytest
import pyvista as pv
from program import run

import hexconformal as hc


def test_quality_names_the_worst_cells_and_writes_the_measures(here, capsys):
    assert run("quality part.vtu --worst 2 --out measured.vtu --plot q.png") == 0
    out = capsys.readouterr().out
    assert out.endswith("\nwrote measured.vtu, q.png\n")
    measured = hc.quality("part.vtu")
    worst = int(measured.scaled_jacobian.argmin())
    assert out.splitlines()[-3].split()[0] == str(worst)
    grid = pv.read("measured.vtu")
    for name in ("scaled_jacobian", "minimum_jacobian", "shape", "conformal_distortion", "edge_ratio", "volume"):
        np.testing.assert_array_equal(grid[name], getattr(measured, name))
    np.testing.assert_array_equal(grid["valid"] == 1, measured.valid)
    assert (here / "q.png").stat().st_size > 10_000


def test_pictures_of_the_worst_cells(here, rendering):
    assert run("quality part.vtu --picture worst.png --worst 3") == 0
    assert run("regularize part.vtu better.vtu --worst-picture both.png --max-iterations 2 --quiet") == 0
    one, two = (pv.read(name).dimensions for name in ("worst.png", "both.png"))
    assert two[0] == 2 * one[0]


def test_quality_as_json_on_stdout_and_in_a_file(here, capsys):
    assert run("quality part.vtu --json -") == 0
    told = json.loads(capsys.readouterr().out)
    assert run("quality part.vtu --json q.json") == 0
    assert json.loads((here / "q.json").read_text()) == told
    assert told["count"] == 125
    assert told["scaled_jacobian"]["min"] == pytest.approx(hc.quality("part.vtu").scaled_jacobian.min())
