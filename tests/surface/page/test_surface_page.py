"""Pages of surfaces hold what the surfaces have."""

import numpy as np
import pytest
import pyvista as pv
from meshes.surfaces import as_arrays, mixed_sphere, shaken
from web_pages import PageFile

import surface
from hexconformal import MeshError
from hexconformal.page import PageSchedule
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


def test_large_surfaces_have_worst_cells_and_what_is_around_them_and_larger_triangles():
    ball = pv.Icosphere(nsub=4)
    points, cells = np.array(ball.points, dtype=np.float64), ball.regular_faces
    far = int(points[:, 2].argmax())
    moved = points.copy()
    moved[far] += 0.03 * np.array([1.0, 0.5, 0.0])
    data = {"height": points[:, 2], "kind": np.where(points[:, 0] > 0, 1, 2)}
    mesh = surface.SurfaceMesh(points, cells).replaced(point_data=data)
    schedule = PageSchedule(most_cells=4000, worst=2)
    file = PageFile(surface_page(mesh, mesh.replaced(moved), schedule=schedule).to_html())
    told = file.contents["cells"]
    assert told["total"] == len(cells) == 5120
    quality = [surface.quality((at, cells)) for at in (points, moved)]
    worst = np.concatenate([np.argsort(one.conformality, kind="stable")[:2] for one in quality])
    near = np.isin(cells, np.unique(cells[worst])).any(axis=1)
    assert told["labels"] == np.flatnonzero(near).tolist()
    faces, sides = (file.array(file.contents[name]) for name in ("faces", "sides"))
    coarse = (sides == -2).all(axis=1)
    assert near.sum() == (~coarse).sum() < 100
    assert 900 < coarse.sum() <= 1000
    assert f"{near.sum()} of them: the worst ones by conformality" in file.contents["remarks"][0]
    assert f"{coarse.sum():,} larger triangles, without values of cells" in file.contents["remarks"][0]
    # Both together are closed, lie on the surface, and have the values at its nodes in both frames.
    edges = np.sort(np.stack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    places, of_cells, of_points = file.frame(0)
    node = np.array([np.abs(points - place).sum(axis=1).argmin() for place in places])
    np.testing.assert_array_equal(places, points[node])
    np.testing.assert_array_equal(file.frame(1)[0], moved[node])
    np.testing.assert_array_equal(of_points["height"], points[node, 2])
    np.testing.assert_array_equal(of_cells["conformality"], quality[0].conformality[near])
    assert sum(file.contents["measures"][0]["after"]) == len(cells)


def test_feature_curves_of_large_surfaces_stay():
    box = pv.Box(level=20, quads=True).clean()
    mesh = surface.SurfaceMesh(np.array(box.points, dtype=np.float64), box.regular_faces)
    file = PageFile(surface_page(mesh, schedule=PageSchedule(most_cells=400, worst=3)).to_html())
    whole = PageFile(surface_page(mesh).to_html())
    for name in ("edges", "corners"):
        ends = [one.frame(0)[0][one.array(one.contents["features"][name])] for one in (file, whole)]
        np.testing.assert_array_equal(*ends)
    assert len(whole.array(whole.contents["features"]["corners"])) == 8
    assert file.contents["cells"]["count"] < 40
