"""Files that cannot be written: refused before the work, and nothing lost if they fail after it."""

from dataclasses import replace

import pyvista as pv
from program import error_line, run

import hexconformal as hc
import surface
from hexconformal.app.commands.kinds import VOLUMES
from hexconformal.app.commands.regularize import RegularizeJob


def test_a_format_that_cannot_hold_the_mesh_is_refused_before_the_work(here, capsys, monkeypatch):
    (pv.read("part.vtu") + pv.Pyramid().translate((5, 0, 0))).save("mixed.vtu")
    monkeypatch.setattr("hexconformal.app.commands.regularize.run_on", None)  # the work itself must not begin
    assert run("regularize mixed.vtu out.inp --other-cells keep") == 1
    assert error_line(capsys) == "error: cannot write out.inp: abaqus files have no pyramid cells\n"
    assert {path.name for path in here.iterdir()} == {"part.vtu", "mixed.vtu"}


def test_a_write_that_fails_after_all_leaves_the_mesh_elsewhere(here, capsys, monkeypatch):
    def full(path, mesh):
        if str(path) == "better.vtu":
            raise hc.WriteError("cannot write better.vtu: no space left on device")
        return hc.write(path, mesh)

    monkeypatch.setattr(RegularizeJob, "kind", replace(VOLUMES, write=full))
    monkeypatch.setattr("tempfile.tempdir", str(here))
    assert run("regularize part.vtu better.vtu --max-iterations 2") == 1
    said = error_line(capsys)
    assert said.startswith("error: cannot write better.vtu: no space left on device; the mesh was saved as ")
    assert len(hc.read(said.split()[-1]).cells) == 125


def test_a_series_that_fails_midway_ends_the_run_with_its_mesh(here, capsys, monkeypatch):
    def full(series, time, mesh):
        if time == 2:
            raise hc.WriteError("cannot write run_0002.vtu: no space left on device")

    monkeypatch.setattr("hexconformal.runs.series.Series.add", full)
    assert run("regularize part.vtu better.vtu --frames run.pvd --quiet") == 1
    assert error_line(capsys) == (
        "error: cannot write run_0002.vtu: no space left on device; the mesh of iteration 2 is in better.vtu\n"
    )
    assert hc.quality("better.vtu").valid.all()


def test_a_file_in_the_place_of_a_folder(here, capsys):
    surface.write("ball.ply", pv.Icosphere(nsub=1))
    assert run("flow ball.ply part.vtu --steps 1") == 1
    assert capsys.readouterr().err == "error: cannot make the folder part.vtu: it is a file\n"
