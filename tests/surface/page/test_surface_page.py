"""Pages of surfaces hold what the surfaces have."""

import numpy as np
import pytest
from meshes.surfaces import as_arrays, mixed_sphere, shaken
from web_pages import PageFile

import surface
from hexconformal import MeshError
from surface.page import surface_page


def test_cells_and_measures_of_triangles_and_quadrilaterals():
    points, triangles, quads = as_arrays(mixed_sphere(4))
    page = PageFile(surface_page((points, triangles, quads)).to_html())
    faces, sides = (page.array(page.contents[name]) for name in ("faces", "sides"))
    np.testing.assert_array_equal(faces[: len(triangles), :3], triangles)
    np.testing.assert_array_equal(faces[: len(triangles), 3], triangles[:, 2])
    np.testing.assert_array_equal(faces[len(triangles) :], quads)
    np.testing.assert_array_equal(sides[:, 0], np.arange(len(faces)))
    assert (sides[:, 1] == -1).all()
    measured = surface.quality((points, triangles, quads))
    found_points, of_cells, _ = page.frame(0)
    assert found_points.tobytes() == points.tobytes()
    for name, values in measured.arrays().items():
        np.testing.assert_array_equal(of_cells[name], values)
    radius_ratio = next(one for one in page.contents["measures"] if one["name"] == "radius_ratio")
    assert sum(radius_ratio["after"]) == len(triangles)  # quadrilaterals have none
    assert page.contents["cells"]["type_names"] == ["triangle", "quadrilateral"]
    assert page.contents["layers"] is None


def test_a_measure_that_no_cell_has_is_left_out():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    page = PageFile(surface_page((square, [[0, 1, 2], [0, 2, 3]])).to_html())
    assert "scaled_jacobian" not in [one["name"] for one in page.contents["measures"]]


def test_the_page_of_a_remeshing_has_its_curves_and_distances(tmp_path):
    points, triangles, _ = as_arrays(shaken(mixed_sphere(4), 0.1))
    _, _, quads = as_arrays(mixed_sphere(4))
    result = surface.remesh((points, triangles, quads), max_iterations=5)
    result.to_html(tmp_path / "page.html")
    page = PageFile((tmp_path / "page.html").read_text(encoding="utf-8"))
    moved = page.frame(-1)
    assert moved[0].tobytes() == result.points.tobytes()
    np.testing.assert_array_equal(moved[2]["moved_by"], result.points - points)
    assert 0.0 < moved[2]["surface_distance"].max() < 0.05
    energy = page.contents["curves"][0]
    assert energy["lines"][0]["y"] == [record.energy for record in result.history]
    assert page.contents["report"]["text"] == str(result.report)
    assert page.contents["report"]["options"]["max_iterations"] == 5
    assert result._repr_html_().startswith("<iframe")


def test_other_cells_are_refused():
    points = np.eye(3)
    with pytest.raises(MeshError, match="same cells"):
        surface_page((points, [[0, 1, 2]]), (points, [[1, 0, 2]]))
