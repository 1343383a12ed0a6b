"""`hexconformal regularize`, as a user meets it: what it writes, and what its options do."""

import csv
import json
import os
import signal
from dataclasses import fields

import meshio
import numpy as np
import pytest
import pyvista as pv
from matplotlib.image import imread
from program import error_line, interrupted, run

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements import is_valid
from hexconformal.mesh.topology import boundary_quads
from hexconformal.regularization.options import CHOICES, Record


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
    words += " --weight volume --quadrature corners --method majorize --emphasis mean --gradient-tolerance 1e-3"
    words += " --max-iterations 4 --hausdorff 0.01 --features keep --feature-band 0.3 --sizes free"
    words += " --constraint compatible --eps 1e-6"
    assert run(words + " --report -") == 0
    options = json.loads(capsys.readouterr().out)["options"]
    assert options == {
        "boundary": "free",
        "hausdorff": 0.01,
        "constraint": "compatible",
        "eps": 1e-6,
        "interfaces": "auto",
        "couplings": "auto",
        "feature_band": 0.3,
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
        "emphasis": "mean",
        "gradient_tolerance": 1e-3,
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


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interruption_leaves_the_last_valid_mesh(tmp_path, number):
    points, cells = generate.twisted_cube(24, degrees=150)
    hc.write(tmp_path / "part.vtu", hc.HexMesh(points, cells))
    words = "regularize part.vtu better.vtu --boundary fixed --gradient-tolerance 0 --max-iterations 100000"
    interrupted(tmp_path, f"{words} --energy quaternionic --method majorize", number, lines=4)
    better = hc.read(tmp_path / "better.vtu")
    assert is_valid(better.points, better.cells).all()
    assert np.abs(better.points - points).max() > 0


@pytest.mark.long
def test_regions_of_a_deck_are_reported_drawn_and_put_on_the_result(here, capsys, rendering):
    points, cells = generate.jittered(*generate.box((6, 3, 3)), 0.2, seed=1)
    left = generate.box((6, 3, 3))[0][cells].mean(axis=1)[:, 0] < 0.5
    sets = {"STEEL": [np.flatnonzero(left)], "AIR": [np.flatnonzero(~left)]}
    hc.write("two.inp", meshio.Mesh(points, [("hexahedron", cells)], cell_sets=sets))
    assert run("regularize two.inp better.vtu --conserve-volume --report two.json --picture two.png") == 0
    told = capsys.readouterr().out
    assert "\nSTEEL " in told
    assert "\nSTEEL | AIR " in told
    report = json.loads((here / "two.json").read_text())
    assert [row["name"] for row in report["regions"]] == ["STEEL", "AIR"]
    assert [row["quads"] for row in report["interfaces"]] == [9]
    np.testing.assert_array_equal(hc.read("better.vtu").cell_data["region"], np.where(left, 0, 1))
    assert run("regularize two.inp same.vtu --interfaces ignore --report same.json --picture same.png") == 0
    assert "region" not in hc.read("same.vtu").cell_data
    assert json.loads((here / "same.json").read_text())["regions"] == []
    widths = [imread(here / name).shape[1] for name in ("two.png", "same.png")]
    assert widths == [2400, 1600]
    # An array that tells regions apart is there already.
    hc.write("two.vtu", hc.HexMesh(points, cells, cell_data={"material": left.astype(int)}))
    assert run("regularize two.vtu again.vtu") == 0
    assert "region" not in hc.read("again.vtu").cell_data
