"""Pictures of surfaces are there, and they show something."""

import numpy as np
import pytest
from matplotlib.image import imread
from meshes.surfaces import icosphere, mixed_sphere, no_cells, quad_cube, shaken

import surface
from hexconformal.common.errors import MeshError, OptionError, WriteError
from hexconformal.geometry import Faces
from hexconformal.plots import canvas
from surface.plots.surface_plots import before_after, histogram, worst_cells


def as_mesh(shape):
    return surface.SurfaceMesh(*shape)


def shares(picture):
    """Share of the pixels that are white, reddish and bluish."""
    red, green, blue = (picture[..., i] for i in range(3))
    white = ((red > 0.97) & (green > 0.97) & (blue > 0.97)).mean()
    return {"white": white, "warm": (red > blue + 0.1).mean(), "cold": (blue > red + 0.1).mean()}


def test_histogram_shows_one_distribution_or_both(tmp_path):
    bad, good = as_mesh(shaken(mixed_sphere(6), 0.06)), as_mesh(mixed_sphere(6))
    histogram(tmp_path / "both.png", bad, good)
    share = shares(imread(tmp_path / "both.png"))
    assert share["white"] > 0.5
    assert share["warm"] > 0.03
    assert share["cold"] > 0.005
    histogram(tmp_path / "one.png", surface.quality(bad))
    share = shares(imread(tmp_path / "one.png"))
    assert share["cold"] > 0.03
    assert share["warm"] < 0.001


def test_histogram_takes_folded_and_flat_cells(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [0.2, 0.2, 0], [0, 1, 0], [2, 0, 0.0]])
    mesh = surface.SurfaceMesh(points, Faces(np.array([[0, 1, 4]]), np.array([[0, 1, 2, 3]])))
    histogram(tmp_path / "q.svg", mesh)
    assert "<svg" in (tmp_path / "q.svg").read_text()


def test_bad_cells_are_warm_before_and_gone_after(tmp_path, rendering):
    points, cells = icosphere(2)
    before_after(tmp_path / "f.png", surface.SurfaceMesh(points * [1, 1, 6], cells), as_mesh((points * 6, cells)))
    picture = imread(tmp_path / "f.png")
    half, top = picture.shape[1] // 2, int(0.85 * picture.shape[0])
    left, right = shares(picture[:top, :half]), shares(picture[:top, half:])
    assert left["warm"] > 0.02
    assert right["warm"] < 0.002
    assert right["cold"] > 0.1


def test_folded_quadrilaterals_are_purple(tmp_path, rendering):
    points, cells = quad_cube(3)
    folded = points.copy()
    folded[np.flatnonzero((points == [1, -1, 1]).all(axis=1))] -= [1, -1, 0]  # the corner nearest to the viewer
    before_after(tmp_path / "f.png", surface.SurfaceMesh(folded, cells), as_mesh((points, cells)))
    red, green, blue = (imread(tmp_path / "f.png")[..., i] for i in range(3))
    assert ((red > green + 0.2) & (blue > green + 0.2)).mean() > 0.001


def test_worst_cells_are_those_shown(tmp_path, rendering):
    points, cells = quad_cube(6)
    bent = points.copy()
    bent[np.flatnonzero((points == [1, -1, 1]).all(axis=1))] += [0.3, -0.3, 0.3]
    worst_cells(tmp_path / "w.png", surface.SurfaceMesh(bent, cells), as_mesh((points, cells)), count=3)
    picture = imread(tmp_path / "w.png")
    half, height = picture.shape[1] // 2, int(0.85 * picture.shape[0])
    warm = picture[:height, :half, 0] > picture[:height, :half, 2] + 0.1
    assert warm.sum() > 100
    where = np.argwhere(warm).mean(axis=0) / (height, half)
    assert 0.25 < where[0] < 0.6  # the corner in the middle of the silhouette
    assert 0.35 < where[1] < 0.65
    after = shares(picture[:height, half:])
    assert after["warm"] < 0.001
    assert 0.003 < after["cold"] < 0.05  # three cells, not the whole


def test_small_cells_get_a_ring(tmp_path, rendering, monkeypatch):
    rings = []
    for small in (0.0, 1.0):
        monkeypatch.setattr(canvas, "_RING_BELOW", small)
        worst_cells(tmp_path / "w.svg", as_mesh(shaken(mixed_sphere(4), 0.05)), count=3)
        rings.append((tmp_path / "w.svg").read_text().count("<use "))
    assert rings[1] - rings[0] == 3


def test_wrong_use_is_told(tmp_path):
    ball = as_mesh(icosphere(1))
    with pytest.raises(WriteError, match="unknown extension"):
        histogram(tmp_path / "q.vtu", ball)
    with pytest.raises(MeshError, match="same cells"):
        before_after(tmp_path / "f.png", ball, as_mesh(icosphere(2)))
    with pytest.raises(MeshError, match="same cells"):
        before_after(
            tmp_path / "f.png", ball, surface.SurfaceMesh(ball.points, Faces(ball.cells.triangles[::-1], no_cells(4)))
        )
    with pytest.raises(OptionError, match="count must be 1 or more"):
        worst_cells(tmp_path / "w.png", ball, count=0)
