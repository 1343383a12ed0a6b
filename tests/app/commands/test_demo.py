"""`hexconformal demo` leaves what it speaks of."""

import numpy as np
import pytest
import pyvista as pv
from program import run

import hexconformal as hc
from hexconformal import generate
from hexconformal.plots.canvas import require_rendering


@pytest.mark.long
def test_demo_leaves_all_it_speaks_of(here, capsys):
    assert run("demo cube --size 4") == 0
    out = capsys.readouterr().out
    places = {path.name for path in (here / "cube").iterdir()}
    expected = {"sheared_cube.vtu", "regular_cube.vtu", "run.pvd", "run_frames", "quality.png", "history.csv"}
    expected |= {"report.txt", "report.json", "report.html"}
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


@pytest.mark.long
@pytest.mark.parametrize(("mesh", "body", "types"), [("swept", "cylinder", {12, 13}), ("curved", "ball", {29})])
def test_demos_of_other_cells_become_valid(mesh, body, types, here, capsys):
    assert run(f"demo out --mesh {mesh} --size 2") == 0
    out = capsys.readouterr().out
    places = {path.name for path in (here / "out").iterdir()}
    assert {f"shaken_{body}.vtu", f"regular_{body}.vtu", "run.pvd", "quality.png", "report.json"} <= places
    for name in (f"shaken_{body}.vtu", f"regular_{body}.vtu"):
        assert name in out
        assert set(np.unique(pv.read(f"out/{name}").celltypes).tolist()) == types
    before, after = (hc.quality(f"out/{name}_{body}.vtu").summary() for name in ("shaken", "regular"))
    assert before.invalid > 10
    assert after.invalid == 0
    assert after.scaled_jacobian.min > 0.7
    assert f"{before.invalid} cells were invalid, 0 are" in out
    command = next(line for line in out.splitlines() if line.startswith("  hexconformal regularize"))
    assert run(command.removeprefix("  hexconformal ")) == 0
    np.testing.assert_array_equal(pv.read("regular.vtu").points, pv.read(f"out/regular_{body}.vtu").points)


def test_demos_that_there_are_not_are_refused(here, capsys):
    assert run("demo out --mesh torus") == 2
    assert "'cube', 'swept' or 'curved'" in capsys.readouterr().err
    assert run("demo out --mesh swept --size 1") == 2
    assert not (here / "out").exists()
