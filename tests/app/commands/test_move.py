"""The `move` command: what it writes, refusals, and how runs go on."""

import numpy as np
import pytest
import pyvista as pv
from meshes.mixed import mixed_block, shuffled_grid
from program import frames, history

from hexconformal import HexMesh, ReadError, read, write
from hexconformal.app.cli import main
from hexconformal.generate import box
from hexconformal.motion.mesh_motion import MeshMotion
from hexconformal.motion.motion_table import read_motion


@pytest.fixture
def lifted(tmp_path):
    """A box of 3 x 3 x 3 whose lid rises by 0.2 and shifts by 0.1 in each of five steps of 0.5, its floor held."""
    points, cells = box((3, 3, 3), (3.0, 3.0, 3.0))
    floor = (points[:, 2] == 0).astype(float)
    write(tmp_path / "box.vtu", HexMesh(points, cells, {"floor": floor}))
    lid = np.flatnonzero(points[:, 2] == 3)
    table(tmp_path / "lid.csv", lid, [(0.5 * k, [0.1 * k, 0.0, 0.2 * k]) for k in range(1, 6)])
    return tmp_path, lid


def table(path, nodes, steps, when="time"):
    rows = [f"{time!r},{node},{dx!r},{dy!r},{dz!r}" for time, (dx, dy, dz) in steps for node in reversed(nodes)]
    path.write_text("\n".join([f"{when},node,dx,dy,dz", *rows]) + "\n")


def moved(folder, run, *words):
    arguments = [str(folder / "box.vtu"), str(folder / run), "--motion", str(folder / "lid.csv"), "--fixed", "floor"]
    return main(["move", *arguments, *words])


def test_move_tells_its_last_step(lifted, capsys):
    folder, _ = lifted
    assert moved(folder, "run") == 0
    told = capsys.readouterr().out.splitlines()
    assert told[-2].startswith("step ")
    assert "reached 100%" in told[-2]
    assert moved(folder, "quiet", "--quiet") == 0
    assert capsys.readouterr().out == ""


def test_move_leaves_frames_with_velocity_and_history(lifted):
    folder, lid = lifted
    assert moved(folder, "run") == 0
    shown = frames(folder / "run" / "run.pvd")
    assert [time for time, _ in shown] == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]
    meshes = [pv.read(path) for _, path in shown]
    for before, after in zip(meshes[:-1], meshes[1:], strict=True):
        assert after["mesh_velocity"] == pytest.approx((after.points - before.points) / 0.5, abs=1e-12)
        assert after["scaled_jacobian"].min() > 0.5
    assert meshes[-1].points[lid] == pytest.approx(meshes[0].points[lid] + [0.5, 0.0, 1.0])
    floor = meshes[0]["floor"] > 0
    assert (meshes[-1].points[floor] == meshes[0].points[floor]).all()
    rows = history(folder / "run" / "history.csv", "seconds")
    assert [int(row["step"]) for row in rows] == [1, 2, 3, 4, 5]
    assert float(rows[-1]["min_scaled_jacobian"]) == pytest.approx(meshes[-1]["scaled_jacobian"].min())
    assert pv.read(folder / "run" / "last.vtu").points == pytest.approx(meshes[-1].points)


def test_every_operator_and_another_place_for_frames(lifted):
    folder, _ = lifted
    for operator in ("harmonic", "elastic"):
        pvd = folder / f"{operator}.pvd"
        words = ["--operator", operator, "--every", "2", "--frames", str(pvd), "--quiet"]
        assert moved(folder, operator, *words) == 0
        assert [time for time, _ in frames(pvd)] == [0.0, 1.0, 2.0, 2.5]


def test_an_interrupted_run_goes_on_as_if_nothing_had_been(lifted, monkeypatch, capsys):
    folder, _ = lifted
    assert moved(folder, "whole", "--quiet") == 0
    once = MeshMotion.step
    calls = iter(range(9))

    def interrupted(self, displacement, dt=None):
        if next(calls) == 2:
            raise KeyboardInterrupt
        return once(self, displacement, dt)

    monkeypatch.setattr(MeshMotion, "step", interrupted)
    assert moved(folder, "parts", "--quiet") == 130
    assert "interrupted after step 2" in capsys.readouterr().err
    assert len(history(folder / "parts" / "history.csv", "seconds")) == 2
    assert moved(folder, "parts", "--resume", "--quiet") == 0
    assert history(folder / "parts" / "history.csv", "seconds") == history(folder / "whole" / "history.csv", "seconds")
    for (time, one), (other_time, other) in zip(
        frames(folder / "parts" / "run.pvd"), frames(folder / "whole" / "run.pvd"), strict=True
    ):
        assert time == other_time
        assert (pv.read(one).points == pv.read(other).points).all()


