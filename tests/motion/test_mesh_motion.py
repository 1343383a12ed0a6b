"""Moving meshes: how far they go, the way back, refusals, velocities, restarts."""

import numpy as np
import pytest
from meshes.hexahedra import cube_in_cube, turned

from hexconformal import MeshError, OptionError
from hexconformal.elements import corner_scaled_jacobian, is_valid
from hexconformal.generate import box, cylinder
from hexconformal.motion.mesh_motion import MeshMotion

MOTIONS = {
    "about z": (lambda x, k: turned(x, [0, 0, 1], 10 * k), 6),
    "about the diagonal": (lambda x, k: turned(x, [1, 1, 1], 10 * k), 7),
    "translation": (lambda x, k: np.tile([0.1 * k, 0, 0], (len(x), 1)), 8),
}


@pytest.mark.long
@pytest.mark.parametrize(("way", "steps"), MOTIONS.values(), ids=MOTIONS)
def test_a_cube_in_a_cube_goes_far_and_comes_back(way, steps):
    points, cells, inner, outer = cube_in_cube()
    motion = MeshMotion((points, cells), inner, outer)
    lowest = []
    for k in range(1, steps + 1):
        step = motion.step(way(points[inner], k))
        assert not step.report.refused
        assert is_valid(step.points, cells).all()
        assert np.allclose(step.points[inner], points[inner] + way(points[inner], k), atol=1e-14)
        assert (step.points[outer] == points[outer]).all()
        lowest.append(step.report.min_scaled_jacobian)
        assert lowest[-1] == pytest.approx(corner_scaled_jacobian(step.points, cells).min())
    if way is MOTIONS["about z"][0]:
        assert lowest[2] >= 0.33
    for k in range(steps - 1, -1, -1):
        step = motion.step(way(points[inner], k))
    assert np.abs(step.points - points).max() <= 1e-8 * 0.25


@pytest.mark.parametrize(("operator", "limit"), [("harmonic", 40), ("elastic", 40)])
def test_linear_operators_end_earlier_and_say_where(operator, limit):
    points, cells, inner, outer = cube_in_cube()
    motion = MeshMotion((points, cells), inner, outer, operator=operator)
    for degrees in range(10, limit, 10):
        assert not motion.step(turned(points[inner], [0, 0, 1], degrees)).report.refused
    step = motion.step(turned(points[inner], [0, 0, 1], limit))
    assert step.report.refused
    assert 0 < step.report.reached < 1
    assert len(step.report.blocked)
    assert "invert cells" in step.report.reason
    assert is_valid(step.points, cells).all()


def test_walls_slide_unless_they_are_fixed():
    points, cells = box((6, 4, 4), (6.0, 4.0, 4.0))
    piston = np.flatnonzero(points[:, 0] == 0)
    slid = MeshMotion((points, cells), piston).step(np.tile([3.0, 0, 0], (len(piston), 1)))
    even = points.copy()
    even[:, 0] = 3 + points[:, 0] / 2
    assert slid.points == pytest.approx(even, abs=1e-3)
    wall = np.flatnonzero((points[:, 1] == 0) & (points[:, 0] > 0))
    held = MeshMotion((points, cells), piston, wall).step(np.tile([0.5, 0, 0], (len(piston), 1)))
    assert (held.points[wall] == points[wall]).all()
    curved, cells = cylinder()
    lid = np.flatnonzero(curved[:, 2] == curved[:, 2].max())
    step = MeshMotion((curved, cells), lid).step(np.tile([0, 0, 0.2], (len(lid), 1)))
    bottom = curved[:, 2] == curved[:, 2].min()
    assert step.points[bottom, 2] == pytest.approx(curved[bottom, 2])


def test_steps_follow_the_order_of_the_ids_and_give_the_velocity():
    points, cells = box((3, 3, 3), (3.0, 3.0, 3.0))
    ids = np.array([63, 48, 50, 60])
    displacement = 0.1 * np.arange(12.0).reshape(4, 3)
    motion = MeshMotion((points, cells), ids)
    step = motion.step(displacement / 10, dt=0.5)
    assert step.points[ids] == pytest.approx(points[ids] + displacement / 10, abs=1e-15)
    assert step.velocity == pytest.approx((step.points - points) / 0.5)
    again = motion.step(displacement / 5, dt=0.5)
    assert again.velocity == pytest.approx((again.points - step.points) / 0.5)
    assert motion.step(displacement / 5).velocity is None


