"""`--html` of every command, and `view`: one file each, of the frames and the history that the run has."""

import csv
import shutil
import subprocess
import sys

import numpy as np
import pytest
import pyvista as pv
from paths import DATA
from program import error_line, frames, run
from web_pages import PageFile

import hexconformal as hc
from hexconformal import Series, generate


def page_of(path):
    return PageFile(path.read_text(encoding="utf-8"))


def test_quality_writes_a_page(here, capsys):
    assert run("quality part.vtu --html quality.html") == 0
    page = page_of(here / "quality.html")
    assert [frame["name"] for frame in page.contents["frames"]] == ["part.vtu"]
    np.testing.assert_array_equal(page.frame(0)[1]["tag"], np.arange(125))
    assert page.contents["report"]["text"] in capsys.readouterr().out


def test_regularize_tells_the_report_and_the_options(here, capsys):
    assert run("regularize part.vtu better.vtu --html report.html --max-iterations 3") == 0
    told, page = capsys.readouterr().out, page_of(here / "report.html")
    assert page.contents["report"]["text"] in told
    assert "report.html" in told.splitlines()[-1]
    assert page.contents["report"]["options"]["max_iterations"] == 3
    assert page.contents["program"] == f"hexconformal {hc.__version__}"
    assert [frame["name"] for frame in page.contents["frames"]] == ["before", "after"]


def test_cells_that_are_kept_beside_hexahedra_are_no_obstacle_to_frames(tmp_path, monkeypatch):
    from meshes.files import cube_beside_pyramid

    monkeypatch.chdir(tmp_path)
    cube_beside_pyramid().save("part.vtu")
    assert run("regularize part.vtu b.vtu --other-cells keep --frames run.pvd --html r.html --quiet") == 0
    assert page_of(tmp_path / "r.html").contents["cells"]["total"] == 1


