"""Pictures are there, and they show something."""

import numpy as np
import pytest
from matplotlib.image import imread

import hexconformal as hc
from hexconformal import generate
from hexconformal.plots import canvas
from hexconformal.plots import volume_plots as plots
from hexconformal.plots.volume_plots import before_after, histogram, worst_cells


def colours(picture):
    """Share of the pixels whose nearest plain colour is red-ish, blue-ish, or white."""
    red, green, blue = (picture[..., i] for i in range(3))
    return {
        "white": float(((red > 0.97) & (green > 0.97) & (blue > 0.97)).mean()),
        "warm": float((red > blue + 0.1).mean()),
        "cold": float((blue > red + 0.1).mean()),
    }


def test_histogram_shows_both_distributions(tmp_path):
    histogram(tmp_path / "q.png", generate.sheared_cube(6), generate.box((6, 6, 6)))
    picture = imread(tmp_path / "q.png")
    assert picture.shape[0] > 800
    assert picture.shape[1] > 1000
    share = colours(picture)
    assert share["white"] > 0.5
    assert share["warm"] > 0.05
    assert share["cold"] > 0.005


def test_histogram_of_one_mesh_has_one_colour(tmp_path):
    histogram(tmp_path / "q.png", hc.quality(generate.sheared_cube(6)))
    share = colours(imread(tmp_path / "q.png"))
    assert share["cold"] > 0.05
    assert share["warm"] < 0.001


def test_histogram_takes_inverted_and_degenerate_cells(tmp_path):
    points, cells = generate.box((2, 2, 2))
    points[13] = (2.0, 2.0, 2.0)
    points[0] = points[1]
    histogram(tmp_path / "q.svg", (points, cells))
    assert "<svg" in (tmp_path / "q.svg").read_text()


def test_pictures_need_a_known_extension(tmp_path):
    with pytest.raises(hc.WriteError, match="unknown extension"):
        histogram(tmp_path / "q.vtu", generate.box((1, 1, 1)))


def test_before_after_is_cut_open_and_coloured_by_quality(tmp_path, rendering, monkeypatch):
    before_after(tmp_path / "f.png", generate.sheared_cube(6), generate.box((6, 6, 6)))
    picture = imread(tmp_path / "f.png")
    half = picture.shape[1] // 2
    top = picture[: int(0.85 * picture.shape[0])]  # without the colour bar
    left, right = colours(top[:, :half]), colours(top[:, half:])
    assert 0.3 < left["white"] < 0.8
    assert 0.3 < right["white"] < 0.8
    assert left["warm"] > 0.05  # skewed cells
    assert right["warm"] < 0.005  # none after
    assert right["cold"] > 0.2
    # Cut open: what is seen through the gap is not what an uncut cube shows there.
    monkeypatch.setattr(plots, "_in_front_octant", lambda mesh: np.zeros(len(mesh.cells), dtype=bool))
    before_after(tmp_path / "uncut.png", generate.sheared_cube(6), generate.box((6, 6, 6)))
    differs = np.abs(imread(tmp_path / "uncut.png") - picture).max(axis=-1) > 0.05
    assert differs[:, :half].mean() > 0.03
    assert differs[:, half:].mean() > 0.03


def test_the_octant_that_faces_the_viewer_is_opened():
    mesh = hc.quality(generate.box((4, 4, 4)))
    opened = mesh.points[mesh.cells[plots._in_front_octant(mesh)]].mean(axis=1)
    assert len(opened) == 8
    assert (opened[:, 0] > 0.5).all()
    assert (opened[:, 1] < 0.5).all()
    assert (opened[:, 2] > 0.5).all()
    assert not plots._in_front_octant(hc.quality(generate.box((1, 1, 1)))).any()


def test_before_after_marks_inverted_cells(tmp_path, rendering):
    points, cells = generate.box((3, 3, 3))
    folded = points.copy()
    folded[3, 2] += 0.6  # the corner at the lower front, lifted past its neighbour
    before_after(tmp_path / "f.png", (folded, cells), (points, cells))
    red, green, blue = (imread(tmp_path / "f.png")[..., i] for i in range(3))
    assert ((red > green + 0.2) & (blue > green + 0.2)).mean() > 0.001


def test_worst_cells_are_shown_where_they_are(tmp_path, rendering):
    points, cells = generate.box((6, 6, 6))
    folded = points.copy()
    folded[0] += 0.3  # the corner nearest to the viewer but one, at the lower left
    worst_cells(tmp_path / "w.png", (folded, cells), (points, cells), count=4)
    picture = imread(tmp_path / "w.png")
    half, height = picture.shape[1] // 2, int(0.85 * picture.shape[0])
    red, green, blue = (picture[:height, :half, i] for i in range(3))
    purple = (red > green + 0.2) & (blue > green + 0.2)
    assert purple.sum() > 100
    where = np.argwhere(purple).mean(axis=0) / (height, half)
    assert 0.55 < where[0] < 0.85  # below the middle
    assert 0.1 < where[1] < 0.5  # left of it
    after = colours(picture[:height, half:])
    assert after["warm"] < 0.001  # the worst cells of a regular mesh are good
    assert 0.005 < after["cold"] < 0.1  # and only four of them are shown


def test_small_cells_get_a_ring(tmp_path, rendering, monkeypatch):
    mesh = generate.jittered(*generate.box((5, 5, 5)), 0.3, seed=0)
    rings = []
    for small in (0.0, 1.0):
        monkeypatch.setattr(canvas, "_RING_BELOW", small)
        worst_cells(tmp_path / "worst.svg", mesh, count=3)
        rings.append((tmp_path / "worst.svg").read_text().count("<use "))
    assert rings[1] - rings[0] == 3


def test_a_picture_of_no_cells_is_refused(tmp_path):
    with pytest.raises(hc.OptionError, match="count must be 1 or more"):
        worst_cells(tmp_path / "w.png", generate.box((2, 2, 2)), count=0)


def test_before_after_needs_the_same_cells(tmp_path):
    with pytest.raises(hc.MeshError, match="same cells"):
        before_after(tmp_path / "f.png", generate.box((2, 2, 2)), generate.box((3, 3, 3)))