def test_a_restart_goes_on_as_if_nothing_had_been():
    points, cells, inner, outer = cube_in_cube(6)
    whole = MeshMotion((points, cells), inner, outer)
    for degrees in (10, 20):
        whole.step(turned(points[inner], [0, 0, 1], degrees))
    other = MeshMotion((points, cells), inner, outer)
    other.resume(whole.state())
    goal = turned(points[inner], [0, 0, 1], 30)
    assert (whole.step(goal).points == other.step(goal).points).all()
    with pytest.raises(OptionError, match="the same mesh"):
        MeshMotion((points, cells), inner[1:], outer).resume(whole.state())


def test_current_target_forgets_the_initial_mesh():
    points, cells, inner, outer = cube_in_cube(6)
    ends = {}
    for target in ("input", "current"):
        motion = MeshMotion((points, cells), inner, outer, target=target)
        for degrees in (15, 30, 15, 0):
            step = motion.step(turned(points[inner], [0, 0, 1], degrees))
        ends[target] = np.abs(step.points - points).max()
    assert ends["input"] == 0.0
    assert 1e-8 < ends["current"] < 0.2


@pytest.mark.long
def test_boundary_layers_keep_their_grading():
    points, cells = box((8, 8, 10), (1.0, 1.0, 10.0))
    heights = np.concatenate([[0], np.cumsum(0.002 * 1.8 ** np.arange(10))])
    points[:, 2] = heights[np.rint(points[:, 2]).astype(int)]
    wall = np.flatnonzero(points[:, 2] == 0)
    bump = np.zeros((len(wall), 3))
    bump[:, 2] = 0.2 * np.prod(np.sin(np.pi * points[wall, :2]), axis=1)
    step = MeshMotion((points, cells), wall).step(bump)
    assert not step.report.refused
    first = np.linalg.norm(step.points[cells[:64, 4:]] - step.points[cells[:64, :4]], axis=2)
    assert first.min() > 0.5 * 0.002
    assert first.max() < 2.0 * 0.002


def test_a_boundary_that_makes_cells_impossible_is_refused():
    points, cells = box((2, 2, 2), (2.0, 2.0, 2.0))
    lid = np.flatnonzero(points[:, 2] == 2)
    motion = MeshMotion((points, cells), lid, fixed=np.flatnonzero(points[:, 2] == 0))
    step = motion.step(np.tile([0, 0, -2.5], (len(lid), 1)))
    assert step.report.refused
    assert is_valid(step.points, cells).all()
    assert step.report.reached == pytest.approx(0.8, abs=0.02)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"moving": []}, "nothing moves"),
        ({"moving": [0, 0]}, "every node once"),
        ({"moving": [99]}, r"ids in 0\.\.26; outside: 1 .ids 99."),
        ({"moving": [0], "target": "none"}, "'input' or 'current'"),
        ({"moving": [0], "operator": "magic"}, "not 'magic'"),
        ({"moving": [0], "energy_tolerance": 2}, "tolerance"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, message):
    with pytest.raises(OptionError, match=message):
        MeshMotion(box((2, 2, 2), (2.0, 2.0, 2.0)), **options)


def test_displacements_that_make_no_sense_are_refused():
    motion = MeshMotion(box((2, 2, 2), (2.0, 2.0, 2.0)), [0, 1])
    for displacement in (np.zeros((3, 3)), np.full((2, 3), np.nan)):
        with pytest.raises(OptionError, match="finite array"):
            motion.step(displacement)
    for dt in (0.0, np.inf):
        with pytest.raises(OptionError, match="dt must be positive and finite"):
            motion.step(np.zeros((2, 3)), dt=dt)


def test_a_mesh_that_is_not_valid_does_not_begin():
    points, cells = box((2, 2, 2), (2.0, 2.0, 2.0))
    points[13] += [1.5, 0, 0]
    with pytest.raises(MeshError, match="must be valid at the start: 4"):
        MeshMotion((points, cells), [0])