def test_a_refusal_names_the_cells_and_can_be_gone_on_from(lifted, capsys):
    folder, lid = lifted
    table(folder / "lid.csv", lid, [(1, [0.0, 0.0, -1.0]), (2, [0.0, 0.0, -4.0])], when="step")
    assert moved(folder, "run", "--quiet") == 1
    said = capsys.readouterr().err
    assert "step 2 was refused" in said
    assert "invert cells" in said
    rows = history(folder / "run" / "history.csv", "seconds")
    assert float(rows[0]["reached"]) == 1.0
    assert 0.5 < float(rows[1]["reached"]) < 0.7
    last = pv.read(folder / "run" / "last.vtu")
    assert last["blocked"].sum() > 0
    assert last["scaled_jacobian"].min() > 0
    table(folder / "lid.csv", lid, [(1, [0.0, 0.0, -1.0]), (2, [0.0, 0.0, -1.5])], when="step")
    assert moved(folder, "run", "--resume", "--quiet") == 0
    assert [row["reached"] for row in history(folder / "run" / "history.csv", "seconds")] == ["1.0", "1.0"]


def test_a_run_is_not_overwritten_or_mixed_unasked(lifted, capsys):
    folder, _ = lifted
    assert moved(folder, "run", "--resume") == 2
    assert "no run" in capsys.readouterr().err
    assert moved(folder, "run", "--quiet") == 0
    assert moved(folder, "run", "--quiet") == 2
    assert "--resume goes on" in capsys.readouterr().err
    assert moved(folder, "run", "--resume", "--operator", "harmonic") == 2
    assert "other options" in capsys.readouterr().err
    assert moved(folder, "run", "--overwrite", "--quiet") == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,node,dx,dy\n", "missing: dz"),
        ("node,dx,dy,dz\n", "missing: step"),
        ("", "must have the columns"),
        ("time,node,dx,dy,dz\n", "must have rows"),
        ("time,node,dx,dy,dz\n0,1,0,0,0\n", "times above 0"),
        ("time,node,dx,dy,dz\n1,1,0,0,x\n", "must be numbers"),
        ("time,node,dx,dy,dz\n1,1.5,0,0,0\n", "whole node ids"),
        ("time,node,dx,dy,dz\n1,1,0,0,nan\n", "finite"),
        ("time,node,dx,dy,dz\n1,1,0,0,0\n1,2,0,0,0\n2,1,0,0,0\n", "same nodes"),
        ("time,node,dx,dy,dz\n1,1,0,0,0\n2,2,0,0,0\n", "same nodes"),
        ("time,node,dx,dy,dz\n1,1,0,0,0\n1,1,0,0,0\n", "each once"),
    ],
)
def test_tables_that_make_no_sense_are_refused(tmp_path, text, message):
    (tmp_path / "motion.csv").write_text(text)
    with pytest.raises(ReadError, match=message):
        read_motion(tmp_path / "motion.csv")


def test_a_table_that_is_not_there_is_told(tmp_path):
    with pytest.raises(ReadError, match=r"missing\.csv does not exist$"):
        read_motion(tmp_path / "missing.csv")


def test_interfaces_are_those_of_a_named_array(tmp_path, capsys):
    points, cells = box((4, 2, 2), (2.0, 1.0, 1.0))
    layer = np.where(points[cells].mean(axis=1)[:, 0] < 1.0, 1, 2)
    path, wall_moves, folder = tmp_path / "a.vtu", tmp_path / "motion.csv", tmp_path / "run"
    write(path, HexMesh(points, cells, cell_data={"layer": layer}))
    wall = np.flatnonzero(points[:, 0] == 0)
    table(wall_moves, wall, [(0.1, [0.5, 0.0, 0.0])])
    words = ["move", str(path), str(folder), "--motion", str(wall_moves)]
    assert main([*words, "--interfaces", "layer"]) == 0
    assert "interfaces: 2 regions (array 'layer': 1, 2), 4 faces" in capsys.readouterr().out
    assert read(folder / "last.vtu").points[points[:, 0] == 1, 0] == pytest.approx(1.25)
    # Another choice of interfaces is another run.
    assert main([*words, "--resume"]) == 2


@pytest.fixture
def pushed(tmp_path):
    """A bar of all types, its cells in any order and quadrilaterals among them, whose end is pushed and twisted."""
    grid = shuffled_grid(mixed_block(2))
    grid["wall"] = (grid.points[:, 0] == 8.0).astype(float)
    grid["piston"] = (grid.points[:, 0] == 0.0).astype(float)
    grid.save(tmp_path / "box.vtu")
    piston = np.flatnonzero(grid["piston"])
    table(tmp_path / "lid.csv", piston, [(0.5 * k, [0.4 * k, 0.1 * k, 0.0]) for k in range(1, 5)])
    return tmp_path, grid