def test_remesh_has_the_frames_of_its_series(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pv.Icosphere(nsub=1).scale([1.0, 1.3, 1.8]).save("egg.ply")
    assert run("remesh egg.ply better.ply --frames run.pvd --html r.html --max-iterations 4 --quiet") == 0
    page = page_of(tmp_path / "r.html")
    assert [frame["name"] for frame in page.contents["frames"]][1:-1] == ["iteration 1", "iteration 2", "iteration 3"]
    assert "conformality" in page.contents["frames"][2]["cell_arrays"]


def test_flow_has_energy_and_angles_at_the_steps_of_the_frames(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    pv.Icosphere(nsub=1).scale([1.0, 1.3, 1.8]).save("egg.ply")
    assert run("flow egg.ply run --conserve volume --remesh --steps 6 --every 2 --html run/flow.html") == 0
    assert capsys.readouterr().out.splitlines()[-1].endswith("last.vtu, run/flow.html")
    page = page_of(tmp_path / "run" / "flow.html")
    assert [frame["position"] for frame in page.contents["frames"]] == [0, 2, 4, 6]
    series = frames(tmp_path / "run" / "run.pvd")
    for number, (_, file) in enumerate(series):
        np.testing.assert_array_equal(page.frame(number)[0], pv.read(file).points)
    with open(tmp_path / "run" / "history.csv", newline="") as file:
        energies = [float(row["energy"]) for row in csv.DictReader(file)]
    curves = {curve["title"]: curve for curve in page.contents["curves"]}
    assert curves["energy"]["lines"][0]["y"] == energies
    assert [line["name"] for line in curves["smallest angle of a cell, degrees"]["lines"]] == ["mean", "min"]
    assert "reached steps = 6" in page.contents["report"]["text"]


def test_move_has_the_frames_of_its_steps(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    points, cells = generate.box((3, 3, 3))
    hc.write("box.vtu", hc.HexMesh(points, cells))
    moving = np.flatnonzero(points[:, 2] == 0.0)
    rows = [f"{t},{node},0,0,{-0.1 * t}" for t in (1, 2) for node in moving]
    (tmp_path / "motion.csv").write_text("\n".join(["time,node,dx,dy,dz", *rows]))
    assert run("move box.vtu run --motion motion.csv --html run/motion.html") == 0
    assert capsys.readouterr().out.splitlines()[-1].endswith("last.vtu, run/motion.html")
    page = page_of(tmp_path / "run" / "motion.html")
    assert [frame["name"] for frame in page.contents["frames"]] == ["t = 0", "t = 1", "t = 2"]
    assert page.frame(2)[0][moving[0], 2] == pytest.approx(-0.2)
    assert "scaled Jacobian" in [curve["title"] for curve in page.contents["curves"]]


def test_view_of_one_mesh_two_and_a_series(here, capsys):
    assert run("view part.vtu --html one.html --no-browser") == 0
    assert capsys.readouterr().out.splitlines()[-1] == "wrote one.html: open it in a browser"
    assert run("regularize part.vtu better.vtu --max-iterations 3 --quiet --frames run.pvd --history history.csv") == 0
    assert run("view part.vtu better.vtu --html two.html --no-browser") == 0
    page = page_of(here / "two.html")
    np.testing.assert_array_equal(page.frame(1)[0], hc.read("better.vtu").points)
    assert run("view run.pvd --html series.html --no-browser") == 0
    page = page_of(here / "series.html")
    assert len(page.contents["frames"]) == len(frames(here / "run.pvd"))
    assert page.contents["curves"][0]["over"] == "iterations"


def test_view_opens_the_page(here, monkeypatch, capsys):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    assert run("view part.vtu") == 0
    path = capsys.readouterr().out.split()[-1]
    assert opened == [f"file://{path}"]
    assert page_of(here / path).contents["title"] == "part.vtu"


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("view part.vtu --html part.pdf", "known are .htm .html"),
        ("regularize part.vtu b.vtu --html nowhere/r.html", "does not exist"),
        ("regularize part.vtu b.vtu --html r.html --report r.html", "r.html is an output already"),
        ("view missing.pvd --no-browser", "cannot read the series missing.pvd"),
        ("view part.vtu other.vtu --no-browser", "same cells"),
    ],
)
def test_what_cannot_be_written_or_read_is_told_before_the_work(here, capsys, words, text):
    hc.write("other.vtu", hc.HexMesh(*generate.box((2, 1, 1))))
    assert run(words) in (1, 2)
    assert text in error_line(capsys)
    assert not (here / "b.vtu").exists()


def test_a_page_does_not_replace_an_input(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copy(DATA / "sheared_cube.vtu", "part.vtu")
    (tmp_path / "part.html").symlink_to("part.vtu")
    assert run("view part.vtu --html part.html --no-browser") == 2
    assert "part.html is the input already" in error_line(capsys)


def test_a_history_that_is_not_there_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copy(DATA / "sheared_cube.vtu", "part.vtu")
    assert run("regularize part.vtu better.vtu --frames run.pvd --max-iterations 1 --quiet") == 0
    assert run("view run.pvd --history run.csv --no-browser") == 1
    assert error_line(capsys) == "error: run.csv does not exist\n"
    (tmp_path / "run.csv").write_text("x,y\n1,2\n")
    assert run("view run.pvd --history run.csv --no-browser") == 1
    assert "cannot read run.csv: it is no history of a run" in error_line(capsys)
    assert run("view run.pvd --history better.vtu --no-browser") == 1
    assert "cannot read better.vtu: " in error_line(capsys)


def test_what_does_not_go_together_is_told(here, capsys):
    assert run("view part.vtu --history run.csv --no-browser") == 2
    assert "--history goes with a series (.pvd), not with part.vtu" in error_line(capsys)
    assert run("view run.pvd part.vtu --no-browser") == 2
    assert "a series is shown alone: leave part.vtu out" in error_line(capsys)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("view folder", "give one of the files in it: a.vtu, b.vtu"),
        ("view empty", "no such file in it"),
        ("view part.vtu folder", "give one of the files in it"),
        ("view run", "hexconformal view run/series.pvd"),
        ("view run/series.pvd", "1 of the 2 files that it lists do not exist: series_frames/series_0001.vtu"),
    ],
)
def test_what_to_look_at_in_place_of_a_folder_is_told(here, capsys, words, text):
    for name in ("folder", "empty", "run"):
        (here / name).mkdir()
    for name in ("a.vtu", "b.vtu", "notes.txt"):
        shutil.copy("part.vtu", f"folder/{name}")
    with Series("run/series.pvd") as series:
        for time in (0.0, 1.0):
            series.add(time, hc.read("part.vtu"))
    (here / "run" / "series_frames" / "series_0001.vtu").unlink()
    assert run(f"{words} --no-browser") == 1
    assert text in error_line(capsys)


def test_a_history_that_is_cut_off_has_the_columns_that_are_whole(tmp_path):
    from hexconformal.app.commands.results.pages import _columns

    (tmp_path / "run.csv").write_text("step,energy,angle\n0,1.5,30\n1,1.25\n")
    found = _columns(tmp_path / "run.csv")
    assert list(found) == ["step", "energy"]
    assert found["energy"].tolist() == [1.5, 1.25]


def test_commands_that_write_no_page_do_not_load_what_makes_one():
    script = "import sys, hexconformal.app, hexconformal; print('hexconformal.page' in sys.modules)"
    told = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert told.stdout == "False\n"
