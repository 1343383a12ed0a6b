"""Checkpoints of a run: what is kept, for which runs, and how often."""

from itertools import islice

import numpy as np
import pytest
from meshes.hexahedra import jittered_ball

import hexconformal as hc
from hexconformal import generate
from hexconformal.regularization import Checkpoint, Start
from hexconformal.regularization.resuming.schedule import CheckpointSchedule

BALL = jittered_ball()
OPTIONS = hc.Options()


def left_after(count, mesh=BALL):
    run = hc.Regularization(mesh)
    for _ in islice(run, count):
        pass
    return run


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.npz"


def test_what_a_run_has_reached_is_kept_to_the_last_bit(path):
    run = hc.Regularization(BALL)
    next(iter(run))
    checkpoint = Checkpoint(path, BALL, OPTIONS, schedule=CheckpointSchedule(share=1.0))
    checkpoint.offer(run)
    assert not path.exists()  # the input alone is nothing to go on from
    for number in (1, 6):
        for _ in islice(run, number):
            pass
        checkpoint.save(run.reached())
        found, reached = Checkpoint(path, BALL, OPTIONS).load(), run.reached()
        assert np.array_equal(found.points, reached.points)
        assert (found.lowered, found.on_the_way) == (reached.lowered, True)
        assert found.lowered == (number == 6)
    list(run)
    result = run.result()
    checkpoint.save(run.reached(result))
    last = Checkpoint(path, BALL, OPTIONS).load()
    assert np.array_equal(last.points, result.points)
    assert not last.on_the_way
    assert [one.name for one in path.parent.iterdir()] == ["run.npz"]


def test_it_belongs_to_one_mesh_and_one_set_of_options_whatever_the_limits(path):
    Checkpoint(path, BALL, OPTIONS).save(left_after(3).reached())
    for options in (hc.Options(max_iterations=7, gradient_tolerance=1e-3), hc.Options(hausdorff=5e-3)):
        Checkpoint(path, hc.as_hex_mesh(BALL), options).load()
    points, cells = BALL
    other = points.copy()
    other[7, 1] = np.nextafter(other[7, 1], 1.0)
    for mesh in ((other, cells), (points, cells[::-1]), (points, cells[:, [1, 2, 3, 0, 5, 6, 7, 4]])):
        with pytest.raises(hc.OptionError, match=r"run.npz belongs to another mesh, or a run with other options"):
            Checkpoint(path, mesh, OPTIONS).load()
    held = np.array([3, 5])
    for options in (hc.Options(hausdorff=0.01), hc.Options(fixed=held), hc.Options(target=points)):
        with pytest.raises(hc.OptionError, match="belongs to another"):
            Checkpoint(path, BALL, options).load()
    Checkpoint(path, BALL, hc.Options(fixed=held)).save(left_after(3).reached())
    Checkpoint(path, BALL, hc.Options(fixed=[3, 5])).load()
    with pytest.raises(hc.OptionError, match="belongs to another"):
        Checkpoint(path, BALL, hc.Options(fixed=[3, 6])).load()


def test_nodes_are_known_by_their_global_ids_where_a_file_has_them(path):
    points, cells = BALL
    ids = np.random.default_rng(3).permutation(len(points))
    order = np.argsort(ids)
    one = hc.HexMesh(points, cells, {"GlobalNodeId": ids})
    # The same nodes in another order.
    other = hc.HexMesh(points[order], ids[cells], {"GlobalNodeId": ids[order]})
    run = left_after(5, one)
    Checkpoint(path, one, OPTIONS).save(run.reached())
    start = Checkpoint(path, other, OPTIONS).load()
    again = hc.Regularization(other, start=start)
    list(islice(again, 2))
    np.testing.assert_allclose(again.points, run.points[order], atol=1e-12)


def test_damage_is_told(path):
    state = left_after(3).reached()
    checkpoint = Checkpoint(path, BALL, OPTIONS)
    with pytest.raises(hc.ReadError, match="it does not exist"):
        checkpoint.load()
    checkpoint.save(state)
    with np.load(path) as file:
        sound = dict(file)
    for name, value in (("ids", None), ("points", sound["points"][:3]), ("ids", 1.0 * sound["ids"]), ("parts", [1, 2])):
        np.savez(path, **{key: one for key, one in (sound | {name: value}).items() if one is not None})
        with pytest.raises(hc.ReadError, match=r"checkpoint .*run.npz is damaged"):
            checkpoint.load()
    np.savez(path, **sound | {"parts": 1})
    with pytest.raises(hc.ReadError, match=r"run_0_0000.npz: it does not exist"):
        checkpoint.load()
    np.savez(path, **sound | {"ids": sound["ids"][1:], "points": sound["points"][1:]})
    with pytest.raises(hc.OptionError, match=r"start must have a point for each node .*: 1 \(ids 0\)"):
        hc.Regularization(BALL, start=checkpoint.load())


def test_a_checkpoint_costs_no_more_than_its_share_of_the_time(path, monkeypatch):
    now, written = [0.0], []
    monkeypatch.setattr("hexconformal.regularization.resuming.checkpoint.time.monotonic", lambda: now[0])

    class Slow:
        """A run that takes ten seconds for an iteration, and two to say what it has reached."""

        def reached(self, result=None):
            now[0] += 2.0
            written.append(now[0])
            return Start(BALL[0])

    checkpoint = Checkpoint(path, BALL, OPTIONS)
    for _ in range(100):
        now[0] += 10.0
        checkpoint.offer(Slow())
    assert CheckpointSchedule().share == 0.02
    assert len(written) == 10  # one in 100 seconds
    assert 2.0 * len(written) <= 0.02 * now[0] + 2.0


def test_what_runs_cannot_go_on_from_yet_is_refused_before_the_work(path):
    with pytest.raises(hc.OptionError, match="without another surface to slide on"):
        Checkpoint(path, BALL, hc.Options(surface="other.stl"))
    with pytest.raises(hc.OptionError, match="without cells of second order"):
        Checkpoint(path, hc.elevated(generate.sheared_cube(2), 27), OPTIONS)
    with pytest.raises(hc.WriteError, match="does not exist"):
        Checkpoint(path.parent / "nowhere" / "run.npz", BALL, OPTIONS)
