"""The page of a flow holds its moments, and the numbers of its steps."""

from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv
from web_pages import PageFile

import surface
from hexconformal import MeshError, OptionError
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


def other_cells(moment):
    """The same moment of a surface with two cells in the other order."""
    mesh = moment.mesh
    faces = np.roll(mesh.regular_faces, 1, axis=0)
    again = pv.PolyData.from_regular_faces(np.array(mesh.points), faces)
    return next(iter(surface.evolve(surface.MeanCurvature(again), steps=1)))


@pytest.mark.parametrize(
    ("chosen", "error", "said"),
    [
        (lambda seen: [], OptionError, "at least one Moment"),
        (lambda seen: 3, OptionError, "must be a sequence of Moment, not 3"),
        (lambda seen: seen[0], OptionError, "must be a sequence of Moment"),
        (lambda seen: [seen[0], seen[1].mesh], OptionError, "at index 1 has PolyData"),
        (lambda seen: [seen[0], seen[2], seen[1]], OptionError, "index 2 is earlier"),
        (lambda seen: [other_cells(seen[0]), *seen[1:]], MeshError, "index 1 is of a surface with other cells"),
        (lambda seen: [seen[0], replace(seen[1], points=seen[1].points * np.nan)], MeshError, "index 1: .* NaN .* 42"),
    ],
)
def test_what_is_no_run_has_no_page(moments, chosen, error, said):
    with pytest.raises(error, match=said):
        flow_page(chosen(moments))
