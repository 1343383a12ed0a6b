"""The command `move` on ranks: frames, history, refusals, and how runs go on, as in one process."""

from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from program import frames, history, run

from hexconformal import HexMesh, generate, quality, read, write

PROGRAMS = Path(__file__).with_name("programs")
WORDS = "--motion lid.csv --fixed floor --energy-tolerance 1e-16"
DIAGONAL = np.linalg.norm([1.0, 1.0, 1.5])


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A block of two materials, its floor held, whose lid rises, bends and shifts in each of four steps of 0.5."""
    monkeypatch.chdir(tmp_path)
    points, cells = generate.jittered(*generate.box((4, 4, 5), (1.0, 1.0, 1.5)), 0.15, seed=1)
    floor, lid = (points[:, 2] == height for height in (0.0, 1.5))
    material = (points[cells].mean(axis=1)[:, 0] > 0.5).astype(int)
    write("box.vtu", HexMesh(points, cells, {"floor": floor, "lid": lid}, {"material": material}))
    rises = [(0.5 * k, [[0.02 * k, 0.0, 0.06 * k * np.sin(np.pi * x)] for x in points[:, 0]]) for k in range(1, 5)]
    table("lid.csv", np.flatnonzero(lid)[::-1], rises)
    Path("alike.csv").write_text("time,dx,dy,dz\n0.5,0.1,0.0,0.1\n1.0,0.2,0.0,0.2\n")
    return tmp_path


def table(path, nodes, steps):
    rows = [f"{time!r},{node}," + ",".join(repr(float(x)) for x in way[node]) for time, way in steps for node in nodes]
    Path(path).write_text("\n".join(["time,node,dx,dy,dz", *rows]) + "\n")


def program(words):
    return ["-m", "hexconformal", *words.split()]


def arrays(path):
    """Points and arrays of a file in the order of the ids, which one process has by the places."""
    mesh = pv.read(path)
    nodes = np.unique(mesh.point_data.get("GlobalNodeId", np.arange(mesh.n_points)), return_index=True)[1]
    cells = np.argsort(mesh.cell_data.get("GlobalCellId", np.arange(mesh.n_cells)))
    at_nodes, at_cells = (
        {name: data[name][order] for name in data if not name.startswith("Global")}
        for data, order in ((mesh.point_data, nodes), (mesh.cell_data, cells))
    )
    return {"points": mesh.points[nodes], **at_nodes, **at_cells}


def are_alike(one, other):
    found, expected = arrays(one), arrays(other)
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        bound = 1e-8 * DIAGONAL if name == "points" else 1e-7
        np.testing.assert_allclose(found[name], values, rtol=0, atol=bound, err_msg=name)


def runs_are_alike(one, other, last="last.pvtu"):
    shown, expected = (frames(Path(name) / "run.pvd") for name in (one, other))
    assert [time for time, _ in shown] == [time for time, _ in expected]
    for (_, path), (_, whole) in zip(shown, expected, strict=True):
        are_alike(path, whole)
    are_alike(Path(one) / last, Path(other) / "last.vtu")
    rows, told = (history(Path(name) / "history.csv", "seconds", "iterations") for name in (one, other))
    assert [row["step"] for row in rows] == [row["step"] for row in told]
    for row, whole in zip(rows, told, strict=True):
        for name, value in whole.items():
            assert row[name] == value or float(row[name]) == pytest.approx(float(value), rel=1e-6), name


@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_a_motion_is_that_of_one_process(mpiexec, folder, capsys, ranks):
    said = mpiexec(ranks, *program(f"move box.vtu ranks {WORDS} --mpi")).stdout.splitlines()
    assert run(f"move box.vtu one {WORDS}") == 0
    told = capsys.readouterr().out.splitlines()
    assert said[:-2] == [line for line in told[:-2] if line.startswith("note: interfaces")]
    assert said[-2].partition("substeps")[0] == told[-2].partition("substeps")[0]
    assert said[-1] == "wrote ranks/run.pvd, history.csv, last.pvtu"
    runs_are_alike("ranks", "one")
    assert {"floor", "lid", "mesh_velocity"} <= set(pv.read("ranks/last.pvtu").point_data)
    # ParaView's reader plays the series; another number of ranks reads a frame.
    series = pv.get_reader("ranks/run.pvd")
    series.set_active_time_value(2.0)
    assert series.read()[0]["scaled_jacobian"].min() == pytest.approx(quality("one/last.vtu").scaled_jacobian.min())
    assert "80 cells" in mpiexec(ranks % 3 + 1, *program("quality ranks/run_frames/run_0003.pvtu --mpi")).stdout


@pytest.mark.parametrize("others", [1, 2, 0])
def test_an_interrupted_run_goes_on_on_other_ranks_or_in_one_process(mpiexec, folder, others):
    assert run(f"move box.vtu one {WORDS} --quiet") == 0
    said = mpiexec(3, PROGRAMS / "interrupted_move.py", *f"move box.vtu parts {WORDS} --mpi".split(), fails=True).stderr
    assert said.count("interrupted after step 3: --resume goes on from there") == 1
    assert quality("parts/last.pvtu").valid.all()
    assert [time for time, _ in frames(Path("parts/run.pvd"))] == [0.0, 0.5, 1.0, 1.5]
    again = f"move box.vtu parts {WORDS} --resume"
    if others:
        mpiexec(others, *program(f"{again} --mpi"))
        runs_are_alike("parts", "one")
        assert not Path("parts/last.vtu").exists()
    else:
        assert run(f"{again} --quiet") == 0
        runs_are_alike("parts", "one", "last.vtu")
        assert not Path("parts/last.pvtu").exists()
    said = mpiexec(2, *program(f"{again} --operator harmonic --mpi"), fails=True).stderr
    assert said.count("belongs to another mesh, or to other options") == 1


def test_ranks_go_on_from_what_one_process_has_left(mpiexec, folder):
    assert run(f"move box.vtu one {WORDS} --quiet") == 0
    rows = Path("lid.csv").read_text().splitlines()
    half = [line for line in rows if not line.startswith(("1.5", "2.0"))]
    Path("half.csv").write_text("\n".join(half) + "\n")
    assert run(f"move box.vtu parts {WORDS.replace('lid', 'half')} --quiet") == 0
    Path("other.csv").write_text(Path("lid.csv").read_text().replace(half[-1], half[-1] + "1"))
    said = mpiexec(2, *program(f"move box.vtu parts {WORDS.replace('lid', 'other')} --mpi --resume"), fails=True).stderr
    assert said.count("the table must be that of the run up to step 2: there it is another one") == 1
    mpiexec(2, *program(f"move box.vtu parts {WORDS} --mpi --resume"))
    runs_are_alike("parts", "one")
    assert not Path("parts/last.vtu").exists()


def test_a_refused_step_leaves_the_mesh_as_far_as_it_went(mpiexec, folder, capsys):
    lid = np.flatnonzero(read("box.vtu").points[:, 2] == 1.5)
    down = {node: [0.0, 0.0, -3.0] for node in lid}
    table("down.csv", lid, [(1.0, {node: [0.0, 0.0, -0.1] for node in lid}), (2.0, down)])
    words = "move box.vtu {} --motion down.csv --fixed floor --energy-tolerance 1e-16"
    assert run(words.format("one")) == 1
    one = capsys.readouterr().err
    said = mpiexec(3, *program(f"{words.format('ranks')} --mpi"), fails=True).stderr
    assert one.startswith("error: step 2 was refused: the boundary stopped after")
    assert said.count(one.strip()) == 1
    # As far as it went it is solved to little, from a guess that depends on the ranks: cells and share are the same.
    are_alike("ranks/run_frames/run_0001.pvtu", "one/run_frames/run_0001.vtu")
    stood, expected = (arrays(path)["blocked"] for path in ("ranks/last.pvtu", "one/last.vtu"))
    assert expected.any()
    assert np.array_equal(stood, expected)
    assert quality("ranks/last.pvtu").valid.all()
    reached = [float(history(Path(name) / "history.csv")[1]["reached"]) for name in ("ranks", "one")]
    assert reached[0] == pytest.approx(reached[1], abs=0.005)
    assert Path("ranks/history.csv").read_text().count("\n") == 3


def test_a_set_of_a_file_that_the_first_rank_reads_moves_as_one(mpiexec, folder):
    write("box.msh", read("box.vtu"))
    words = "--motion alike.csv --moving lid --fixed floor --energy-tolerance 1e-16"
    mpiexec(3, *program(f"move box.msh ranks {words} --every 2 --frames series.pvd --quiet --mpi"))
    assert run(f"move box.vtu one {words} --quiet") == 0
    found, expected = (arrays(path)["points"] for path in ("ranks/last.pvtu", "one/last.vtu"))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * DIAGONAL)
    assert [(time, path.name) for time, path in frames(Path("series.pvd"))] == [
        (0.0, "series_0000.pvtu"),
        (1.0, "series_0001.pvtu"),
    ]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("move box.vtu run --motion lid.csv --html a.html", "--html must go without --mpi"),
        ("move box.vtu run --motion lid.csv --other-cells keep", "--other-cells keep must go without --mpi"),
        ("move box.vtu run --motion lid.csv --every 0", "every must be 1 or more, not 0"),
        ("move box.inp run --motion lid.csv", "on ranks a table that names nodes must go with a .vtu file"),
        ("move box.vtu run --motion alike.csv", "the table has no column node, moving is None"),
        ("move box.vtu run --motion many.csv", "nodes of the table must be in the mesh; others: 1 (ids 9999)"),
        ("move box.vtu run --motion lid.csv --fixed flor", "fixed='flor' names no point array"),
        ("move box.vtu run --motion nowhere.csv", "nowhere.csv does not exist"),
        ("move nowhere.vtu run --motion lid.csv", "nowhere.vtu does not exist"),
        ("move box.vtu box.vtu --motion lid.csv", "cannot make the folder box.vtu: it is a file"),
    ],
)
def test_what_cannot_be_done_is_said_once_before_the_work(mpiexec, folder, words, message):
    Path("many.csv").write_text("time,node,dx,dy,dz\n1.0,3,0,0,0\n1.0,9999,0,0,0\n")
    write("box.inp", read("box.vtu"))
    said = mpiexec(2, *program(f"{words} --mpi"), fails=True).stderr
    assert said.count(message) == 1, said
    assert "Traceback" not in said
    assert not list(folder.glob("run/*"))


def test_a_run_is_not_replaced_unasked_and_damage_is_told(mpiexec, folder):
    words = "move box.vtu ranks --motion alike.csv --moving lid"
    mpiexec(3, *program(f"{words} --quiet --mpi"))
    said = mpiexec(2, *program(f"{words} --mpi"), fails=True).stderr
    assert said.count("ranks holds a run: --resume goes on with it, --overwrite starts anew") == 1
    mpiexec(2, *program(f"{words} --overwrite --quiet --mpi"))
    assert not Path("ranks/run_frames/run_0001_0002.vtu").exists()  # of the run before, which had three
    whole = np.load("ranks/checkpoint.npz")
    np.savez("ranks/checkpoint.npz", **{name: whole[name] for name in whole.files if name != "prescribed"})
    said = mpiexec(2, *program(f"{words} --resume --mpi"), fails=True).stderr
    assert said.count("is damaged (KeyError: 'prescribed')") == 1, said
    # An output that would be a piece of the input.
    said = mpiexec(
        2, *program("move ranks/last.pvtu ranks --motion alike.csv --moving lid --overwrite --mpi"), fails=True
    )
    assert said.stderr.count("last.pvtu") == 1
    assert "the input already" in said.stderr
