"""The page of a motion holds the mesh after each step, and its quality."""

from dataclasses import replace

import numpy as np
import pytest
from web_pages import PageFile

import hexconformal as hc
from hexconformal.motion import motion_page


@pytest.fixture(scope="module")
def moved():
    points, cells = hc.generate.box((4, 4, 4))
    lid = np.flatnonzero(points[:, 2] == points[:, 2].max())
    motion = hc.MeshMotion((points, cells), moving=lid, fixed=np.flatnonzero(points[:, 2] == 0.0))
    # The last lid would go through the base.
    ways = [[0.1, 0.0, 0.0], [0.2, 0.0, -0.1], [0.2, 0.0, -1.5]]
    return points, motion, [motion.step(np.tile(way, (len(lid), 1))) for way in ways]


def test_each_step_is_a_frame_with_its_quality(moved):
    points, motion, steps = moved
    assert steps[-1].report.refused
    page = PageFile(motion_page(motion, steps, [0.5, 1.5, 2.0]).to_html())
    frames = page.contents["frames"]
    assert [frame["name"] for frame in frames] == ["t = 0", "t = 0.5", "t = 1.5", "t = 2"]
    assert [frame["position"] for frame in frames] == [0.0, 1.0, 2.0, 3.0]
    for number, expected in enumerate([points, *(step.points for step in steps)]):
        assert page.frame(number)[0].tobytes() == expected.tobytes()
        measured = hc.quality(motion.mesh.replaced(expected)).scaled_jacobian
        np.testing.assert_array_equal(page.frame(number)[1]["scaled_jacobian"], measured)
    (curve,) = [one for one in page.contents["curves"] if one["title"] == "scaled Jacobian"]
    assert curve["lines"][1]["y"] == [step.report.min_scaled_jacobian for step in steps]
    assert page.contents["report"]["text"] == f"step 3: {steps[-1].report.reason}"


@pytest.mark.parametrize(
    "times", [[1.0, 2.0], [0.0, 1.0, 2.0], [1.0, 3.0, 2.0], [1.0, 2.0, np.inf], [1.0, np.nan, 3.0]]
)
def test_times_must_be_those_of_the_steps(moved, times):
    _, motion, steps = moved
    with pytest.raises(hc.OptionError, match="times must be 3"):
        motion_page(motion, steps, times)


def without_a_place(step):
    points = step.points.copy()
    points[7] = np.inf
    return replace(step, points=points)


@pytest.mark.parametrize(
    ("chosen", "error", "said"),
    [
        (lambda motion, steps: (motion, []), hc.OptionError, "at least one MotionStep"),
        (lambda motion, steps: (motion, steps[0]), hc.OptionError, "must be a sequence of MotionStep"),
        (lambda motion, steps: (motion, [steps[0].points]), hc.OptionError, "at index 0 has array"),
        (lambda motion, steps: (motion, steps, "abc"), hc.OptionError, "times must be an array of numbers"),
        (lambda motion, steps: (motion.mesh, steps), hc.OptionError, "must be a MeshMotion .* not HexMesh"),
        (
            lambda motion, steps: (hc.MeshMotion(hc.generate.box((2, 2, 2)), moving=[0]), steps),
            hc.MeshError,
            r"index 0 has points \(125, 3\), and the mesh of the motion \(27, 3\)",
        ),
        (lambda motion, steps: (motion, [steps[0], without_a_place(steps[1])]), hc.MeshError, r"index 1: .*ids 7\)"),
    ],
)
def test_what_is_no_motion_has_no_page(moved, chosen, error, said):
    _, motion, steps = moved
    with pytest.raises(error, match=said):
        motion_page(*chosen(motion, steps))
