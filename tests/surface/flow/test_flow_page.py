"""The page of a flow holds its moments, and the numbers of its steps."""

import numpy as np
import pytest
import pyvista as pv
from web_pages import PageFile

import surface
from hexconformal import OptionError
from hexconformal.page import PageSchedule
from surface.flow import flow_page


@pytest.fixture(scope="module")
def moments():
    ball = pv.Icosphere(nsub=1).scale([1.0, 1.0, 1.6])
    return list(surface.evolve(surface.MeanCurvature(ball), steps=5))


def test_each_moment_is_a_frame_with_the_numbers_of_its_step(moments):
    page = PageFile(flow_page(moments, title="ball").to_html())
    names = [frame["name"] for frame in page.contents["frames"]]
    assert names == [f"t = {moment.record.time:.6g}" for moment in moments]
    for number, moment in enumerate(moments):
        points, of_cells, of_points = page.frame(number)
        assert points.tobytes() == moment.points.tobytes()
        np.testing.assert_array_equal(of_cells["conformality"], surface.quality(moment.mesh).conformality)
        np.testing.assert_array_equal(of_points["mean_curvature"], moment.surface_mesh.point_data["mean_curvature"])
    assert [frame["position"] for frame in page.contents["frames"]] == list(range(6))
    energy = page.contents["curves"][0]
    assert energy["lines"][0]["y"] == [moment.record.energy for moment in moments]
    assert page.contents["report"]["text"] == str(moments[-1].record)


def test_of_many_moments_an_even_choice_is_shown(moments):
    page = PageFile(flow_page(moments, schedule=PageSchedule(most_frames=2)).to_html())
    shown = [frame["position"] for frame in page.contents["frames"]]
    assert shown == [0.0, 2.0, 3.0, 5.0]


def test_a_run_that_has_not_begun_has_no_page():
    with pytest.raises(OptionError, match="at least one"):
        flow_page([])
