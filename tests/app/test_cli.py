"""The command line, as a user meets it: what it writes, what it says, and how it ends."""

import csv
import errno
import io
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import fields, replace

import numba
import numpy as np
import pytest
import pyvista as pv
from numba import njit
from program import error_line, interrupted, run

import hexconformal as hc
import surface
from hexconformal import generate
from hexconformal.app.cli import main
from hexconformal.app.commands.kinds import VOLUMES
from hexconformal.app.commands.regularize import RegularizeJob
from hexconformal.app.progress import Progress
from hexconformal.elements.validity import is_valid
from hexconformal.kernel import jit as compiled
from hexconformal.mesh.topology import boundary_quads
from hexconformal.plots.canvas import require_rendering
from hexconformal.regularization.options import CHOICES, Record


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working folder that holds a sheared cube with nodes marked in the array "wall"."""
    monkeypatch.chdir(tmp_path)
    points, cells = generate.sheared_cube(5)
    wall = (points[:, 2] == 0).astype(int)
    hc.write("part.vtu", hc.HexMesh(points, cells, {"wall": wall}, {"tag": np.arange(len(cells))}))
    return tmp_path


def run_program(*words, **options):
    return subprocess.run(
        [sys.executable, "-m", "hexconformal", *words], capture_output=True, text=True, timeout=120, **options
    )


def test_regularize_writes_everything_that_is_asked_for(here, capsys):
    words = "regularize part.vtu better.vtu --history run.csv --frames run.pvd --report report.json --plot q.png"
    assert run(words) == 0
    said = capsys.readouterr()
    assert "converged" in said.out
    assert "wrote better.vtu, run.csv, run.pvd, report.json, q.png" in said.out
    assert said.err == ""  # no terminal, no progress

    before, after = pv.read("part.vtu"), pv.read("better.vtu")
    np.testing.assert_array_equal(after["tag"], before["tag"])
    np.testing.assert_array_equal(after["wall"], before["wall"])
    regular = generate.box((5, 5, 5))[0]
    assert np.abs(after.points - regular).max() < 1e-5
    assert after["scaled_jacobian"].min() > 0.999

    with open("run.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [field.name for field in fields(Record)]
    assert [int(row["iteration"]) for row in rows] == list(range(len(rows)))
    assert float(rows[-1]["energy"]) < 1e-3 * float(rows[0]["energy"])

    reader = pv.get_reader("run.pvd")
    assert reader.time_values == [float(row["iteration"]) for row in rows]
    reader.set_active_time_value(reader.time_values[-1])
    np.testing.assert_array_equal(reader.read()[0].points, after.points)

    report = json.loads((here / "report.json").read_text())
    assert report["iterations"] == len(rows) - 1
    assert report["after"]["inverted"] == 0
    assert (here / "q.png").stat().st_size > 10_000


def test_options_reach_the_run(here, capsys):
    words = "regularize part.vtu better.vtu --boundary free --fixed wall --target 1:1:2 --energy quaternionic"
    words += " --weight volume --quadrature corners --method majorize --no-lift --tolerance 1e-3 --max-iterations 4"
    words += " --hausdorff 0.01 --features keep --sizes free"
    assert run(words + " --report -") == 0
    options = json.loads(capsys.readouterr().out)["options"]
    assert options == {
        "boundary": "free",
        "hausdorff": 0.01,
        "features": "keep",
        "sizes": "free",
        "surface": None,
        "conserve_volume": False,
        "fixed": "wall",
        "target": "1:1:2",
        "weight": "volume",
        "energy": "quaternionic",
        "quadrature": "corners",
        "method": "majorize",
        "lift": False,
        "tolerance": 1e-3,
        "max_iterations": 4,
    }
    before, after = pv.read("part.vtu"), pv.read("better.vtu")
    wall = before["wall"] == 1
    np.testing.assert_array_equal(after.points[wall], before.points[wall])
    assert np.abs(after.points[~wall] - before.points[~wall]).max() > 0.01
    np.testing.assert_allclose(after["moved_by"], after.points - before.points, atol=1e-15)
    change = hc.quality("better.vtu").scaled_jacobian - hc.quality("part.vtu").scaled_jacobian
    np.testing.assert_allclose(after["scaled_jacobian_change"], change, atol=1e-12)


def test_what_is_not_said_is_left_to_the_options(here, capsys):
    assert run("regularize part.vtu better.vtu --max-iterations 1 --report -") == 0
    assert json.loads(capsys.readouterr().out)["options"] == hc.Options(max_iterations=1).described()


def polyhedral_ball():
    """A ball whose surface is a polyhedron of 26 faces outside the unit sphere, up to a tenth away from it."""
    points, cells = generate.ball(core=8, layers=2)
    surface = np.unique(boundary_quads(cells)[0])
    directions = np.array([d for d in np.ndindex(3, 3, 3) if d != (1, 1, 1)]) - 1.0
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    points[surface] /= (points[surface] @ directions.T).max(axis=1)[:, None]
    return points, cells


def test_a_coarse_boundary_slides_onto_a_finer_surface(here, capsys):
    points, cells = polyhedral_ball()
    hc.write("ball.vtu", hc.HexMesh(points, cells))
    pv.Sphere(radius=1.0, theta_resolution=120, phi_resolution=120).save("sphere.stl")
    assert run("regularize ball.vtu round.vtu --surface sphere.stl --report -") == 0
    report = json.loads(capsys.readouterr().out)
    assert report["options"]["surface"] == "sphere.stl"
    better = hc.read("round.vtu")
    assert is_valid(better.points, cells).all()
    # Everywhere on the trilinear faces, not only at the nodes.
    s, t = (axis.ravel()[:, None, None] for axis in np.meshgrid(*[np.linspace(0, 1, 7)] * 2))
    a, b, c, d = np.moveaxis(better.points[boundary_quads(cells)[0]], 1, 0)
    away = np.abs(np.linalg.norm((1 - s) * ((1 - t) * a + t * d) + s * ((1 - t) * b + t * c), axis=-1) - 1.0)
    assert np.linalg.norm(points, axis=1).max() > 1.09
    assert away.max() < 0.005 * report["diagonal"]
    assert report["hausdorff"] <= report["hausdorff_bound"] == 0.005


def test_the_volume_is_conserved_if_asked_to(here, capsys):
    hc.write("ball.vtu", hc.HexMesh(*generate.jittered(*generate.ball(3, 2), 0.3, seed=1)))
    changes = []
    for words in ("", " --conserve-volume"):
        assert run(f"regularize ball.vtu round.vtu --report -{words}") == 0
        changes.append(abs(json.loads(capsys.readouterr().out)["volume_change"]))
    assert changes[0] > 1e-4
    assert changes[1] < 1e-12


def test_sizes_may_be_those_of_a_cell_array(here, capsys):
    points, cells = generate.box((4, 4, 4))
    wanted = np.where(points[cells].mean(axis=1)[:, 0] < 0.5, 0.5, 1.5) / 64.0
    hc.write("box.vtu", hc.HexMesh(points, cells, cell_data={"wanted": wanted}))
    assert run("regularize box.vtu out.vtu --sizes wanted --report -") == 0
    report = json.loads(capsys.readouterr().out)
    ratios = hc.quality(hc.read("out.vtu")).volume / wanted
    assert report["size_ratios"] == pytest.approx([ratios.min(), ratios.max()])
    assert 0.85 < ratios.min() < ratios.max() < 1.3
    assert run("regularize box.vtu out.vtu --sizes absent") == 2
    assert "sizes must be 'input', 'free' or a cell array, not 'absent'; there are: 'wanted'" in capsys.readouterr().err


def test_help_names_every_choice(capsys):
    assert run("regularize --help") == 0
    said = capsys.readouterr().out
    for flag, choices in CHOICES.items():
        assert f"--{flag} {'|'.join(choices)}" in said
    for field in fields(hc.Options):
        assert f"--{field.name.replace('_', '-')}" in said


@pytest.mark.parametrize("command", ["regularize", "quality", "orient", "check", "demo"])
def test_help_has_examples(command, capsys):
    assert main([command, "--help"]) == 0
    said = capsys.readouterr().out
    assert f"examples:\n  hexconformal {command}" in said


def test_every_writes_a_frame_in_so_many_and_the_last(here):
    assert run("regularize part.vtu better.vtu --frames run.pvd --every 4 --max-iterations 6 --quiet") == 0
    assert pv.get_reader("run.pvd").time_values == [0.0, 4.0, 6.0]


def test_not_converged_is_done_with_the_reason_shown(here, capsys):
    assert run("regularize part.vtu better.vtu --max-iterations 1") == 0
    assert "not converged: reached max_iterations = 1" in capsys.readouterr().out


def test_quiet_says_nothing(here, capsys):
    assert run("regularize part.vtu better.vtu --max-iterations 1 --quiet") == 0
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == ""


def test_the_input_is_replaced_only_on_demand(here, capsys):
    before = (here / "part.vtu").read_bytes()
    assert run("regularize part.vtu ./part.vtu") == 2
    assert "--overwrite" in error_line(capsys)
    assert (here / "part.vtu").read_bytes() == before
    assert run("regularize part.vtu part.vtu --max-iterations 1 --overwrite --quiet") == 0
    assert (here / "part.vtu").read_bytes() != before


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ("regularize missing.vtu out.vtu", 1, "missing.vtu does not exist"),
        ("regularize part.vtu nowhere/out.vtu", 1, "the folder"),
        ("regularize part.vtu out.xyz", 1, "unknown extension .xyz"),
        ("regularize part.vtu out.vtu --history nowhere/run.csv", 1, "nowhere/run.csv"),
        ("regularize part.vtu out.vtu --frames run.vtu", 1, "known are .pvd"),
        ("regularize part.vtu out.vtu --plot q.doc", 1, "unknown extension .doc"),
        ("regularize part.vtu out.vtu --plot part.vtu", 2, "part.vtu is the input"),
        ("regularize part.vtu out.vtu --report x --history x", 2, "x is an output already"),
        ("regularize part.vtu out.vtu --boundary slippery", 2, "'slide', 'fixed' or 'free', not 'slippery'"),
        ("regularize part.vtu out.vtu --fixed walls", 2, "names no point array"),
        ("regularize part.vtu out.vtu --target 1:2", 2, "target"),
        ("regularize part.vtu out.vtu --method majorize", 2, "quaternionic"),
        ("regularize part.vtu out.vtu --every 0", 2, "every"),
        ("regularize part.vtu out.vtu --hausdorff 2", 2, "hausdorff"),
        ("regularize part.vtu out.vtu --features sharp", 2, "'auto', 'keep' or 'soft', not 'sharp'"),
        ("regularize part.vtu out.vtu --surface missing.stl", 1, "missing.stl does not exist"),
        ("regularize part.vtu out.vtu --surface broken.vtu", 1, "cannot read broken.vtu"),
        ("regularize part.vtu out.vtu --surface part.vtu --conserve-volume", 2, "conserve_volume goes with"),
        ("regularize part.vtu out.vtu --surface part.vtu --boundary fixed", 2, "surface goes with boundary='slide'"),
        ("regularize part.vtu out.vtu --surface part.vtu --hausdorff 0", 2, "surface goes with boundary='slide'"),
        ("regularize part.vtu out.vtu --worst-picture part.vtu", 2, "part.vtu is the input"),
        ("regularize part.vtu out.xdmf", 1, "its companion out.h5 belongs to another file"),
        ("regularize tets.vtu out.vtu", 1, "tetra"),
        ("regularize broken.vtu out.vtu", 1, "cannot read broken.vtu"),
        ("quality missing.vtu", 1, "missing.vtu does not exist"),
        ("quality part.vtu --worst -1", 2, "worst"),
        ("quality part.vtu --out part.vtu", 2, "--overwrite"),
        ("quality part.vtu --picture worst.doc", 1, "unknown extension .doc"),
        ("quality part.vtu --picture worst.png --worst 0", 2, "count must be 1 or more"),
        ("orient part.vtu part.vtu", 2, "--overwrite"),
        ("check missing.vtu", 1, "missing.vtu does not exist"),
        ("demo part.vtu", 1, "cannot make the folder part.vtu"),
        ("demo --size 1", 2, "size must be 2 or more"),
    ],
)
def test_errors_are_one_readable_line(here, capsys, words, code, said):
    pv.Sphere().delaunay_3d().save("tets.vtu")
    (here / "out.h5").write_bytes(b"of another file")
    (here / "broken.vtu").write_bytes((here / "part.vtu").read_bytes()[:-900])
    files = {path: path.read_bytes() for path in here.iterdir() if path.is_file()}
    assert run(words) == code
    line = error_line(capsys)
    assert line.startswith("error: ")
    assert said in line
    # Nothing was begun, nothing was lost.
    assert {path: path.read_bytes() for path in here.iterdir() if path.is_file()} == files


@pytest.mark.parametrize("words", [[], ["polish"], ["regularize", "part.vtu"], ["check", "part.vtu", "--loud"]])
def test_wrong_usage_ends_with_2(words, capsys):
    assert main(words) == 2
    assert "usage: hexconformal" in capsys.readouterr().err


def test_a_format_that_cannot_hold_the_mesh_is_refused_before_the_work(here, capsys, monkeypatch):
    (pv.read("part.vtu") + pv.Pyramid().translate((5, 0, 0))).save("mixed.vtu")
    monkeypatch.setattr("hexconformal.app.commands.regularize.Regularization", None)  # the work itself must not begin
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


def test_quality_names_the_worst_cells_and_writes_the_measures(here, capsys):
    assert run("quality part.vtu --worst 2 --out measured.vtu --plot q.png") == 0
    out = capsys.readouterr().out
    measured = hc.quality("part.vtu")
    worst = int(measured.scaled_jacobian.argmin())
    assert out.splitlines()[-2].split()[0] == str(worst)
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


def test_orient_turns_mirrored_cells_round(here, capsys):
    points, cells = generate.box((2, 2, 2))
    hc.write("mirrored.vtu", hc.HexMesh(points, cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]))
    assert run("check mirrored.vtu") == 1
    assert "error: " in capsys.readouterr().out
    assert run("orient mirrored.vtu sound.vtu") == 0
    assert "8 of 8 cells turned round" in capsys.readouterr().out
    np.testing.assert_array_equal(hc.read("sound.vtu").cells, cells)
    assert run("orient sound.vtu again.vtu") == 0
    assert "nothing to do" in capsys.readouterr().out
    assert run("check again.vtu") == 0


def test_check_tells_of_surfaces_too(here, capsys):
    points, faces = pv.Icosphere(nsub=1).points, pv.Icosphere(nsub=1).regular_faces
    surface.write("sound.ply", (points, faces))
    surface.write("spare.ply", (np.vstack([points, [[3.0, 0, 0]]]), faces))
    surface.write("twice.ply", (points, np.vstack([faces, faces[:1]])))
    surface.write("sound.vtu", (points, faces))
    assert [run(f"check {name}") for name in ("sound.ply", "spare.ply", "twice.ply", "sound.vtu")] == [0, 0, 1, 0]
    told = capsys.readouterr().out.splitlines()
    assert told[:2] == ["sound.ply: 80 triangles, 0 quadrilaterals, 42 points", "can be worked on"]
    assert told[3:5] == ["warning: points in no cell (kept): 1 (ids 42)", "can be worked on"]
    assert told[6].startswith("error: cells with the same nodes as an earlier one: 1 (ids 80)")
    assert told[8] == "can be worked on"


def test_a_file_in_the_place_of_a_folder(here, capsys):
    surface.write("ball.ply", pv.Icosphere(nsub=1))
    assert run("flow ball.ply part.vtu --steps 1") == 1
    assert capsys.readouterr().err == "error: cannot make the folder part.vtu: it is a file\n"


def test_check_reports_points_that_are_not_finite(here, capsys):
    mesh = hc.read("part.vtu")
    points = mesh.points.copy()
    points[7] = np.nan
    hc.write("nan.vtu", mesh.replaced(points=points))
    assert run("check nan.vtu") == 1
    assert "NaN or infinite coordinates: 1 (ids 7)" in capsys.readouterr().out
    assert run("quality nan.vtu") == 1
    assert "nan.vtu: points with NaN or infinite coordinates: 1 (ids 7)" in capsys.readouterr().err


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


def test_version_and_module_entry():
    done = run_program("--version")
    assert (done.returncode, done.stdout) == (0, f"hexconformal {hc.__version__}\n")


@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interruption_leaves_the_last_valid_mesh(tmp_path, number):
    points, cells = generate.twisted_cube(24, degrees=150)
    hc.write(tmp_path / "part.vtu", hc.HexMesh(points, cells))
    words = "regularize part.vtu better.vtu --boundary fixed --tolerance 0 --max-iterations 100000"
    interrupted(tmp_path, f"{words} --energy quaternionic --method majorize", number, lines=4)
    better = hc.read(tmp_path / "better.vtu")
    assert is_valid(better.points, better.cells).all()
    assert np.abs(better.points - points).max() > 0


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_terminal_sees_iterations(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with Progress() as progress:
        progress.show(str(Record(7, "lbfgs", 4.685, 0.01336, 1.0, 0.98728, 0.99937, 0, 1.36)))
        time.sleep(0.3)
        assert "7 lbfgs  energy 4.685e+00" in sys.stderr.getvalue()


@pytest.mark.parametrize("quiet", [False, True])
def test_compiling_is_announced_once(monkeypatch, tmp_path, caplog, quiet):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(compiled._ANNOUNCEMENT, "_said", False)
    with Progress(quiet):
        njit(slowly_compiled)(3)
        assert not caplog.records  # not ours
        for _ in range(2):
            compiled.loop(slowly_compiled)(3)
            compiled.loop(slowly_compiled)(3.0)
    assert [record.name for record in caplog.records] == ["hexconformal"] * (not quiet)


def test_without_a_folder_to_keep_it_in_the_code_is_compiled_at_every_run(monkeypatch, caplog):
    monkeypatch.setattr(compiled.FunctionCache._impl_class, "_locator_classes", [])
    monkeypatch.setattr(compiled._ANNOUNCEMENT, "_said", False)
    monkeypatch.setattr(compiled._ANNOUNCEMENT, "kept", True)
    assert compiled.loop(slowly_compiled)(3) == compiled.strict_loop(slowly_compiled)(3) == 3.0
    assert ["NUMBA_CACHE_DIR" in record.message for record in caplog.records] == [True]


def test_a_full_disk_does_not_stop_what_is_compiled(monkeypatch, tmp_path):
    def full(*words):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr("numba.core.caching.IndexDataCacheFile.save", full)
    assert compiled.loop(slowly_compiled)(4) == 6.0


def slowly_compiled(count):
    total = 0.0
    for row in range(count):
        total += row
    return total