def move_words(folder, run, *words):
    return main(["move", str(folder / "box.vtu"), str(folder / run), "--motion", str(folder / "lid.csv"), *words])


def test_a_mesh_of_all_types_moves_with_frames_and_a_column_for_each(pushed, capsys):
    folder, grid = pushed
    assert move_words(folder, "run", "--fixed", "wall") == 0
    told = capsys.readouterr().out
    assert "hexahedra 0." in told
    assert "tetrahedra 0." in told
    shown = frames(folder / "run" / "run.pvd")
    assert [time for time, _ in shown] == [0.0, 0.5, 1.0, 1.5, 2.0]
    solid = grid.celltypes != 9
    types = {"hexahedron": 12, "wedge": 13, "pyramid": 14, "tetra": 10}
    rows = history(folder / "run" / "history.csv", "seconds")
    for (_, path), row in zip(shown[1:], rows, strict=True):
        frame = pv.read(path)
        np.testing.assert_array_equal(frame.celltypes, grid.celltypes)
        np.testing.assert_array_equal(frame.cell_connectivity, grid.cell_connectivity)
        assert np.isnan(frame["scaled_jacobian"][~solid]).all()
        for name, code in types.items():
            least = frame["scaled_jacobian"][frame.celltypes == code].min()
            assert float(row[f"min_{name}"]) == pytest.approx(least)
            assert least > 0.2
    last = pv.read(folder / "run" / "last.vtu")
    assert last["blocked"].sum() == 0
    wall = grid["wall"] > 0
    np.testing.assert_array_equal(last.points[wall], grid.points[wall])
    # Of types that there are none of there is no figure.
    points, cells = box((3, 3, 3), (3.0, 3.0, 3.0))
    write(folder / "box.vtu", HexMesh(points, cells))
    table(folder / "lid.csv", [0, 1], [(0.5, [0.1, 0.0, 0.0])])
    assert move_words(folder, "hexahedra", "--quiet") == 0
    row = history(folder / "hexahedra" / "history.csv", "seconds")[0]
    assert row["min_hexahedron"] == row["min_scaled_jacobian"]
    assert row["min_wedge"] == row["min_pyramid"] == row["min_tetra"] == ""


def test_a_group_moves_as_one_and_an_interrupted_run_goes_on(pushed, monkeypatch):
    folder, grid = pushed
    steps = "".join(f"{0.5 * k},{0.4 * k},0.0,0.0\n" for k in range(1, 5))
    (folder / "lid.csv").write_text("time,dx,dy,dz\n" + steps)
    words = ["--moving", "piston", "--fixed", "wall", "--quiet"]
    assert move_words(folder, "whole", *words) == 0
    piston = grid["piston"] > 0
    last = pv.read(folder / "whole" / "last.vtu").points
    np.testing.assert_allclose(last[piston], grid.points[piston] + [1.6, 0.0, 0.0])
    once, calls = MeshMotion.step, iter(range(9))

    def interrupted(self, displacement, dt=None):
        if next(calls) == 2:
            raise KeyboardInterrupt
        return once(self, displacement, dt)

    with monkeypatch.context() as patch:
        patch.setattr(MeshMotion, "step", interrupted)
        assert move_words(folder, "parts", *words) == 130
    assert move_words(folder, "parts", *words, "--resume") == 0
    np.testing.assert_array_equal(pv.read(folder / "parts" / "last.vtu").points, last)
    rows = [history(folder / name / "history.csv", "seconds") for name in ("parts", "whole")]
    assert rows[0] == rows[1]


def test_a_refused_step_of_a_mesh_of_all_types_marks_cells_of_the_file(pushed, capsys):
    folder, grid = pushed
    piston = np.flatnonzero(grid["piston"])
    table(folder / "lid.csv", piston, [(1.0, [9.0, 0.0, 0.0])])
    assert move_words(folder, "run", "--fixed", "wall", "--quiet") == 1
    assert "step 1 was refused" in capsys.readouterr().err
    last = pv.read(folder / "run" / "last.vtu")
    assert np.nanmin(last["scaled_jacobian"]) > 0.0
    step = MeshMotion(grid, piston, "wall").step(np.tile([9.0, 0.0, 0.0], (len(piston), 1)))
    marked = np.flatnonzero(grid.celltypes != 9)[step.report.blocked]
    assert 0 < len(marked) < grid.n_cells / 2
    np.testing.assert_array_equal(np.flatnonzero(last["blocked"]), marked)


def test_hexahedra_beside_cells_that_are_kept(pushed):
    folder, grid = pushed
    piston = np.flatnonzero(grid["piston"])
    table(folder / "lid.csv", piston, [(1.0, [0.0, 0.0, 0.0])])
    assert move_words(folder, "run", "--other-cells", "keep", "--quiet") == 0
    np.testing.assert_array_equal(pv.read(folder / "run" / "last.vtu").points, grid.points)
