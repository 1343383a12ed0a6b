"""`hexconformal demo` leaves what it speaks of."""

import numpy as np
from program import run

import hexconformal as hc
from hexconformal import generate
from hexconformal.plots.canvas import require_rendering


def test_demo_leaves_all_it_speaks_of(here, capsys):
    assert run("demo cube --size 4") == 0
    out = capsys.readouterr().out
    places = {path.name for path in (here / "cube").iterdir()}
    expected = {"sheared_cube.vtu", "regular_cube.vtu", "run.pvd", "run_frames", "quality.png", "history.csv"}
    expected |= {"report.txt", "report.json"}
    try:
        require_rendering()
        expected.add("figure3.png")
    except hc.WriteError:
        assert "no figure3.png" in out
    assert places == expected
    for name in expected - {"run_frames"}:
        assert name in out
    regular = generate.box((4, 4, 4))[0]
    assert np.abs(hc.read("cube/regular_cube.vtu").points - regular).max() < 1e-10
