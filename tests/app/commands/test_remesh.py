"""The commands `remesh` and `quality` on surfaces: what they write, what they say, and how they end."""

import csv
import json
import os
import signal
from dataclasses import fields, replace

import numpy as np
import pytest
import pyvista as pv
from meshes.surfaces import grid, icosphere, mixed_sphere, quad_cube, quad_sphere, shaken
from program import error_line, interrupted, run

import surface
from hexconformal.app.cli import parser
from hexconformal.app.commands.surface_kind import SURFACES
from hexconformal.generate import box
from surface.quality.assessment import MEASURES


def as_mesh(shape):
    points, cells = shape[:2]
    return surface.SurfaceMesh(points, cells, {"pole": (points[:, 2] > 0.8).astype(int)})


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working folder that holds shaken spheres: triangles, quadrilaterals, both."""
    monkeypatch.chdir(tmp_path)
    surface.write("ball.ply", as_mesh(shaken(icosphere(2), 0.04)))
    surface.write("quads.vtu", as_mesh(shaken(quad_sphere(4), 0.04)))
    surface.write("mixed.vtp", as_mesh(shaken(mixed_sphere(4), 0.04)))
    return tmp_path


def test_remesh_writes_everything_that_is_asked_for(here, capsys):
    words = "remesh ball.ply better.vtu --max-iterations 6 --history run.csv --frames run.pvd --report report.json"
    assert run(words + " --plot q.png") == 0
    said = capsys.readouterr()
    assert "wrote better.vtu, run.csv, run.pvd, report.json, q.png" in said.out
    assert said.err == ""

    before, after = surface.read("ball.ply"), pv.read("better.vtu")
    np.testing.assert_array_equal(after["pole"], before.point_data["pole"])
    np.testing.assert_array_equal(after.cell_connectivity.reshape(-1, 3), before.cells.triangles)
    np.testing.assert_allclose(after["min_angle"], after.cell_quality("min_angle")["min_angle"], atol=1e-9)
    old = surface.quality(before)
    np.testing.assert_allclose(after["min_angle_change"], after["min_angle"] - old.min_angle, atol=1e-9)
    assert after["min_angle"].mean() > old.min_angle.mean() + 3

    with open("run.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [field.name for field in fields(surface.Record)]
    assert [int(row["iteration"]) for row in rows] == list(range(len(rows)))
    assert float(rows[-1]["energy"]) < 0.7 * float(rows[0]["energy"])

    reader = pv.get_reader("run.pvd")
    assert reader.time_values == [float(row["iteration"]) for row in rows]
    reader.set_active_time_value(reader.time_values[-1])
    frame = reader.read()[0]
    np.testing.assert_array_equal(frame.points, after.points)
    np.testing.assert_allclose(frame["min_angle"], after["min_angle"], atol=1e-9)

    report = json.loads((here / "report.json").read_text())
    assert report["iterations"] == len(rows) - 1
    assert report["after"]["mean_angle"] == pytest.approx(after["min_angle"].mean())
    assert report["after"]["distributions"]["min_angle"]["min"] == pytest.approx(after["min_angle"].min())
    assert (here / "q.png").stat().st_size > 10_000


def test_options_reach_the_run(here, capsys):
    words = "remesh ball.ply better.ply --target flat --energy quaternionic --normal middle --boundary fixed"
    words += " --feature-angle 30 --hausdorff 0.02 --eps 1e-4 --max-iterations 2 --energy-tolerance 1e-3"
    words += " --no-project --fixed pole"
    assert run(words + " --report -") == 0
    options = json.loads(capsys.readouterr().out)["options"]
    assert options == {
        **surface.Options().described(),
        "target": "flat",
        "energy": "quaternionic",
        "normal": "middle",
        "boundary": "fixed",
        "feature_angle": 30.0,
        "hausdorff": 0.02,
        "eps": 1e-4,
        "max_iterations": 2,
        "energy_tolerance": 1e-3,
        "project": False,
        "fixed": "pole",
    }
    before, after = surface.read("ball.ply"), surface.read("better.ply")
    pole = before.point_data["pole"] == 1
    assert 5 < pole.sum() < 100
    np.testing.assert_array_equal(after.points[pole], before.points[pole])
    assert np.abs(after.points[~pole] - before.points[~pole]).max() > 1e-3


def test_what_is_not_said_is_left_to_the_options(here, capsys):
    assert run("remesh ball.ply better.ply --max-iterations 1 --report -") == 0
    assert json.loads(capsys.readouterr().out)["options"] == surface.Options(max_iterations=1).described()


def on_the_command_line():
    """All options but the array that only Python takes."""
    return [field for field in fields(surface.Options) if field.name != "feature_edges"]


def test_defaults_are_those_of_python():
    parsed = vars(parser().parse_args(["remesh", "in.ply", "out.ply"]))
    for field in on_the_command_line():
        assert parsed[field.name] == getattr(surface.Options(), field.name)


def test_no_features_and_a_target_mesh_from_a_file(here, capsys):
    points, cells = icosphere(2)
    surface.write("round.ply", (points * [1, 1, 2], cells.triangles))
    assert run("remesh ball.ply better.ply --max-iterations 1 --feature-angle none --target round.ply --report -") == 0
    report = json.loads(capsys.readouterr().out)
    assert report["options"]["feature_angle"] is None
    assert report["options"]["target"] == "given"
    expected = surface.remesh("ball.ply", max_iterations=1, feature_angle=None, target=points * [1, 1, 2]).points
    np.testing.assert_allclose(surface.read("better.ply").points, expected, atol=1e-7)


def test_help_names_every_option_and_has_examples(capsys):
    assert run("remesh --help") == 0
    said = capsys.readouterr().out
    assert "examples:\n  hexconformal remesh statue.ply" in said
    assert ".obj .off .ply .stl" in said
    for field in on_the_command_line():
        assert f"--{field.name.replace('_', '-')}" in said


def test_every_writes_a_frame_in_so_many_and_the_last(here):
    assert (
        run("remesh mixed.vtp better.vtp --frames run.pvd --every 2 --max-iterations 3 --energy-tolerance 0 --quiet")
        == 0
    )
    assert pv.get_reader("run.pvd").time_values == [0.0, 2.0, 3.0]


def test_quiet_says_nothing_and_not_converged_is_done(here, capsys):
    assert run("remesh quads.vtu better.vtu --max-iterations 1 --quiet") == 0
    said = capsys.readouterr()
    assert (said.out, said.err) == ("", "")
    assert run("remesh quads.vtu better.vtu --max-iterations 1 --energy-tolerance 0") == 0
    assert "not converged: reached max_iterations = 1" in capsys.readouterr().out


def test_the_input_is_replaced_only_on_demand(here, capsys):
    before = (here / "ball.ply").read_bytes()
    assert run("remesh ball.ply ./ball.ply") == 2
    assert "--overwrite" in error_line(capsys)
    assert (here / "ball.ply").read_bytes() == before
    assert run("remesh ball.ply ball.ply --max-iterations 1 --overwrite --quiet") == 0
    assert (here / "ball.ply").read_bytes() != before


def test_what_a_format_cannot_keep_is_said(here, capsys):
    assert run("remesh ball.ply better.off --max-iterations 1 --quiet") == 0
    said = capsys.readouterr().err
    assert said.startswith("note: better.off does not keep point array 'pole', cell array 'min_angle'")


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ("remesh missing.ply out.ply", 1, "missing.ply does not exist"),
        ("remesh ball.ply nowhere/out.ply", 1, "the folder"),
        ("remesh ball.ply out.inp", 1, "unknown extension .inp"),
        ("remesh ball.ply out.ply --history nowhere/run.csv", 1, "nowhere/run.csv"),
        ("remesh ball.ply out.ply --frames run.vtu", 1, "known are .pvd"),
        ("remesh ball.ply out.ply --plot q.doc", 1, "unknown extension .doc"),
        ("remesh ball.ply out.ply --plot ball.ply", 2, "ball.ply is the input"),
        ("remesh ball.ply out.ply --boundary slippery", 2, "'slide' or 'fixed', not 'slippery'"),
        ("remesh ball.ply out.ply --energy low", 2, "'barrier' or 'quaternionic', not 'low'"),
        ("remesh ball.ply out.ply --target round", 2, "target must be"),
        ("remesh ball.ply out.ply --target round.ply", 1, "round.ply does not exist"),
        (
            "remesh ball.ply out.ply --feature-angle sharp",
            2,
            "must be an angle in degrees, or none, not 'sharp'",
        ),
        ("remesh ball.ply out.ply --fixed walls", 2, "names no point array or group of the file; there are: 'pole'"),
        ("remesh ball.ply out.ply --eps 0", 2, "eps"),
        ("remesh ball.ply out.ply --hausdorff -1", 2, "hausdorff"),
        ("remesh ball.ply out.ply --every 0", 2, "every"),
        ("remesh hexes.vtu out.ply", 1, "8 hexahedron; only triangles"),
        ("remesh broken.ply out.ply", 1, "cannot read broken.ply"),
        ("remesh nan.ply out.ply", 1, "NaN"),
        ("quality missing.ply", 1, "missing.ply does not exist"),
        ("quality broken.ply", 1, "cannot read broken.ply"),
        ("quality ball.ply --out ball.ply", 2, "--overwrite"),
        ("quality ball.ply --out out.inp", 1, "unknown extension .inp"),
        ("quality polyhedra.vtu", 1, "1 polyhedron"),
        ("quality ball.xyz", 1, "ball.xyz does not exist"),
    ],
)
def test_errors_are_one_readable_line(here, capsys, words, code, said):
    points, cells = icosphere(1)
    pv.UnstructuredGrid({12: box((2, 2, 2))[1]}, box((2, 2, 2))[0]).save("hexes.vtu")
    pv.examples.cells.Polyhedron().save("polyhedra.vtu")
    surface.write("nan.ply", (np.where(points > 0.9, np.nan, points), cells.triangles))
    (here / "broken.ply").write_bytes((here / "ball.ply").read_bytes()[:-900])
    files = {path: path.read_bytes() for path in here.iterdir()}
    assert run(words) == code
    line = error_line(capsys)
    assert line.startswith("error: ")
    assert said in line
    assert {path: path.read_bytes() for path in here.iterdir()} == files


def test_a_format_that_cannot_hold_the_mesh_is_refused_before_the_work(here, capsys, monkeypatch):
    monkeypatch.setattr("hexconformal.app.commands.remesh.Remeshing", None)  # the work itself must not begin
    assert run("remesh quads.vtu out.stl") == 1
    assert error_line(capsys).startswith("error: cannot write out.stl: an .stl file holds triangles only")
    assert {path.name for path in here.iterdir()} == {"ball.ply", "quads.vtu", "mixed.vtp"}


def test_a_write_that_fails_after_all_leaves_the_mesh_elsewhere(here, capsys, monkeypatch):
    from hexconformal.common.errors import WriteError

    def full(path, mesh):
        if str(path) == "better.ply":
            raise WriteError("cannot write better.ply: no space left on device")
        return surface.write(path, mesh)

    monkeypatch.setattr("hexconformal.app.commands.remesh.RemeshJob.kind", replace(SURFACES, write=full))
    monkeypatch.setattr("tempfile.tempdir", str(here))
    assert run("remesh ball.ply better.ply --max-iterations 1") == 1
    said = error_line(capsys)
    assert said.startswith("error: cannot write better.ply: no space left on device; the mesh was saved as ")
    assert len(surface.read(said.split()[-1]).cells) == 320


@pytest.mark.parametrize("name", ["ball.ply", "quads.vtu", "mixed.vtp"])
def test_quality_measures_surfaces(here, capsys, name):
    assert run(f"quality {name} --worst 2 --out measured.vtu --plot q.png") == 0
    out = capsys.readouterr().out
    measured = surface.quality(name)
    lines = out.splitlines()
    assert lines[0].startswith(f"{len(measured.area)} cells, ")
    assert lines[-4] == "worst cells (id, conformality, centre)"
    assert int(lines[-3].split()[0]) == measured.summary(worst=1).worst[0].id
    written = surface.read("measured.vtu")
    for measure in MEASURES:
        np.testing.assert_array_equal(written.cell_data[measure], getattr(measured, measure))
    assert (here / "q.png").stat().st_size > 10_000
    assert run(f"quality {name} --json -") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["min_angle"] == pytest.approx(measured.min_angle.min())
    assert set(told["distributions"]) <= set(MEASURES)


def test_quality_of_hexahedra_is_not_that_of_their_skin(here, capsys):
    points, cells = box((2, 2, 2))
    grid = pv.UnstructuredGrid({12: cells, 9: cells[:, :4]}, points)
    grid.save("hexes.vtu")
    assert run("quality hexes.vtu") == 0
    assert capsys.readouterr().out.startswith("8 cells, 0 inverted, 0 invalid, volume 1")


def test_pictures(here, rendering):
    words = "remesh mixed.vtp better.vtp --picture both.png --worst-picture worst.png --max-iterations 1 --quiet"
    assert run(words) == 0
    assert run("quality ball.ply --picture one.png --worst 3") == 0
    both, worst, one = (pv.read(name).dimensions for name in ("both.png", "worst.png", "one.png"))
    assert both == worst
    assert worst[0] == 2 * one[0]


def test_open_surfaces_and_sharp_edges(here, capsys):
    surface.write("sheet.obj", as_mesh(grid(6, jitter=0.3)))
    surface.write("cube.off", as_mesh(quad_cube(4)))
    assert run("remesh sheet.obj better.obj --boundary fixed --max-iterations 3") == 0
    assert run("remesh cube.off better.off --max-iterations 3") == 0
    assert "volume" in capsys.readouterr().out
    np.testing.assert_allclose(surface.read("better.off").points, quad_cube(4)[0], atol=1e-9)


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interruption_leaves_the_last_surface(tmp_path, number):
    points, cells = shaken(icosphere(5), 0.004)
    surface.write(tmp_path / "ball.ply", (points, cells.triangles))
    words = "remesh ball.ply better.ply --energy-tolerance 0 --max-iterations 100000 --feature-angle none"
    report = interrupted(tmp_path, words, number, lines=3)
    assert report["turned"] == 0
    better = surface.read(tmp_path / "better.ply")
    assert surface.quality(better).conformality.min() > 0
    assert np.abs(better.points - points).max() > 0
